#include <ensonify/engine/seafloor/bed/survey.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("Of several bands the one with the name of heights is read, or else the first") {
  const TemporaryFolder folder;
  const Tiff heights = tiff_4x3();
  Tiff other = heights;
  for (float& z : other.heights) z = -3.0f;
  write_text(folder / "heights.tif", heights.bytes());
  write_text(folder / "other.tif", other.bytes());
  const Heightfield of_heights = read_survey(folder / "heights.tif", 0.0);
  const Heightfield of_other = read_survey(folder / "other.tif", 0.0);
  REQUIRE(of_heights.z_m != of_other.z_m);
  const auto with_bands = [&](const std::string& first, const std::string& second) {
    const auto band = [](int number, const std::string& name, const std::string& file) {
      return "<VRTRasterBand dataType=\"Float32\" band=\"" + std::to_string(number) +
             "\"><Description>" + name + "</Description><SimpleSource>" +
             "<SourceFilename relativeToVRT=\"1\">" + file + "</SourceFilename>" +
             "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>";
    };
    return survey_of(folder,
                     "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
                     "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>" +
                         band(1, first, "other.tif") + band(2, second, "heights.tif") +
                         "</VRTDataset>",
                     "bands.vrt")
        .z_m;
  };
  CHECK(with_bands("density", "Elevation") == of_heights.z_m);
  CHECK(with_bands("Depth uncertainty", "depth") == of_heights.z_m);
  CHECK(with_bands("elevation", "bathymetry") == of_other.z_m);
  CHECK(with_bands("", "") == of_other.z_m);
}

namespace {

/// A VRT of heights.tif, with more elements in its band or after it.
std::string vrt_of_heights(const std::string& in_band, const std::string& after = {}) {
  return "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><SRS>EPSG:32619</SRS>"
         "<GeoTransform>500000, 1, 0, 4000000, 0, -1</GeoTransform>"
         "<VRTRasterBand dataType=\"Float32\" band=\"1\">" +
         in_band +
         "<SimpleSource><SourceFilename relativeToVRT=\"1\">heights.tif</SourceFilename>"
         "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>" +
         after + "</VRTDataset>";
}

}  // namespace

TEST_CASE("Heights in another unit than metres are refused") {
  const TemporaryFolder folder;
  write_text(folder / "heights.tif", tiff_4x3().bytes());
  const auto error_for = [&](const std::string& unit) {
    return survey_error(folder, vrt_of_heights("<UnitType>" + unit + "</UnitType>"), "bed.vrt");
  };
  for (const char* const unit : {"m", "M", "metre", "Meters"}) CHECK(error_for(unit).empty());
  for (const char* const unit : {"cm", "dm", "km", "fathom", "FT", "US survey foot"})
    CHECK(has(error_for(unit), "has heights in '" + std::string(unit) +
                                   "'; convert them to metres with gdal_calc.py"));
}

TEST_CASE("Heights that a mask or an alpha band hides are holes") {
  const TemporaryFolder folder;
  write_text(folder / "heights.tif", tiff_4x3().bytes());
  Tiff mask = tiff_4x3();
  mask.heights.assign(12, 255.0f);
  mask.heights[2] = 0.0f;
  write_text(folder / "mask.tif", mask.bytes());
  const auto band = [](const std::string& attributes, const std::string& colour) {
    return "<VRTRasterBand dataType=\"Byte\"" + attributes + ">" + colour +
           "<SimpleSource><SourceFilename relativeToVRT=\"1\">mask.tif</SourceFilename>"
           "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>";
  };
  for (const std::string& hides : {"<MaskBand>" + band("", "") + "</MaskBand>",
                                   band(" band=\"2\"", "<ColorInterp>Alpha</ColorInterp>")}) {
    const Heightfield field = survey_of(folder, vrt_of_heights("", hides), "bed.vrt");
    CHECK(valid_share(field) == Approx(11.0 / 12.0));
    CHECK(std::isnan(field.at(2, 2)));
    CHECK(field.at(3, 2) == -4.0);
    std::vector<double> window(2);
    survey_tiles(folder / "bed.vrt", 0.0)(2, 2, 2, 1, window, {});
    CHECK(std::isnan(window[0]));
    CHECK(window[1] == -4.0);
  }
}

TEST_CASE("An uncertainty with a scale and an offset of its own scatters as one in metres") {
  const TemporaryFolder folder;
  write_text(folder / "heights.tif", tiff_4x3().bytes());
  const auto heights_with = [&](float raw, const std::string& in_metres) {
    Tiff uncertainty = tiff_4x3();
    uncertainty.heights.assign(12, raw);
    uncertainty.heights[5] = -1.0f;  // NODATA
    write_text(folder / "uncertainty.tif", uncertainty.bytes());
    write_text(folder / "bed.vrt",
               vrt_of_heights("",
                              "<VRTRasterBand dataType=\"Float32\" band=\"2\">"
                              "<Description>uncertainty</Description>"
                              "<NoDataValue>-1</NoDataValue>" +
                                  in_metres +
                                  "<SimpleSource><SourceFilename relativeToVRT=\"1\">"
                                  "uncertainty.tif</SourceFilename>"
                                  "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>"));
    return read_survey(folder / "bed.vrt", 0.0, {.of_uncertainty = 1.0, .seed = 3}).z_m;
  };
  const std::vector<double> in_metres = heights_with(0.5f, "");
  CHECK(in_metres[0] != -9.0);
  CHECK(in_metres[5] == -6.0);
  CHECK(heights_with(25.0f, "<Offset>0.25</Offset><Scale>0.01</Scale>") == in_metres);
}
