#include <ensonify/engine/seafloor/bed/survey_formats.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <cpl_conv.h>
#include <gdal_priv.h>

#include <ensonify/engine/output/png.h>
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

/// A mask that hides the first pixel.
void write_mask_beside(const std::filesystem::path& raster) {
  GDALAllRegister();
  const CPLConfigOptionSetter beside("GDAL_TIFF_INTERNAL_MASK", "NO", false);
  const std::unique_ptr<GDALDataset> dataset(
      GDALDataset::Open(raster.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  REQUIRE(dataset);
  REQUIRE(dataset->CreateMaskBand(GMF_PER_DATASET) == CE_None);
  GDALRasterBand& mask = *dataset->GetRasterBand(1)->GetMaskBand();
  std::vector<std::uint8_t> shown(
      static_cast<std::size_t>(mask.GetXSize()) * static_cast<std::size_t>(mask.GetYSize()), 255);
  shown[0] = 0;
  REQUIRE(mask.RasterIO(GF_Write, 0, 0, mask.GetXSize(), mask.GetYSize(), shown.data(),
                        mask.GetXSize(), mask.GetYSize(), GDT_Byte, 0, 0, nullptr) == CE_None);
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
  CHECK(files_behind(folder / "bed.vrt") ==
        std::vector<std::filesystem::path>{folder / "east.tif", folder / "west.tif"});
}

TEST_CASE("The files behind a file are those that change what is read, and no others") {
  const TemporaryFolder folder;
  write_halves(folder);
  write_text(folder / "bed.vrt", mosaic_text(east_half));
  const auto names = [&](const std::string& file) {
    std::vector<std::string> all;
    for (const std::filesystem::path& behind : files_behind(folder / file))
      all.push_back(behind.lexically_relative(folder.path()).string());
    return all;
  };
  using Names = std::vector<std::string>;
  // A mask beside one of a mosaic's sources, made by GDAL; and one beside the mosaic.
  const auto holes_in_mosaic = [&] {
    int holes = 0;
    for (const double z_m : read_survey(folder / "bed.vrt", 0.0).z_m) holes += std::isnan(z_m);
    return holes;
  };
  CHECK(names("west.tif").empty());
  REQUIRE(holes_in_mosaic() == 0);
  write_mask_beside(folder / "west.tif");
  CHECK(names("west.tif") == Names{"west.tif.msk"});
  CHECK(names("bed.vrt") == Names{"east.tif", "west.tif", "west.tif.msk"});
  write_text(folder / "whole.tif", tiff_4x3().bytes());
  write_mask_beside(folder / "whole.tif");
  std::filesystem::rename(folder / "whole.tif.msk", folder / "bed.vrt.msk");
  CHECK(holes_in_mosaic() == 1);
  CHECK(names("bed.vrt") == Names{"bed.vrt.msk", "east.tif", "west.tif", "west.tif.msk"});

  write_text(folder / "grid.asc", text_grid(rows_4x3));
  write_text(folder / "grid.xyz", "1 2 -3\n");
  CHECK(names("grid.asc").empty());
  write_text(folder / "grid.prj", "Projection UTM\nZone 32\nUnits METERS\n");
  CHECK(names("grid.asc") == Names{"grid.prj"});
  write_text(folder / "marked.asc", "\xef\xbb\xbf" + text_grid(rows_4x3));
  CHECK(names("marked.asc").empty());
  std::filesystem::copy_file(folder / "grid.prj", folder / "marked.prj");
  CHECK(names("marked.asc") == Names{"marked.prj"});

  Picture picture{.width = 3, .height = 2, .pixels = {1, 2, 3, 4, 5, 6}};
  const std::vector<std::byte> png = encode_png(picture);
  write_text(folder / "map.png", {reinterpret_cast<const char*>(png.data()), png.size()});
  CHECK(names("map.png").empty());
  write_text(folder / "map.pgw", "1\n0\n0\n-1\n0.5\n1.5\n");
  CHECK(names("map.png") == Names{"map.pgw"});
  CHECK(names("grid.xyz").empty());
  CHECK(names("missing.tif").empty());
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
