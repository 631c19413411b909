#include <ensonify/refine/height_tiles.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/heights.h"
#include "support/little_memory.h"
#include "support/temporary_folder.h"

#include <ensonify/refine/grid_footprint.h>

using namespace ensonify::refine;
using ensonify::tests::change_byte;
using ensonify::tests::Heights;
using ensonify::tests::random_heights;
using ensonify::tests::read_text;
using ensonify::tests::TemporaryFolder;

namespace {

namespace fs = std::filesystem;

/// Counts the windows that were asked for.
struct Source {
  const Heights& heights;
  std::shared_ptr<std::atomic<int>> windows = std::make_shared<std::atomic<int>>(0);

  void operator()(int first_column, int first_row, int columns, int rows, std::span<double> z_m,
                  std::span<std::uint8_t> = {}) const {
    ++*windows;
    for (int row = 0; row < rows; ++row)
      std::copy_n(
          heights.z_m.begin() + std::ptrdiff_t{first_row + row} * heights.columns + first_column,
          columns, z_m.begin() + std::ptrdiff_t{row} * columns);
  }
};

std::shared_ptr<HeightTiles> tiles_of(const Source& source, const fs::path& file,
                                      const std::string& key = "key") {
  return std::make_shared<HeightTiles>(
      source.heights.x_m(), source.heights.y_m(), Eigen::Vector3d::Zero(),
      [](HeightTiles::Shape& shape) { shape.mean_height_m = -1.0; }, source, file, key);
}

/// Fans to both sides, a few metres over the bed.
std::vector<FanVolume> volumes_at(double x_m, double y_m) {
  std::vector<FanVolume> volumes;
  for (const double side : {-1.0, 1.0})
    volumes.push_back(
        {.apex = {x_m, y_m, 6.0},
         .array_axis = Eigen::Vector3d::UnitY() * side,
         .middle = Eigen::Vector3d(side, 0.0, -0.5).normalized(),
         .pole =
             Eigen::Vector3d(side, 0.0, -0.5).normalized().cross(Eigen::Vector3d::UnitY() * side),
         .truncation_rad = 0.02,
         .elevation_low_rad = -0.6,
         .elevation_high_rad = 0.4,
         .range_m = 60.0});
  return volumes;
}

void require_same_faces(GridFootprint& expected, GridFootprint& found,
                        std::span<const FanVolume> volumes) {
  const ExactFaces a = expected.query(volumes);
  const ExactFaces b = found.query(volumes);
  REQUIRE(std::ranges::equal(a.faces, b.faces));
  REQUIRE(std::ranges::equal(a.points, b.points));
  REQUIRE(std::ranges::equal(a.source_faces, b.source_faces));
}

}  // namespace

TEST_CASE("Tiles in a file have the same faces as the grid in memory, over all borders") {
  const TemporaryFolder folder;
  const Heights heights = random_heights(1110, 1090, 0.5, 2.0, 0.0, 3);
  const HeightGrid grid = heights.grid();
  const HeightGrid tiled(tiles_of({heights}, folder.path() / "a.tiles"));
  CHECK(tiled.faces() == grid.faces());
  const TriangleMesh expected = grid.mesh(), found = tiled.mesh();
  CHECK(found.faces == expected.faces);
  CHECK(found.positions == expected.positions);
}

TEST_CASE("Tiles in a file have the same faces with holes, and gaps in their numbers") {
  const Heights heights = random_heights(150, 140, 0.5, 2.0, 0.1, 4);
  const HeightGrid grid = heights.grid();
  const HeightGrid tiled(tiles_of({heights}, {}));  // in memory
  std::vector<std::uint32_t> numbers, with_gaps;
  const TriangleMesh expected = grid.mesh(20, 140, 30, 135, &numbers);
  const TriangleMesh found = tiled.mesh(20, 140, 30, 135, &with_gaps);
  CHECK(found.faces == expected.faces);
  CHECK(found.positions == expected.positions);
  CHECK(std::ranges::is_sorted(with_gaps));
  CHECK(std::ranges::adjacent_find(with_gaps) == with_gaps.end());
  CHECK(with_gaps.back() < tiled.faces());
}

TEST_CASE("A query makes only the tiles that it can touch, and finds what it finds in memory") {
  const TemporaryFolder folder;
  const Heights heights = random_heights(2300, 1500, 0.5, 2.0, 0.0, 5);
  const HeightGrid grid = heights.grid();
  const Source source{heights};
  const auto tiles = tiles_of(source, folder.path() / "a.tiles");
  const HeightGrid tiled(tiles);
  const BallTree none;
  GridFootprint expected(grid, none), found(tiled, none);
  // In the middle of a chunk, at a border, at a corner; then somewhere that was made before.
  const double border_m = (HeightTiles::chunk_cells - 0.5 * 2299) * 0.5;
  const double corner_m = (HeightTiles::chunk_cells - 0.5 * 1499) * 0.5;
  require_same_faces(expected, found, volumes_at(-320.0, -200.0));
  CHECK(*source.windows == 1);
  CHECK(tiles->tiles_made() == 256);
  require_same_faces(expected, found, volumes_at(border_m + 1.0, -200.0));
  CHECK(*source.windows == 2);
  require_same_faces(expected, found, volumes_at(border_m - 0.3, corner_m + 0.2));
  CHECK(*source.windows == 4);
  for (double y_m = -300.0; y_m < 300.0; y_m += 37.0)
    require_same_faces(expected, found, volumes_at(0.3 * y_m, y_m));
  CHECK(*source.windows == 4);  // of six chunks
  // A new process, with what is in the file.
  const HeightGrid again(tiles_of(source, folder.path() / "a.tiles"));
  GridFootprint of_file(again, none);
  for (double y_m = -300.0; y_m < 300.0; y_m += 37.0)
    require_same_faces(expected, of_file, volumes_at(0.3 * y_m, y_m));
  CHECK(*source.windows == 4);
}

TEST_CASE("A damaged tile is made again") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.tiles";
  const Heights heights = random_heights(200, 200, 0.5, 2.0, 0.0, 6);
  const Source source{heights};
  std::uint64_t bytes = 0;
  {
    const auto tiles = tiles_of(source, file);
    tiles->require_chunk(0);
    bytes = tiles->file_bytes();
  }
  const std::string whole = read_text(file);
  REQUIRE(whole.size() == bytes);
  const TriangleMesh expected = heights.grid().mesh();
  // In a tile, in the table, and in the last tile.
  const std::uint64_t first_tile = bytes - 16 * sizeof(HeightGrid::Tile);
  for (const std::uint64_t place : {first_tile + 3000, first_tile - 4096 + 40, bytes - 130}) {
    CAPTURE(place);
    change_byte(file, place);
    REQUIRE(read_text(file) != whole);
    const HeightGrid tiled(tiles_of(source, file));
    CHECK(tiled.mesh().positions == expected.positions);
    CHECK(read_text(file) == whole);
  }
  // Cut off.
  fs::resize_file(file, first_tile + 5000);
  CHECK(HeightGrid(tiles_of(source, file)).mesh().positions == expected.positions);
  CHECK(read_text(file) == whole);
}

TEST_CASE(
    "Kinds of points give those of the faces, with holes too, and are mended with their tile") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.tiles";
  const Heights heights = random_heights(150, 140, 0.5, 2.0, 0.1, 12);
  const auto kind_at = [](int column, int row) {
    return static_cast<std::uint8_t>((column / 3 * 7 + row / 2 * 5) % 11);
  };
  const auto with_kinds = [&](int first_column, int first_row, int columns, int rows,
                              std::span<double> z_m, std::span<std::uint8_t> kinds) {
    Source{heights}(first_column, first_row, columns, rows, z_m);
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column)
        kinds[static_cast<std::size_t>(row * columns + column)] =
            kind_at(first_column + column, first_row + row);
  };
  const auto open = [&](bool kinds) {
    return std::make_shared<HeightTiles>(
        heights.x_m(), heights.y_m(), Eigen::Vector3d::Zero(), [](HeightTiles::Shape&) {},
        with_kinds, file, "key", kinds);
  };
  const auto check = [&] {
    const HeightGrid grid(open(true));
    int differ = 0, faces = 0;
    for (int row = 0; row + 1 < grid.rows(); ++row)
      for (int column = 0; column + 1 < grid.columns(); ++column) {
        const HeightGrid::Cell cell = grid.cell(column, row);
        const std::array corners{kind_at(column, row), kind_at(column + 1, row),
                                 kind_at(column, row + 1), kind_at(column + 1, row + 1)};
        for (std::uint32_t second = 0; cell.whole && second < 2; ++second) {
          const Face& face = cell.faces[second];
          const auto a = corners[face[0]], b = corners[face[1]], c = corners[face[2]];
          differ += grid.kind_of(cell.first_face + second) != (b == c ? b : a);
          ++faces;
        }
      }
    CHECK(faces > 20000);
    CHECK(differ == 0);
  };
  check();
  const std::string whole = read_text(file);
  CHECK(whole.size() == open(true)->file_bytes());
  for (const std::uint64_t before_end : {1u, 5000u, 30000u}) {
    CAPTURE(before_end);
    change_byte(file, whole.size() - before_end);
    check();
    CHECK(read_text(file) == whole);
  }
  CHECK_THROWS_AS(open(false), MeshError);
}

TEST_CASE("A file of tiles of another bed, or with a damaged header, is refused") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.tiles";
  const Heights heights = random_heights(70, 70, 0.5, 2.0, 0.0, 7);
  tiles_of({heights}, file)->require(0);
  CHECK_THROWS_AS(tiles_of({heights}, file, "other"), MeshError);
  const Heights other = random_heights(70, 71, 0.5, 2.0, 0.0, 7);
  CHECK_THROWS_AS(tiles_of({other}, file), MeshError);
  CHECK(HeightTiles(file).tiles_made() == 4);
  CHECK(HeightTiles(file).key() == "key");
  for (const std::uint64_t place : {3u, 9u, 20u, 30u, 60u, 4100u}) {
    CAPTURE(place);
    change_byte(file, place);
    CHECK_THROWS_AS(tiles_of({heights}, file), MeshError);
    CHECK_THROWS_AS(HeightTiles(file), MeshError);
    change_byte(file, place);
  }
  CHECK(HeightTiles::is_one(file));
  CHECK_FALSE(HeightTiles::is_one(folder.path() / "none"));
}

TEST_CASE("Two users of one file of tiles, with two threads each, get the same tiles") {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.tiles";
  const Heights heights = random_heights(2100, 1100, 0.5, 2.0, 0.05, 8);
  const Source source{heights};
  const std::array users{tiles_of(source, file), tiles_of(source, file)};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      HeightTiles& tiles = *users[static_cast<std::size_t>(i % 2)];
      for (std::size_t chunk = 0; chunk < tiles.chunks(); ++chunk)
        tiles.require_chunk((chunk + static_cast<std::size_t>(i) * 2) % tiles.chunks());
    });
  for (std::thread& thread : threads) thread.join();
  const fs::path alone = folder.path() / "b.tiles";
  const auto one = tiles_of(source, alone);
  for (std::size_t chunk = 0; chunk < one->chunks(); ++chunk) one->require_chunk(chunk);
  CHECK(read_text(file) == read_text(alone));
}

#ifdef ENSONIFY_CAN_LIMIT_MEMORY
TEST_CASE("tiles that do not fit into a limited address space say so") {
  const std::vector<float> places(30000, 0.0f);
  const ensonify::tests::LittleMemory little(std::size_t{1} << 30);
  CHECK_THROWS_WITH(
      HeightTiles(
          places, places, Eigen::Vector3d::Zero(), [](HeightTiles::Shape&) {}, {}, {}, ""),
      Catch::Contains("GB do not fit into the address space") && Catch::Contains("ulimit -v"));
}
#endif

TEST_CASE("A grid of tiles with more faces than 32 bits can number is refused before it is made") {
  const std::vector<float> places(47000, 0.0f);
  CHECK_THROWS_WITH(HeightTiles(places, places, Eigen::Vector3d::Zero(), {}, {}, {}, ""),
                    Catch::Contains("more faces than 32 bits"));
}
