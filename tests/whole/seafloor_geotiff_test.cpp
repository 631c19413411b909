// Seafloors written as GeoTIFF, read with GDAL as other programs read them.

#include <array>
#include <filesystem>
#include <memory>
#include <string>

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/bed/geographic.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"

using namespace ensonify::tests;
using ensonify::engine::degree;

namespace {

std::unique_ptr<GDALDataset> opened(const std::filesystem::path& file) {
  GDALAllRegister();
  std::unique_ptr<GDALDataset> grid(GDALDataset::FromHandle(GDALOpen(file.c_str(), GA_ReadOnly)));
  REQUIRE(grid);
  return grid;
}

std::array<double, 6> transform_of(GDALDataset& grid) {
  std::array<double, 6> transform{};
  REQUIRE(grid.GetGeoTransform(transform.data()) == CE_None);
  return transform;
}

/// A survey of 3 x 3 points 1 m apart, the north-western one at (500000, 4000000).
void write_survey(const std::filesystem::path& file, int epsg, bool pixel_is_point) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> grid(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      file.c_str(), 3, 3, 1, GDT_Float32, nullptr));
  REQUIRE(grid);
  std::array<double, 6> transform{499999.5, 1.0, 0.0, 4000000.5, 0.0, -1.0};
  grid->SetGeoTransform(transform.data());
  if (pixel_is_point) grid->SetMetadataItem("AREA_OR_POINT", "Point");
  OGRSpatialReference system;
  REQUIRE(system.importFromEPSG(epsg) == OGRERR_NONE);
  grid->SetSpatialRef(&system);
  grid->GetRasterBand(1)->Fill(-10.0);
}

/// Writes a scene's seafloor as bed.tif.
void write_bed(const TemporaryFolder& folder, const std::string& scene) {
  write_text(folder / "scene.toml", "version = 1\n[seafloor]\n" + scene);
  const Outcome outcome = run_program(folder.path(), {"seafloor", "scene.toml", "-o", "bed.tif"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

}  // namespace

TEST_CASE("A survey's seafloor as GeoTIFF has the survey's reference system and exact position") {
  const TemporaryFolder folder;
  // UTM in the north and in the south, ETRS89, Lambert's azimuthal projection of Europe.
  for (const int epsg : {32619, 32756, 25832, 3035})
    for (const bool pixel_is_point : {false, true}) {
      CAPTURE(epsg, pixel_is_point);
      write_survey(folder / "survey.tif", epsg, pixel_is_point);
      // The track's origin does not matter if the survey has a reference system.
      write_bed(folder,
                "kind = \"survey\"\nsurvey = \"survey.tif\"\n"
                "[track]\norigin_lat_deg = 55\norigin_lon_deg = 10\n");
      const auto grid = opened(folder / "bed.tif"), survey = opened(folder / "survey.tif");
      REQUIRE(grid->GetSpatialRef());
      CHECK(grid->GetSpatialRef()->IsSame(survey->GetSpatialRef()));
      CHECK(grid->GetSpatialRef()->GetAuthorityCode(nullptr) == std::to_string(epsg));
      CHECK(transform_of(*grid) == std::array{499999.5, 1.0, 0.0, 4000000.5, 0.0, -1.0});
    }
}

TEST_CASE("The pixels of a finer grid are also centred at its points") {
  const TemporaryFolder folder;
  write_survey(folder / "survey.tif", 32619, false);
  write_bed(folder,
            "kind = \"survey\"\nsurvey = \"survey.tif\"\n[seafloor.detail]\ncell_m = 0.25\n"
            "height_at_1m_m = 0.001\nhurst = 0.5\n");
  const auto grid = opened(folder / "bed.tif");
  CHECK(grid->GetRasterXSize() == 9);
  CHECK(transform_of(*grid) == std::array{499999.875, 0.25, 0.0, 4000000.125, 0.0, -0.25});
}

TEST_CASE("A generated seafloor as GeoTIFF is centred at the track's origin, if there is one") {
  const TemporaryFolder folder;
  const std::string bed =
      "extent_east_m = 10000\nextent_north_m = 10000\ncell_m = 100\ndepth_m = 500\n";
  write_bed(folder, bed);
  CHECK(opened(folder / "bed.tif")->GetSpatialRef() == nullptr);

  write_bed(folder, bed + "[track]\norigin_lat_deg = -41.3\norigin_lon_deg = 174.8\n");
  const auto grid = opened(folder / "bed.tif");
  REQUIRE(grid->GetSpatialRef());
  const std::array<double, 6> transform = transform_of(*grid);
  OGRSpatialReference wgs84;
  wgs84.SetWellKnownGeogCS("WGS84");
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_earth(
      OGRCreateCoordinateTransformation(grid->GetSpatialRef(), &wgs84));
  REQUIRE(to_earth);
  for (const auto& [column, row] : {std::pair{0, 0}, {100, 0}, {50, 50}, {0, 100}, {100, 100}}) {
    CAPTURE(column, row);
    double x = transform[0] + (column + 0.5) * transform[1];
    double y = transform[3] + (row + 0.5) * transform[5];
    CHECK(x == -5000.0 + 100.0 * column);
    CHECK(y == 5000.0 - 100.0 * row);
    // Recordings have the same position.
    const auto expected =
        ensonify::engine::place_of_tangent({x, y}, {-41.3 * degree, 174.8 * degree});
    REQUIRE(to_earth->Transform(1, &x, &y));
    CHECK(x == Approx(expected.where.longitude_rad / degree).margin(4e-8));  // 3 mm
    CHECK(y == Approx(expected.where.latitude_rad / degree).margin(3e-8));
  }
}

TEST_CASE("A survey without a reference system is placed at the track's origin, if there is one") {
  const TemporaryFolder folder;
  write_text(folder / "survey.asc",
             "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 2000\ncellsize 2\n-9 -9 -9\n-9 -9 -9\n");
  const std::string scene = "kind = \"survey\"\nsurvey = \"survey.asc\"\n";
  write_bed(folder, scene);
  CHECK(opened(folder / "bed.tif")->GetSpatialRef() == nullptr);
  write_bed(folder, scene + "[track]\norigin_lat_deg = 55\norigin_lon_deg = 10\n");
  const auto grid = opened(folder / "bed.tif");
  REQUIRE(grid->GetSpatialRef());
  CHECK(transform_of(*grid) == std::array{1000.0, 2.0, 0.0, 2004.0, 0.0, -2.0});
  CHECK(grid->GetSpatialRef()->GetProjParm(SRS_PP_FALSE_EASTING) == Approx(1003.0));
  CHECK(grid->GetSpatialRef()->GetProjParm(SRS_PP_FALSE_NORTHING) == Approx(2002.0));
  CHECK(grid->GetSpatialRef()->GetProjParm(SRS_PP_LATITUDE_OF_ORIGIN) == Approx(55.0));
}

TEST_CASE("The seafloors of real surveys as GeoTIFF have the surveys' positions") {
  for (const std::string name : {"massbay_5m.tif", "portsmouth_tiny_0.5m.bag"}) {
    const auto file = data_file("bathymetry/" + name);
    if (!file) {
      WARN("skipped: " << name << " is not among the data");
      continue;
    }
    CAPTURE(name);
    const TemporaryFolder folder;
    std::filesystem::copy_file(*file, folder / name);
    write_bed(folder, "kind = \"survey\"\nsurvey = \"" + name + "\"\n");
    // (A GeoTIFF cannot hold a BAG's unnamed vertical reference system.)
    const auto grid = opened(folder / "bed.tif"), survey = opened(folder / name);
    REQUIRE(grid->GetSpatialRef());
    CHECK(grid->GetSpatialRef()->GetUTMZone() == 19);
    CHECK(grid->GetSpatialRef()->GetSemiMajor() == survey->GetSpatialRef()->GetSemiMajor());
    for (std::size_t i = 0; i < 6; ++i)
      CHECK(transform_of(*grid)[i] == Approx(transform_of(*survey)[i]).epsilon(1e-12));
  }
}

TEST_CASE("A seafloor as GeoTIFF has its reference system, or says why it has not") {
  const TemporaryFolder folder;
  write_survey(folder / "grid.tif", 32631, false);
  write_text(folder / "s.toml",
             "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"grid.tif\"\n");
  // Without PROJ's database, which some releases of GDAL need here and others do not.
  const Outcome outcome = run_program(folder.path(), {"seafloor", "s.toml", "-o", "bed.tif"},
                                      {"PROJ_LIB=/nowhere", "PROJ_DATA=/nowhere"});
  INFO(outcome.err);
  if (outcome.code == 0) {
    const auto grid = opened(folder / "bed.tif");
    const OGRSpatialReference* system = grid->GetSpatialRef();
    REQUIRE(system);
    CHECK(system->GetUTMZone() == 31);
  } else {
    CHECK(outcome.err.find("coordinate reference system") != std::string::npos);
    CHECK(outcome.err.find("PROJ_DATA") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder / "bed.tif"));
  }
}

TEST_CASE("A seafloor that was written as .npy is read again as a survey, unchanged") {
  const TemporaryFolder folder;
  write_text(folder / "bed.toml",
             "version = 1\n[seafloor]\nextent_east_m = 6\nextent_north_m = 4\ncell_m = 0.5\n");
  REQUIRE(run_program(folder.path(), {"seafloor", "bed.toml", "-o", "bed.npy"}).code == 0);
  write_text(folder / "survey.toml",
             "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"bed.npy\"\n");
  const Outcome without = run_program(folder.path(), {"seafloor", "survey.toml", "-o", "a.npy"});
  CHECK(without.code == 2);
  CHECK(without.err.find("set seafloor.survey_cell_m") != std::string::npos);
  const Outcome with = run_program(folder.path(), {"seafloor", "survey.toml", "-o", "a.npy", "-D",
                                                   "seafloor.survey_cell_m=0.5"});
  INFO(with.err);
  REQUIRE(with.code == 0);
  CHECK(read_text(folder / "a.npy") == read_text(folder / "bed.npy"));
}
