// What GDAL opens by itself beside a raster: its metadata count, and nothing else than regular
// files of the raster's folder is opened.

#include <ensonify/engine/seafloor/bed/files_beside.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gdal_priv.h>
#include <sys/stat.h>

#include <ensonify/engine/comparison/picture_source.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/layers/area_files.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/mesh_files.h"
#include "support/message.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::MeshError;
namespace fs = std::filesystem;

namespace {

std::string metadata(const std::string& of_file, const std::string& of_band) {
  return "<PAMDataset>" + of_file + "<PAMRasterBand band=\"1\">" + of_band +
         "</PAMRasterBand></PAMDataset>";
}

int holes_in(const Heightfield& field) {
  int holes = 0;
  for (const double z_m : field.z_m) holes += std::isnan(z_m);
  return holes;
}

std::vector<std::string> names_behind(const fs::path& file) {
  std::vector<std::string> names;
  for (const fs::path& behind : files_behind(file)) names.push_back(behind.filename().string());
  return names;
}

/// A raster of each kind, and the names of files beside it that GDAL opens by itself.
struct Kind {
  std::string name;
  std::vector<std::string> beside;
};
const std::vector<Kind> kinds{
    {"b.tif", {"b.tif.aux.xml", "b.tif.msk", "b.tfw", "b.tifw", "b.wld", "b.tab", "b.tif.ovr"}},
    {"b.asc", {"b.asc.aux.xml", "b.asc.msk", "b.prj", "b.PRJ", "b.aux", "b.asc.aux"}},
    {"b.png", {"b.png.aux.xml", "b.png.msk", "b.pgw", "b.pngw", "b.wld", "b.tab", "b.aux"}},
    {"b.vrt", {"b.vrt.msk", "b.asc.msk", "b.prj", "b.aux", "b.asc.aux", "b.asc.ovr"}},
};

void write_kinds(const TemporaryFolder& folder) {
  write_text(folder / "b.tif", tiff_4x3().bytes());
  write_text(folder / "b.asc", text_grid(rows_4x3));
  const auto png = encode_png({4, 3, 1, {1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3}});
  write_text(folder / "b.png", {reinterpret_cast<const char*>(png.data()), png.size()});
  write_text(folder / "b.vrt",
             "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><GeoTransform>500000, 0.5, 0, "
             "4000001.5, 0, -0.5</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\">"
             "<NoDataValue>-9999</NoDataValue>"
             "<SimpleSource><SourceFilename relativeToVRT=\"1\">b.asc</SourceFilename>"
             "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>");
}

/// The grid of a seabed that the picture fits.
Heightfield area_grid() {
  Heightfield grid;
  grid.columns = 5;
  grid.rows = 4;
  grid.cell_east_m = grid.cell_north_m = 1.0;
  return grid;
}

/// Why such a file is refused, by all that reads it; empty if it is read.
std::string refusal(const TemporaryFolder& folder, const std::string& name) {
  std::string why = message_thrown<ensonify::Error>([&] { files_behind(folder / name); });
  CHECK(message_thrown<ensonify::Error>([&] {
          if (name == "b.png")
            read_area_image(folder / name, area_grid(), 1);
          else
            read_survey(folder / name, 0.0);
        }) == why);
  return why;
}

}  // namespace

TEST_CASE("GDAL's metadata beside a raster count as its own") {
  const TemporaryFolder folder;
  write_text(folder / "b.tif", tiff_4x3().bytes());
  const Heightfield bare = read_survey(folder / "b.tif", 0.0);
  REQUIRE(holes_in(bare) == 0);
  REQUIRE(bare.utm_zone == 19);
  CHECK(names_behind(folder / "b.tif").empty());

  write_text(folder / "b.tif.aux.xml",
             metadata("<SRS>EPSG:32631</SRS><GeoTransform>400000,2,0,5000000,0,-2</GeoTransform>",
                      "<NoDataValue>-6</NoDataValue><Offset>0.5</Offset><Scale>2</Scale>"));
  const Heightfield field = read_survey(folder / "b.tif", 0.0);
  CHECK(holes_in(field) == 1);
  CHECK(std::isnan(field.at(1, 1)));
  CHECK(field.at(0, 0) == 2.0 * -9.0 + 0.5);
  CHECK(field.utm_zone == 31);
  CHECK(field.cell_east_m == 2.0);
  CHECK(field.world_origin.head<2>() == Eigen::Vector2d(400004.0, 4999997.0));
  CHECK(read_survey_header(folder / "b.tif").utm_zone == 31);
  CHECK(std::isnan(sample_survey(folder / "b.tif", 0.0).parts.front().at(1, 1)));
  CHECK(names_behind(folder / "b.tif") == std::vector<std::string>{"b.tif.aux.xml"});

  write_text(folder / "b.tif.aux.xml", metadata("", "<UnitType>ft</UnitType>"));
  CHECK(has(survey_error(folder, tiff_4x3().bytes(), "b.tif"), "has heights in 'ft'"));
  // Statistics alone change nothing, and nothing is written.
  const std::string statistics =
      metadata("", "<Metadata><MDI key=\"STATISTICS_MAXIMUM\">-1</MDI></Metadata><Histograms/>");
  write_text(folder / "b.tif.aux.xml", statistics);
  CHECK(read_survey(folder / "b.tif", 0.0).z_m == bare.z_m);
  CHECK(read_text(folder / "b.tif.aux.xml") == statistics);
  CHECK(names_in(folder.path()).size() == 2);
}

TEST_CASE("GDAL's metadata count beside text grids, with and without a mark, and area images") {
  const TemporaryFolder folder;
  write_kinds(folder);
  write_text(folder / "marked.asc", "\xef\xbb\xbf" + text_grid(rows_4x3));
  for (const std::string name : {"b.asc", "marked.asc"}) {
    write_text(folder / (name + ".aux.xml"), metadata("", "<Scale>0.5</Scale>"));
    CHECK(read_survey(folder / name, 0.0).at(0, 0) == -4.5);
    CHECK(names_behind(folder / name) == std::vector<std::string>{name + ".aux.xml"});
  }
  CHECK(read_area_image(folder / "b.png", area_grid(), 1).pixel_east_m == 1.0);
  write_text(folder / "b.png.aux.xml", metadata("<GeoTransform>-9,7,0,9,0,-7</GeoTransform>", ""));
  CHECK(read_area_image(folder / "b.png", area_grid(), 1).pixel_east_m == 7.0);
}

TEST_CASE("What lies beside a raster is a regular file of its folder, or is refused by its name") {
  const TemporaryFolder folder, outside;
  write_kinds(folder);
  fs::create_directory(folder / "below");
  for (const Kind& kind : kinds) {
    CHECK(refusal(folder, kind.name).empty());
    for (const std::string& name : kind.beside) {
      CAPTURE(kind.name, name);
      const fs::path beside = folder / name;
      const auto refused_for = [&](const std::string& why) {
        CHECK_THAT(refusal(folder, kind.name), Catch::StartsWith(beside.string() + ": ") &&
                                                   Catch::Contains(why) &&
                                                   Catch::Contains(beside.stem().stem().string()));
        fs::remove(beside);
      };
      REQUIRE(mkfifo(beside.c_str(), 0600) == 0);
      refused_for("is not a regular file; remove it");
      fs::create_symlink("/dev/zero", beside);
      refused_for("is not a regular file; remove it");
      write_text(outside / "secret", "LOCAL_CS[\"SECRET\",UNIT[\"metre\",1]]");
      fs::create_symlink(outside / "secret", beside);
      refused_for("is a link that leads out of " + folder.path().string());
      fs::create_symlink("nowhere", beside);  // GDAL finds nothing there
      CHECK(refusal(folder, kind.name).empty());
      fs::remove(beside);
      const bool is_image = name.ends_with(".msk") || name.ends_with(".ovr");
      fs::create_directory(beside);  // some formats of images are folders
      if (is_image) {
        refused_for("is not a regular file; remove it");
      } else {
        CHECK(refusal(folder, kind.name).empty());
        fs::remove(beside);
      }
      if (!is_image && !name.ends_with(".aux")) {
        write_text(beside, "");
        fs::resize_file(beside, 300'000'000);
        refused_for("has 300000000 bytes, expected at most ");
      }
      // GDAL would open it by any of its drivers.
      write_text(beside, "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"></VRTDataset>");
      if (is_image)
        refused_for("is no TIFF file");
      else
        fs::remove(beside);
    }
  }
  // Of an ERDAS file GDAL would take overviews for a mosaic; for its parts alone it is not opened.
  write_text(folder / "b.aux", "EHFA_HEADER_TAG");
  CHECK(has(refusal(folder, "b.vrt"), "b.aux: is an ERDAS file beside a part of b.vrt"));
  CHECK(refusal(folder, "b.asc").empty());
  write_text(folder / "b.tif.aux.xml", "<PAMDataset><SRS>");
  CHECK(has(refusal(folder, "b.tif"), "is no whole metadata of GDAL"));
  // A link to a file in the folder, or below it, is as good as the file.
  write_text(folder / "below/metadata", metadata("", "<NoDataValue>-6</NoDataValue>"));
  fs::remove(folder / "b.tif.aux.xml");
  fs::create_symlink("below/metadata", folder / "b.tif.aux.xml");
  CHECK(holes_in(read_survey(folder / "b.tif", 0.0)) == 1);
}

TEST_CASE("Pictures that are compared are read without what lies beside them") {
  const TemporaryFolder folder;
  write_kinds(folder);
  for (const std::string name : {"b.tif", "b.asc", "b.vrt"}) fs::remove(folder / name);
  CHECK(line_of_pictures(folder.path()).pings.size() == 3);
  REQUIRE(mkfifo((folder / "b.pgw").c_str(), 0600) == 0);
  CHECK_THROWS_WITH(line_of_pictures(folder.path()), Catch::Contains("is not a regular file"));
}

TEST_CASE("A raster whose metadata name another file with its overviews is refused") {
  const TemporaryFolder folder;
  write_kinds(folder);
  write_text(folder / "b.tif.aux.xml",
             "<PAMDataset><Metadata domain=\"OVERVIEWS\"><MDI key=\"OVERVIEW_FILE\">/etc/passwd"
             "</MDI></Metadata></PAMDataset>");
  CHECK(has(survey_error(folder, tiff_4x3().bytes(), "b.tif"), "names another file with its"));
  std::string mosaic = read_text(folder / "b.vrt");
  mosaic.replace(mosaic.find("<VRTRasterBand"), 0,
                 "<Metadata domain=\"OVERVIEWS\"><MDI key=\"OVERVIEW_FILE\">/etc/passwd</MDI>"
                 "</Metadata>");
  CHECK(has(survey_error(folder, mosaic, "b.vrt"), "names another file with its"));
  // In the file itself, as a part of a mosaic.
  fs::remove(folder / "b.tif.aux.xml");
  GDALAllRegister();
  {
    const std::unique_ptr<GDALDataset> made(
        GetGDALDriverManager()->GetDriverByName("GTiff")->Create((folder / "c.tif").c_str(), 4, 3,
                                                                 1, GDT_Float32, nullptr));
    made->SetMetadataItem("OVERVIEW_FILE", "/etc/passwd", "OVERVIEWS");
  }
  REQUIRE(!fs::exists(folder / "c.tif.aux.xml"));
  CHECK(has(survey_error(folder, replaced(replaced(mosaic, "/etc/passwd", ""), "b.asc", "c.tif"),
                         "b.vrt"),
            "names 'c.tif', which names another file with its overviews"));
}
