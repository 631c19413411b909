#include <ensonify/engine/seafloor/bed/survey_mosaic.h>

#include <filesystem>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/survey.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A VRT of two halves of 2 x 3 points, or with another `source` in place of the second.
std::string mosaic_text(const std::string& source) {
  const auto half = [](const std::string& element, int column) {
    return "<SimpleSource>" + element +
           "<SourceBand>1</SourceBand><SrcRect xOff=\"0\" yOff=\"0\" xSize=\"2\" ySize=\"3\"/>"
           "<DstRect xOff=\"" +
           std::to_string(column) + "\" yOff=\"0\" xSize=\"2\" ySize=\"3\"/></SimpleSource>";
  };
  return "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
         "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>"
         "<VRTRasterBand dataType=\"Float32\" band=\"1\"><NoDataValue>-9999</NoDataValue>" +
         half("<SourceFilename relativeToVRT=\"1\">west.tif</SourceFilename>", 0) +
         half(source, 2) + "</VRTRasterBand></VRTDataset>";
}
const std::string east_half = "<SourceFilename relativeToVRT=\"1\">east.tif</SourceFilename>";

void write_halves(const TemporaryFolder& folder) {
  const Tiff whole = tiff_4x3();
  for (const int half : {0, 1}) {
    Tiff tiff;
    tiff.columns = 2;
    tiff.rows = 3;
    tiff.transform = {500000.0 + 2 * half, 1, 0, 4000000, 0, -1};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 2; ++column)
        tiff.heights.push_back(
            whole.heights[row * 4 + static_cast<std::size_t>(2 * half) + column]);
    write_text(folder / (half == 0 ? "west.tif" : "east.tif"), tiff.bytes());
  }
}

}  // namespace

TEST_CASE("A VRT mosaic of local files reads as the whole grid") {
  const TemporaryFolder folder;
  write_halves(folder);
  const Heightfield whole = survey_of(folder, tiff_4x3().bytes(), "whole.tif", 0.5);
  const Heightfield mosaic = survey_of(folder, mosaic_text(east_half), "bed.vrt", 0.5);
  CHECK(mosaic.z_m == whole.z_m);
  CHECK(mosaic.world_origin == whole.world_origin);
  CHECK(mosaic.utm_zone == whole.utm_zone);
  CHECK(files_of_survey(folder / "bed.vrt") ==
        std::vector<std::filesystem::path>{folder / "bed.vrt", folder / "west.tif",
                                           folder / "east.tif"});
}

TEST_CASE("A VRT mosaic that names other hosts, other mosaics or functions is refused") {
  const TemporaryFolder folder;
  write_halves(folder);
  write_text(folder / "inner.vrt", mosaic_text(east_half));
  write_text(folder / "inner.tif", mosaic_text(east_half));
  const auto named = [](const std::string& file) {
    return "<SourceFilename relativeToVRT=\"0\">" + file + "</SourceFilename>";
  };
  for (const std::string& source :
       {named("/vsicurl/http://localhost/east.tif"), named("http://localhost/east.tif"),
        named("/vsizip/east.zip"), named(""), named("east.tif"),
        named((folder / "inner.vrt").string()), named((folder / "inner.tif").string()),
        named("&lt;VRTDataset&gt;"),
        east_half + "<OpenOptions><OOI key=\"a\">b</OOI></OpenOptions>",
        east_half + "<PixelFunctionType>sum</PixelFunctionType>"}) {
    CAPTURE(source);
    CHECK(has(survey_error(folder, mosaic_text(source), "bed.vrt"), "local files"));
  }
  CHECK(has(survey_error(folder, "<VRTDataset rasterXSize=\"4\"", "bed.vrt"), "VRT"));
}

TEST_CASE("A VRT mosaic names files only below its own folder") {
  const TemporaryFolder folder;
  write_halves(folder);
  const std::filesystem::path inner = folder / "inner";
  std::filesystem::create_directory(inner);
  std::filesystem::create_symlink(folder / "east.tif", inner / "link.tif");
  std::filesystem::copy_file(folder / "west.tif", inner / "west.tif");
  for (const std::string& source :
       {std::string("<SourceFilename relativeToVRT=\"1\">../east.tif"),
        std::string("<SourceFilename relativeToVRT=\"1\">link.tif"),
        "<SourceFilename relativeToVRT=\"0\">" + (folder / "east.tif").string()}) {
    CAPTURE(source);
    CHECK(has(survey_error(folder, mosaic_text(source + "</SourceFilename>"), "inner/bed.vrt"),
              "does not lie in its own folder"));
  }
}
