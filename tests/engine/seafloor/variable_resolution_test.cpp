// A BAG of variable resolution: GDAL writes its coarse grid, and HDF5 its refinements, as the
// Open Navigation Surface's specification 1.6 has them.

#include <ensonify/engine/seafloor/bed/variable_resolution.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gdal_priv.h>
#include <hdf5.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/seafloor/bed/survey.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

namespace fs = std::filesystem;

constexpr int coarse_columns = 4, coarse_rows = 3;
constexpr double coarse_m = 32.0, west_m = 500000.0, south_m = 4000000.0;
constexpr double uncertainty_m = 0.5;

/// The nodes of each refinement are in its cells' middles. Its size in metres by coarse cell, from
/// the south-west; 0: no heights there.
using Resolution = std::array<float, coarse_columns * coarse_rows>;

struct Metadata {
  std::uint32_t index, dimensions_x, dimensions_y;
  float resolution_x, resolution_y, sw_corner_x, sw_corner_y;
};
struct Node {
  float depth, depth_uncrt;
};

/// The least and the greatest size of cells, as attributes of the table.
void write_limits(hid_t table, float min_m, float greatest_m) {
  const hid_t space = H5Screate(H5S_SCALAR);
  for (const auto& [name, value] : {std::pair{"min_resolution_x", min_m},
                                    {"min_resolution_y", min_m},
                                    {"max_resolution_x", greatest_m},
                                    {"max_resolution_y", greatest_m}}) {
    const hid_t attribute =
        H5Acreate2(table, name, H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT);
    REQUIRE(H5Awrite(attribute, H5T_NATIVE_FLOAT, &value) >= 0);
    H5Aclose(attribute);
  }
  H5Sclose(space);
}

void write_table(hid_t file, const char* name, hid_t type, hsize_t rows, hsize_t columns,
                 const void* data) {
  const std::array<hsize_t, 2> size{rows, columns};
  const hid_t space = H5Screate_simple(2, size.data(), nullptr);
  const hid_t table = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  REQUIRE(table >= 0);
  REQUIRE(H5Dwrite(table, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
  write_limits(table, 1.0f, 8.0f);
  H5Dclose(table);
  H5Sclose(space);
}

/// A file whose nodes have the heights z_m(east, north) of its south-west corner.
void write_bag(const fs::path& file, const Resolution& resolution,
               const std::function<double(double, double)>& z_m) {
  GDALAllRegister();
  const auto close = [](GDALDataset* open) { GDALClose(open); };
  {
    const std::unique_ptr<GDALDataset, decltype(close)> coarse(
        GetGDALDriverManager()->GetDriverByName("MEM")->Create("", coarse_columns, coarse_rows, 2,
                                                               GDT_Float32, nullptr),
        close);
    std::array<double, 6> place{west_m, coarse_m, 0.0, south_m + coarse_rows * coarse_m,
                                0.0,    -coarse_m};
    coarse->SetGeoTransform(place.data());
    OGRSpatialReference system;
    REQUIRE(system.importFromEPSG(32619) == OGRERR_NONE);
    coarse->SetSpatialRef(&system);
    for (int band = 1; band <= 2; ++band) coarse->GetRasterBand(band)->Fill(-10.0);
    const std::unique_ptr<GDALDataset, decltype(close)> bag(
        GetGDALDriverManager()->GetDriverByName("BAG")->CreateCopy(
            file.c_str(), coarse.get(), FALSE, nullptr, nullptr, nullptr),
        close);
    REQUIRE(bag);
  }
  std::vector<Metadata> table;
  std::vector<Node> nodes;
  for (int row = 0; row < coarse_rows; ++row)
    for (int column = 0; column < coarse_columns; ++column) {
      const float side = resolution[static_cast<std::size_t>(row * coarse_columns + column)];
      if (side == 0.0f) {
        table.push_back({0xffffffffu, 0, 0, -1.0f, -1.0f, -1.0f, -1.0f});
        continue;
      }
      const auto count = static_cast<std::uint32_t>(coarse_m / side);
      table.push_back({static_cast<std::uint32_t>(nodes.size()), count, count, side, side,
                       0.5f * side, 0.5f * side});
      for (std::uint32_t j = 0; j < count; ++j)
        for (std::uint32_t i = 0; i < count; ++i)
          nodes.push_back({static_cast<float>(z_m(column * coarse_m + (i + 0.5) * side,
                                                  row * coarse_m + (j + 0.5) * side)),
                           static_cast<float>(uncertainty_m)});
    }
  const hid_t open = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(open >= 0);
  const hid_t of_table = H5Tcreate(H5T_COMPOUND, sizeof(Metadata));
  H5Tinsert(of_table, "index", offsetof(Metadata, index), H5T_NATIVE_UINT32);
  H5Tinsert(of_table, "dimensions_x", offsetof(Metadata, dimensions_x), H5T_NATIVE_UINT32);
  H5Tinsert(of_table, "dimensions_y", offsetof(Metadata, dimensions_y), H5T_NATIVE_UINT32);
  H5Tinsert(of_table, "resolution_x", offsetof(Metadata, resolution_x), H5T_NATIVE_FLOAT);
  H5Tinsert(of_table, "resolution_y", offsetof(Metadata, resolution_y), H5T_NATIVE_FLOAT);
  H5Tinsert(of_table, "sw_corner_x", offsetof(Metadata, sw_corner_x), H5T_NATIVE_FLOAT);
  H5Tinsert(of_table, "sw_corner_y", offsetof(Metadata, sw_corner_y), H5T_NATIVE_FLOAT);
  write_table(open, "/BAG_root/varres_metadata", of_table, coarse_rows, coarse_columns,
              table.data());
  const hid_t of_nodes = H5Tcreate(H5T_COMPOUND, sizeof(Node));
  H5Tinsert(of_nodes, "depth", offsetof(Node, depth), H5T_NATIVE_FLOAT);
  H5Tinsert(of_nodes, "depth_uncrt", offsetof(Node, depth_uncrt), H5T_NATIVE_FLOAT);
  write_table(open, "/BAG_root/varres_refinements", of_nodes, 1, nodes.size(), nodes.data());
  H5Tclose(of_nodes);
  H5Tclose(of_table);
  H5Fclose(open);
}

/// Puts another table in the place of one of a file's.
void replace_table(const fs::path& file, const char* name,
                   const std::function<void(hid_t made_with)>& describe) {
  const hid_t open = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(H5Ldelete(open, name, H5P_DEFAULT) >= 0);
  const std::array<hsize_t, 2> size{coarse_rows, coarse_columns};
  const hid_t space = H5Screate_simple(2, size.data(), nullptr);
  const hid_t made_with = H5Pcreate(H5P_DATASET_CREATE);
  describe(made_with);
  const hid_t table =
      H5Dcreate2(open, name, H5T_NATIVE_FLOAT, space, H5P_DEFAULT, made_with, H5P_DEFAULT);
  REQUIRE(table >= 0);
  H5Dclose(table);
  H5Pclose(made_with);
  H5Sclose(space);
  H5Fclose(open);
}

/// Metres from the south-west corner.
double east_of(const Heightfield& field, int column) {
  return field.x_m(column) + field.world_origin.x() - west_m;
}
double north_of(const Heightfield& field, int row) {
  return field.y_m(row) + field.world_origin.y() - south_m;
}

constexpr Resolution mixed{1, 2, 8, 4,  //
                           4, 8, 1, 2,  //
                           2, 1, 4, 8};

double plane(double east, double north) { return -20.0 + 0.05 * east - 0.03 * north; }

}  // namespace

TEST_CASE("A BAG of variable resolution is read on its finest cells, with slopes for steps") {
  const TemporaryFolder folder;
  write_bag(folder / "plane.bag", mixed, plane);
  const Heightfield field = read_survey(folder / "plane.bag", 0.0);
  CHECK(field.cell_east_m == 1.0);
  CHECK(field.columns == 128);
  CHECK(field.rows == 96);
  CHECK(field.utm_zone == 19);
  // Inside a refinement a plane comes back, and between refinements nearly so: where a fine one and
  // a coarse one meet, a square has a part of a step. The steps themselves are as high as the plane
  // rises over 8 m in both directions: 0.64 m.
  double inside_m = 0.0, between_m = 0.0;
  for (int row = 8; row < field.rows - 8; ++row)
    for (int column = 8; column < field.columns - 8; ++column) {
      const double off_m =
          std::abs(field.at(column, row) - plane(east_of(field, column), north_of(field, row)));
      const auto near = [](int at) { return at % 32 < 8 || at % 32 >= 24; };
      double& worst_m = near(column) || near(row) ? between_m : inside_m;
      worst_m = std::max(worst_m, off_m);
    }
  CHECK(inside_m < 1e-5);
  CHECK(between_m < 0.64 / 8.0);
}

TEST_CASE("A refinement of the finest cells keeps its heights, and one without heights is a hole") {
  const TemporaryFolder folder;
  Resolution resolution;
  resolution.fill(1.0f);
  resolution[5] = 0.0f;
  const auto rough = [](double east, double north) {
    return -20.0 + std::sin(1.3 * east) * std::cos(0.9 * north);
  };
  write_bag(folder / "a.bag", resolution, rough);
  const Heightfield field = read_survey(folder / "a.bag", 0.0);
  REQUIRE(field.columns == 128);
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const bool hole = column / 32 == 1 && row / 32 == 1;
      REQUIRE(std::isnan(field.at(column, row)) == hole);
      if (!hole)
        REQUIRE(field.at(column, row) ==
                Approx(rough(east_of(field, column), north_of(field, row))).margin(1e-5));
    }
}

TEST_CASE("Windows of a BAG of variable resolution are those of the whole") {
  const TemporaryFolder folder;
  const auto rough = [](double east, double north) {
    return -20.0 + 0.4 * std::sin(0.3 * east) * std::cos(0.2 * north);
  };
  write_bag(folder / "a.bag", mixed, rough);
  const SurveyScatter scatter{GENERATE(0.0, 1.0), 3};
  const Heightfield field = read_survey(folder / "a.bag", 0.0, scatter);
  const auto heights = survey_tiles(folder / "a.bag", 0.0, scatter);
  for (const auto& [column, row, columns, rows] :
       {std::array{0, 0, 128, 96}, {31, 60, 40, 36}, {100, 1, 28, 17}}) {
    std::vector<double> z_m(static_cast<std::size_t>(columns * rows));
    heights(column, row, columns, rows, z_m, {});
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        REQUIRE(z_m[static_cast<std::size_t>(j * columns + i)] ==
                Approx(field.at(column + i, row + j)).margin(1e-6));
  }
}

TEST_CASE("A survey's heights scatter by its uncertainty, if that is wanted") {
  const TemporaryFolder folder;
  Resolution resolution;
  resolution.fill(1.0f);
  write_bag(folder / "a.bag", resolution, plane);
  const Heightfield exact = read_survey(folder / "a.bag", 0.0);
  const auto difference = [&](const SurveyScatter& scatter) {
    Heightfield field = read_survey(folder / "a.bag", 0.0, scatter);
    for (std::size_t i = 0; i < field.z_m.size(); ++i) field.z_m[i] -= exact.z_m[i];
    return field.z_m;
  };
  const std::vector<double> once = difference({1.0, 5}), again = difference({1.0, 5});
  CHECK(once == again);
  CHECK(once != difference({1.0, 6}));
  double sum = 0.0, square = 0.0, neighbours = 0.0;
  for (std::size_t i = 0; i < once.size(); ++i) {
    sum += once[i];
    square += once[i] * once[i];
    if (i > 0) neighbours += once[i] * once[i - 1];
  }
  const auto count = static_cast<double>(once.size());  // 12,288
  CHECK(std::abs(sum / count) < 4.0 * uncertainty_m / std::sqrt(count));
  CHECK(std::sqrt(square / count) == Approx(uncertainty_m).epsilon(4.0 / std::sqrt(2.0 * count)));
  CHECK(std::abs(neighbours / square) < 4.0 / std::sqrt(count));
  const std::vector<double> twice = difference({2.0, 5});
  for (std::size_t i = 0; i < once.size(); ++i)
    REQUIRE(twice[i] == Approx(2.0 * once[i]).margin(1e-9));
}

TEST_CASE("A mosaic of BAGs of variable resolution is refused: it would have their overviews") {
  const TemporaryFolder folder;
  Resolution resolution;
  resolution.fill(2.0f);
  write_bag(folder / "a.bag", resolution, plane);
  write_text(folder / "m.vrt",
             R"(<VRTDataset rasterXSize="4" rasterYSize="3"><SRS>EPSG:32619</SRS>
<GeoTransform>500000, 32, 0, 4000096, 0, -32</GeoTransform>
<VRTRasterBand dataType="Float32" band="1"><SimpleSource>
<SourceFilename relativeToVRT="1">a.bag</SourceFilename><SourceBand>1</SourceBand>
<SrcRect xOff="0" yOff="0" xSize="4" ySize="3"/><DstRect xOff="0" yOff="0" xSize="4" ySize="3"/>
</SimpleSource></VRTRasterBand></VRTDataset>)");
  CHECK_THROWS_WITH(read_survey(folder / "m.vrt", 0.0),
                    Catch::Contains("a.bag") && Catch::Contains("ensonify seafloor"));
}

TEST_CASE("A GeoTIFF that GDAL made of a BAG of variable resolution is an ordinary grid") {
  const TemporaryFolder folder;
  Resolution resolution;
  resolution.fill(2.0f);
  write_bag(folder / "a.bag", resolution, plane);
  const auto close = [](GDALDataset* open) { GDALClose(open); };
  const std::unique_ptr<GDALDataset, decltype(close)> bag(
      GDALDataset::Open((folder / "a.bag").c_str()), close);
  REQUIRE(bag);
  REQUIRE(std::string(bag->GetMetadataItem("HAS_SUPERGRIDS")) == "TRUE");
  const std::unique_ptr<GDALDataset, decltype(close)> copy(
      GetGDALDriverManager()->GetDriverByName("GTiff")->CreateCopy(
          (folder / "a.tif").c_str(), bag.get(), FALSE, nullptr, nullptr, nullptr),
      close);
  REQUIRE(copy);
  copy->FlushCache();
  const Heightfield field = read_survey(folder / "a.tif", 0.0);
  CHECK(field.columns == coarse_columns);
  CHECK(field.at(0, 0) == -10.0);
}

TEST_CASE("A BAG with a part in another file is refused, whatever that file is") {
  const TemporaryFolder folder, outside;
  write_text(outside / "secret", std::string(4096, 'x'));
  const std::string secret = outside / "secret";
  const auto refusal = [&](const char* name, const std::function<void(const fs::path&)>& change) {
    const fs::path file = folder / name;
    write_bag(file, mixed, plane);
    change(file);
    CHECK_THROWS_WITH(read_survey(file, 0.0),
                      Catch::StartsWith(file.string() + ": has the content of 'BAG_root/") &&
                          Catch::Contains("in another file; put it into this one"));
  };
  refusal("bytes.bag", [&](const fs::path& file) {
    replace_table(file, "/BAG_root/elevation", [&](hid_t made_with) {
      H5Pset_external(made_with, secret.c_str(), 0, coarse_rows * coarse_columns * sizeof(float));
    });
  });
  refusal("virtual.bag", [&](const fs::path& file) {
    replace_table(file, "/BAG_root/uncertainty", [&](hid_t made_with) {
      const std::array<hsize_t, 2> size{coarse_rows, coarse_columns};
      const hid_t space = H5Screate_simple(2, size.data(), nullptr);
      H5Pset_virtual(made_with, space, secret.c_str(), "/table", space);
      H5Sclose(space);
    });
  });
  refusal("link.bag", [&](const fs::path& file) {
    const hid_t open = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Ldelete(open, "/BAG_root/elevation", H5P_DEFAULT);
    REQUIRE(H5Lcreate_external(secret.c_str(), "/table", open, "/BAG_root/elevation", H5P_DEFAULT,
                               H5P_DEFAULT) >= 0);
    H5Fclose(open);
  });
}
