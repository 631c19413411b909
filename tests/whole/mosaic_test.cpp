// Mosaics of whole runs, read with GDAL as other programs read them.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <nlohmann/json.hpp>
#include <ogr_spatialref.h>

#include <ensonify/engine/mosaic/mosaic.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/run.h>

#include "support/catch.h"
#include "support/dark_bed.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;
using Eigen::Vector2d;
using ensonify::engine::make_mosaic, ensonify::engine::MosaicOptions;
using ensonify::engine::Overlap, ensonify::engine::Positions;

namespace {

// A dark level bed, 20 m down; the sonar is 8 m above it.
const std::string level_bed_scene = ensonify::tests::dark_bed + R"([track]
pings = 150
speed_mps = 2
ping_interval_s = 0.1
altitude_m = 8
heading_deg = 20
[sonar.sidescan]
range_m = 30
bins = 300
elevations = 1500
focused = true
noise = false
)";

// Balls of 10 cm on both sides, near and far. None is close to an edge of a pixel of 20 or 50 cm,
// because each is bright in one pixel only.
const std::array<Vector2d, 4> balls_m{Vector2d(9.1, 3.1), Vector2d(20.3, -2.1),
                                      Vector2d(-11.1, -6.3), Vector2d(-22.3, 9.1)};

std::string with_balls() {
  std::string scene = level_bed_scene;
  for (const Vector2d& ball : balls_m)
    scene += fmt::format(
        "[[objects]]\nshape = \"sphere\"\ndiameter_m = 0.1\nmaterial = \"bright\"\n"
        "east_m = {}\nnorth_m = {}\n",
        ball.x(), ball.y());
  return scene;
}

/// Runs a scene into the folder `name`.
void run_into(const TemporaryFolder& folder, const std::string& scene, const std::string& name,
              const std::vector<std::string>& overrides = {}) {
  write_text(folder / (name + ".toml"), scene);
  std::vector<std::string> arguments{"run", name + ".toml", "-o", name, "--quiet"};
  for (const std::string& override : overrides) arguments.insert(arguments.end(), {"-D", override});
  const Outcome outcome = run_program(folder.path(), arguments);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

/// A mosaic as other programs see it.
struct MosaicPicture {
  explicit MosaicPicture(const fs::path& file) {
    GDALAllRegister();
    const std::unique_ptr<GDALDataset> grid(
        GDALDataset::FromHandle(GDALOpen(file.c_str(), GA_ReadOnly)));
    REQUIRE(grid);
    columns = grid->GetRasterXSize();
    rows = grid->GetRasterYSize();
    REQUIRE(grid->GetGeoTransform(transform.data()) == CE_None);
    overviews = grid->GetRasterBand(1)->GetOverviewCount();
    if (const char* text = grid->GetMetadataItem("class_names")) class_names = text;
    values.resize(static_cast<std::size_t>(columns * rows));
    REQUIRE(grid->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns,
                                             rows, GDT_Float64, 0, 0, nullptr) == CE_None);
    const double none = grid->GetRasterBand(1)->GetNoDataValue();
    for (double& value : values)
      if (value == none) value = NAN;
  }
  Vector2d place_m(int column, int row) const {
    return {transform[0] + (column + 0.5) * transform[1],
            transform[3] + (row + 0.5) * transform[5]};
  }
  double at(int column, int row) const {
    return values[static_cast<std::size_t>(row * columns + column)];
  }
  /// The value at a place; NaN outside.
  double at(const Vector2d& place) const {
    const double column = std::floor((place.x() - transform[0]) / transform[1]);
    const double row = std::floor((place.y() - transform[3]) / transform[5]);
    if (column < 0 || row < 0 || column >= columns || row >= rows) return NAN;
    return at(static_cast<int>(column), static_cast<int>(row));
  }
  /// Calls visit(place, value) for every pixel.
  void for_each(const std::function<void(const Vector2d&, double)>& visit) const {
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) visit(place_m(column, row), at(column, row));
  }
  /// The centre of what is bright within 1.5 m of a place. There must be something bright.
  Vector2d bright_centre_m(const Vector2d& near) const {
    Vector2d sum = Vector2d::Zero();
    double weight = 0.0, background = 0.0;
    std::vector<double> around;
    for (const bool brightest : {true, false})
      for_each([&](const Vector2d& place, double value) {
        if ((place - near).norm() > 1.5 || std::isnan(value)) return;
        if (brightest) {
          background = std::max(background, 0.2 * value);
          around.push_back(value);
        } else if (value > background) {
          sum += value * place;
          weight += value;
        }
      });
    REQUIRE(!around.empty());
    std::ranges::nth_element(around, around.begin() + std::ssize(around) / 2);
    REQUIRE(background > 10.0 * around[around.size() / 2]);
    return sum / weight;
  }

  int columns = 0, rows = 0, overviews = 0;
  std::string class_names;
  std::array<double, 6> transform{};
  std::vector<double> values;  // NaN without data
};

/// The mosaic of runs in a folder.
MosaicPicture mosaic_of(const TemporaryFolder& folder, const std::vector<std::string>& runs,
                        const MosaicOptions& options, const std::string& file = "mosaic.tif") {
  std::vector<fs::path> paths;
  for (const std::string& run : runs) paths.push_back(folder / run);
  make_mosaic(paths, folder / file, options);
  return MosaicPicture(folder / file);
}

/// Replaces the reported position in every row of a table of pings, by f(x, y).
void move_reports(const fs::path& table, const Vector2d& by_m) {
  std::istringstream rows(read_text(table));
  std::string moved, row;
  std::getline(rows, row);
  moved = row + "\n";
  while (std::getline(rows, row)) {
    std::vector<std::string> fields;
    std::istringstream one(row);
    for (std::string field; std::getline(one, field, ',');) fields.push_back(field);
    if (row.ends_with(',')) fields.emplace_back();
    fields[8] = fmt::format("{}", std::stod(fields[8]) + by_m.x());
    fields[9] = fmt::format("{}", std::stod(fields[9]) + by_m.y());
    moved += fmt::format("{}\n", fmt::join(fields, ","));
  }
  write_text(table, moved);
}

/// Copies rows [first, first + count) of an image, without one of its layers.
void copy_rows(const fs::path& from, int first, int count, const fs::path& to,
               const std::string& without = {}) {
  Imf::InputFile in(from.c_str());
  const int columns = in.header().dataWindow().max.x + 1;
  Imf::Header header = in.header();
  header.dataWindow().max.y = header.displayWindow().max.y = count - 1;
  Imf::ChannelList channels;
  for (auto layer = header.channels().begin(); layer != header.channels().end(); ++layer)
    if (layer.name() != without) channels.insert(layer.name(), layer.channel());
  header.channels() = channels;
  Imf::FrameBuffer reads, writes;
  std::vector<std::vector<std::uint32_t>> layers;
  layers.reserve(100);  // the buffers must not move
  for (auto layer = header.channels().begin(); layer != header.channels().end(); ++layer) {
    std::vector<std::uint32_t>& values = layers.emplace_back(columns * count);
    const auto stride = sizeof(std::uint32_t) * static_cast<std::size_t>(columns);
    const Imf::PixelType type = layer.channel().type;
    reads.insert(layer.name(), Imf::Slice::Make(type, values.data(), {0, first}, columns, count,
                                                sizeof(std::uint32_t), stride));
    writes.insert(layer.name(), Imf::Slice(type, reinterpret_cast<char*>(values.data()),
                                           sizeof(std::uint32_t), stride));
  }
  in.setFrameBuffer(reads);
  in.readPixels(first, first + count - 1);
  Imf::OutputFile out(to.c_str(), header);
  out.setFrameBuffer(writes);
  out.writePixels(count);
}

/// Makes a manifest list exactly these files.
void list_files(const fs::path& folder, const std::vector<std::string>& files) {
  auto manifest = nlohmann::ordered_json::parse(read_text(folder / "manifest.json"));
  manifest["files"] = nlohmann::ordered_json::array();
  for (const std::string& file : files)
    manifest["files"].push_back({{"name", file},
                                 {"size_bytes", fs::file_size(folder / file)},
                                 {"xxh128", ensonify::engine::xxh128_of_file(folder / file)}});
  write_text(folder / "manifest.json", manifest.dump());
}

}  // namespace

TEST_CASE("An object of a run is where it is, within half a pixel, in a mosaic of true positions") {
  const TemporaryFolder folder;
  // The vehicle rolls, pitches and turns, and reports a wrong position: the truth does not care.
  run_into(folder,
           with_balls() +
               "[motion]\nroll = { rms_deg = 2 }\npitch = { rms_deg = 1 }\n"
               "heading = { rms_deg = 1 }\nheave = { rms_m = 0.1 }\n"
               "[navigation]\nposition_bias_m = 3\n",
           "run");
  for (const double pixel_m : {0.2, 0.5}) {
    const MosaicPicture picture =
        mosaic_of(folder, {"run"}, {.pixel_m = pixel_m, .layer = "intensity_mean"});
    for (const Vector2d& ball : balls_m) {
      CAPTURE(pixel_m, ball.x(), ball.y());
      const Vector2d error = picture.bright_centre_m(ball) - ball;
      CAPTURE(error.x(), error.y());
      CHECK(error.cwiseAbs().maxCoeff() < 0.5 * pixel_m);
    }
  }
  const MosaicPicture regions = mosaic_of(folder, {"run"}, {.pixel_m = 0.05, .layer = "region"});
  for (const Vector2d& ball : balls_m) {
    bool object = false;
    regions.for_each([&](const Vector2d& place, double value) {
      object = object || (value == 3.0 && (place - ball).norm() < 0.2);
    });
    CHECK(object);
  }
  CHECK(std::ranges::all_of(regions.values, [](double value) {
    return std::isnan(value) || value == 2.0 || value == 3.0 || value == 4.0;
  }));
  // So is its label, at the side that the sonar sees.
  const MosaicPicture labels = mosaic_of(folder, {"run"}, {.pixel_m = 0.05, .layer = "instance"});
  std::array<double, 4> nearest_m{9.0, 9.0, 9.0, 9.0}, farthest_m{};
  labels.for_each([&](const Vector2d& place, double value) {
    if (!(value >= 1.0)) return;
    const auto ball = static_cast<std::size_t>(value) - 1;
    const double distance_m = (place - balls_m[ball]).norm();
    nearest_m[ball] = std::min(nearest_m[ball], distance_m);
    farthest_m[ball] = std::max(farthest_m[ball], distance_m);
  });
  for (std::size_t ball = 0; ball < balls_m.size(); ++ball) {
    CAPTURE(ball);
    CHECK(nearest_m[ball] < 0.1);
    CHECK(farthest_m[ball] < 0.5);
  }
}

TEST_CASE("Classes of several runs have one number by name in a mosaic, which has the names") {
  const TemporaryFolder folder;
  const auto with_object = [](const std::string& name, const Vector2d& place) {
    return level_bed_scene +
           fmt::format(
               "[[objects]]\nshape = \"box\"\nlength_m = 2\nmaterial = \"bright\"\nclass = "
               "\"{}\"\neast_m = {}\nnorth_m = {}\n",
               name, place.x(), place.y());
  };
  const Vector2d &to_starboard = balls_m[0], &to_port = balls_m[2];
  run_into(folder, with_object("a", to_starboard), "one", {"sonar.sidescan.sides=starboard"});
  run_into(folder, with_object("b", to_port), "two", {"sonar.sidescan.sides=port"});
  const MosaicPicture picture =
      mosaic_of(folder, {"one", "two"}, {.pixel_m = 0.1, .layer = "class"});
  CHECK(picture.class_names == R"(["none","seabed","a","b"])");
  std::array<int, 4> near_a{}, near_b{};  // pixels by number
  picture.for_each([&](const Vector2d& place, double value) {
    if (std::isnan(value)) return;
    if ((place - to_starboard).norm() < 3.0) ++near_a.at(static_cast<std::size_t>(value));
    if ((place - to_port).norm() < 3.0) ++near_b.at(static_cast<std::size_t>(value));
  });
  CHECK(near_a[2] > 10);
  CHECK(near_a[3] == 0);
  CHECK(near_b[2] == 0);
  CHECK(near_b[3] > 10);
}

TEST_CASE("With perfect navigation over a level bed, both sources of positions agree") {
  const TemporaryFolder folder;
  run_into(folder, with_balls(), "run");
  MosaicOptions options{.pixel_m = 0.25, .layer = "intensity_mean"};
  const MosaicPicture truth = mosaic_of(folder, {"run"}, options);
  options.positions = Positions::navigation;
  const MosaicPicture navigation = mosaic_of(folder, {"run"}, options);
  for (const Vector2d& ball : balls_m) {
    CAPTURE(ball.x(), ball.y());
    CHECK((navigation.bright_centre_m(ball) - truth.bright_centre_m(ball)).cwiseAbs().maxCoeff() <
          0.25);
  }

  // A report 5 m too far east shifts the mosaic by exactly that.
  move_reports(folder / "run/sidescan_pings.csv", {5.0, 0.0});
  const MosaicPicture shifted = mosaic_of(folder, {"run"}, options);
  CHECK(shifted.transform[0] == navigation.transform[0] + 5.0);
  CHECK(shifted.transform[3] == navigation.transform[3]);
  REQUIRE(shifted.values.size() == navigation.values.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < shifted.values.size(); ++i)
    if (std::isnan(shifted.values[i]) != std::isnan(navigation.values[i]) ||
        std::abs(shifted.values[i] - navigation.values[i]) > 1e-6 * navigation.values[i])
      ++different;
  // Some centres lie on an edge within rounding.
  CHECK(different <= shifted.values.size() / 1000);

  // The truth does not read reports.
  CHECK(mosaic_of(folder, {"run"}, {.pixel_m = 0.25, .layer = "intensity_mean"}).transform ==
        truth.transform);
}

TEST_CASE("A mosaic has no gaps, and a uniform bed has the same brightness everywhere") {
  const TemporaryFolder folder;
  // Pings 0.4 m apart, pixels of 0.1 m, and every tenth ping is lost.
  run_into(folder, level_bed_scene, "run",
           {"track.speed_mps=4", "track.pings=60", "track.heading_deg=0", "artefacts.lost=0.1"});
  for (const Positions positions : {Positions::truth, Positions::navigation}) {
    const MosaicPicture picture =
        mosaic_of(folder, {"run"}, {.pixel_m = 0.1, .positions = positions});
    std::size_t holes = 0, uneven = 0, inside = 0, outside = 0;
    picture.for_each([&](const Vector2d& place, double value) {
      // 60 pings cover 24 m: the first and the last one half of their spacing more.
      if (std::abs(place.y()) > 12.1 && !std::isnan(value)) ++outside;
      if (std::abs(place.y()) > 11.9 || std::abs(place.x()) > 28.5) return;
      ++inside;
      if (std::isnan(value)) ++holes;
      // Straight below, bins and cells of the mean are coarse.
      if (std::abs(place.x()) > 2.5 && !(std::abs(value - 99.0) <= 4.0)) ++uneven;
    });
    CHECK(inside == 238 * 570);
    CHECK(outside == 0);
    CHECK(holes == 0);
    CHECK(uneven == 0);
  }
}

TEST_CASE("Lost pings and a slow navigation leave no gaps in the mosaic of several beams") {
  const TemporaryFolder folder;
  // Pings 0.5 m apart with five rows each. A report of the position serves four pings.
  run_into(folder, level_bed_scene, "run",
           {"sonar.sidescan.beams=5", "sonar.sidescan.beam_spacing_m=0.1",
            "track.ping_interval_s=0.25", "track.pings=48", "track.heading_deg=0",
            "artefacts.lost=0.1", "navigation.update_interval_s=1"});
  for (const Positions positions : {Positions::truth, Positions::navigation}) {
    const MosaicPicture picture =
        mosaic_of(folder, {"run"}, {.pixel_m = 0.1, .positions = positions, .layer = "region"});
    std::size_t inside = 0, holes = 0;
    picture.for_each([&](const Vector2d& place, double value) {
      if (std::abs(place.y()) >= 10.0 || std::abs(place.x()) >= 28.5) return;
      ++inside;
      if (std::isnan(value)) ++holes;
    });
    CAPTURE(static_cast<int>(positions));
    CHECK(inside == 200 * 570);
    CHECK(holes == 0);
  }
}

TEST_CASE("A vehicle that waits for most of its pings has a mosaic of the way that it goes") {
  const TemporaryFolder folder;
  write_text(folder / "waits.csv",
             "t_s,x_m,y_m,z_m,heading_deg\n0,0,-6,-12,0\n10,0,-6,-12,0\n16,0,6,-12,0\n"
             "26,0,6,-12,0\n");
  run_into(folder, level_bed_scene, "run",
           {"track.kind=file", "track.file=waits.csv", "navigation.update_interval_s=0.3"});
  for (const Positions positions : {Positions::truth, Positions::navigation}) {
    const MosaicPicture picture =
        mosaic_of(folder, {"run"}, {.pixel_m = 0.1, .positions = positions, .layer = "region"});
    std::size_t inside = 0, holes = 0, outside = 0;
    picture.for_each([&](const Vector2d& place, double value) {
      // Reports come up to 0.3 s, or 0.6 m, late.
      if (std::abs(place.y()) > 7.0 && !std::isnan(value)) ++outside;
      if (std::abs(place.y()) >= 5.0 || std::abs(place.x()) >= 28.5) return;
      ++inside;
      if (std::isnan(value)) ++holes;
    });
    CAPTURE(static_cast<int>(positions));
    CHECK(inside == 100 * 570);
    CHECK(holes == 0);
    CHECK(outside == 0);
  }
}

TEST_CASE("Every tile of a mosaic is in its file, also without data, so that all readers open it") {
  const TemporaryFolder folder;
  run_into(folder, level_bed_scene, "run", {"track.pings=300", "track.heading_deg=45"});
  const MosaicPicture picture = mosaic_of(folder, {"run"}, {.pixel_m = 0.05});
  CHECK(std::ranges::count_if(picture.values, [](double value) { return std::isnan(value); }) > 0);
  const std::unique_ptr<GDALDataset> grid(
      GDALDataset::FromHandle(GDALOpen((folder / "mosaic.tif").c_str(), GA_ReadOnly)));
  REQUIRE(grid);
  std::vector<GDALRasterBand*> bands{grid->GetRasterBand(1)};
  for (int i = 0; i < bands[0]->GetOverviewCount(); ++i) bands.push_back(bands[0]->GetOverview(i));
  CHECK(bands.size() > 1);
  std::size_t tiles = 0;
  for (GDALRasterBand* band : bands) {
    int columns = 0, rows = 0;
    band->GetBlockSize(&columns, &rows);
    for (int y = 0; y * rows < band->GetYSize(); ++y)
      for (int x = 0; x * columns < band->GetXSize(); ++x) {
        CAPTURE(band->GetXSize(), x, y);
        CHECK(band->GetMetadataItem(fmt::format("BLOCK_OFFSET_{}_{}", x, y).c_str(), "TIFF"));
        ++tiles;
      }
  }
  CHECK(tiles > 8);
}

TEST_CASE("The blocks of a mosaic do not change its bytes", "[slow]") {
  const TemporaryFolder folder;
  // With lost pings, so that some neighbours that are read apart lie far apart. Straight to the
  // north, so that pings share no ground with others, which could hide a missing one.
  run_into(folder, with_balls(), "run",
           {"track.pings=200", "track.heading_deg=0", "track.middle_north_m=0.2",
            "artefacts.lost=0.6", "sonar.sidescan.range_m=10", "sonar.sidescan.bins=20"});
  for (const Overlap overlap : {Overlap::newest, Overlap::mean, Overlap::nearest}) {
    MosaicOptions options{.pixel_m = 0.1, .overlap = overlap};
    const MosaicPicture whole = mosaic_of(folder, {"run"}, options, "whole.tif");
    CHECK(whole.overviews > 0);
    for (const std::int64_t block_px : {4, 256}) {
      options.block_px = block_px;
      mosaic_of(folder, {"run"}, options, "blocks.tif");
      CHECK((read_text(folder / "blocks.tif") == read_text(folder / "whole.tif")));
    }
  }
}

TEST_CASE("A run in parts has the same mosaic as in one part") {
  const TemporaryFolder folder;
  run_into(folder, with_balls(), "run", {"track.pings=80"});
  mosaic_of(folder, {"run"}, {}, "whole.tif");

  std::istringstream table(read_text(folder / "run/sidescan_pings.csv"));
  std::string header, row;
  std::getline(table, header);
  int first = 0;
  std::vector<std::string> files;
  for (const int count : {30, 1, 49}) {
    const std::string part = fmt::format("part_{:04}", files.size() + 1);
    fs::create_directory(folder / ("run/" + part));
    files.push_back(fmt::format("{}/sidescan_{:04}.exr", part, files.size() + 1));
    const fs::path image = folder / ("run/" + files.back());
    copy_rows(folder / "run/sidescan.exr", first, count, image);
    std::string rows = header + "\n";
    for (int i = 0; i < count; ++i) {
      REQUIRE(std::getline(table, row));
      rows += row + "\n";
    }
    write_text(image.parent_path() / (image.stem().string() + "_pings.csv"), rows);
    first += count;
  }
  list_files(folder / "run", files);
  mosaic_of(folder, {"run"}, {}, "parts.tif");
  CHECK((read_text(folder / "parts.tif") == read_text(folder / "whole.tif")));
}

TEST_CASE("Where two lines cross, the overlap decides which is shown") {
  const TemporaryFolder folder;
  // Pixels smaller than bins and the spacing of pings show one value each.
  const std::vector<std::string> line{"track.pings=200", "sonar.sidescan.bins=150"};
  std::vector<std::string> north = line, east = line;
  north.emplace_back("track.heading_deg=0");
  east.emplace_back("track.heading_deg=90");
  run_into(folder, level_bed_scene, "north", north);
  run_into(folder, level_bed_scene, "east", east);
  const auto picture = [&](const std::vector<std::string>& runs, Overlap overlap) {
    return mosaic_of(folder, runs, {.pixel_m = 0.1, .layer = "intensity_mean", .overlap = overlap});
  };
  const auto differences = [&](const MosaicPicture& both,
                               const std::function<double(const Vector2d&)>& expected) {
    std::size_t wrong = 0;
    both.for_each([&](const Vector2d& place, double value) {
      const double should = expected(place);
      if (std::isnan(value) != std::isnan(should) || std::abs(value - should) > 1e-5 * should)
        ++wrong;
    });
    return static_cast<double>(wrong) / static_cast<double>(both.values.size());
  };

  for (const bool reversed : {false, true}) {
    std::vector<std::string> runs{"north", "east"};
    if (reversed) std::ranges::reverse(runs);
    const MosaicPicture first = picture({runs[0]}, Overlap::newest),
                        second = picture({runs[1]}, Overlap::newest);
    CHECK(differences(picture(runs, Overlap::newest), [&](const Vector2d& place) {
            const double newest = second.at(place);
            return std::isnan(newest) ? first.at(place) : newest;
          }) == 0.0);
  }
  {
    const MosaicPicture a = picture({"north"}, Overlap::mean), b = picture({"east"}, Overlap::mean);
    // Straight below, where both sides of a line overlap, one line counts twice.
    CHECK(differences(picture({"north", "east"}, Overlap::mean), [&](const Vector2d& place) {
            if (std::isnan(a.at(place))) return b.at(place);
            if (std::isnan(b.at(place))) return a.at(place);
            return 0.5 * (a.at(place) + b.at(place));
          }) < 0.01);
  }
  {
    const MosaicPicture a = picture({"north"}, Overlap::nearest),
                        b = picture({"east"}, Overlap::nearest);
    // A pixel shows the line whose track, x = 0 or y = 0, is nearer. Close to the bisectors of the
    // tracks, the distance of a bin's centre decides.
    CHECK(differences(picture({"north", "east"}, Overlap::nearest), [&](const Vector2d& place) {
            if (std::isnan(a.at(place))) return b.at(place);
            if (std::isnan(b.at(place))) return a.at(place);
            return std::abs(place.x()) < std::abs(place.y()) ? a.at(place) : b.at(place);
          }) < 0.02);
  }
}

TEST_CASE("A mosaic has the coordinate reference system of its run, or none") {
  const TemporaryFolder folder;
  const std::vector<std::string> few{"track.pings=5"};
  run_into(folder, level_bed_scene, "local", few);
  const auto reference = [&](const std::string& run) {
    mosaic_of(folder, {run}, {.pixel_m = 0.5});
    const std::unique_ptr<GDALDataset> grid(
        GDALDataset::FromHandle(GDALOpen((folder / "mosaic.tif").c_str(), GA_ReadOnly)));
    const OGRSpatialReference* system = grid->GetSpatialRef();
    return system ? fmt::format("{} {}", system->GetProjParm(SRS_PP_LATITUDE_OF_ORIGIN),
                                system->GetProjParm(SRS_PP_CENTRAL_MERIDIAN))
                  : "none";
  };
  CHECK(reference("local") == "none");
  std::vector<std::string> placed = few;
  placed.insert(placed.end(), {"track.origin_lat_deg=55", "track.origin_lon_deg=10"});
  run_into(folder, level_bed_scene, "placed", placed);
  CHECK(reference("placed") == "55 10");
  const std::array<fs::path, 2> both{folder / "local", folder / "placed"};
  CHECK_THROWS_WITH(make_mosaic(both, folder / "both.tif", {}),
                    Catch::Contains("is not that of the first run"));
}

TEST_CASE("The bytes of a mosaic do not depend on the size of GDAL's cache") {
  const TemporaryFolder folder;
  run_into(folder, level_bed_scene, "run");
  const auto bytes_with = [&](const std::string& cache_mb) {
    const fs::path file = "mosaic_" + cache_mb + ".tif";
    const Outcome outcome =
        run_program(folder.path(), {"mosaic", "run", "--pixel-m", "0.01", "-o", file, "--quiet"},
                    {"GDAL_CACHEMAX=" + cache_mb});
    REQUIRE(outcome.code == 0);
    return read_text(folder.path() / file);
  };
  CHECK((bytes_with("1") == bytes_with("500")));
}

TEST_CASE("A mosaic that is stopped leaves nothing behind") {
  const TemporaryFolder folder;
  run_into(folder, level_bed_scene, "run");
  const std::array<fs::path, 1> runs{folder / "run"};
  fs::create_directory(folder / "out");
  for (const std::string stage : {"pings", "blocks", "overviews"}) {
    CAPTURE(stage);
    MosaicOptions options{.pixel_m = 0.1};
    options.progress = [&](std::string_view at, std::size_t, std::size_t) { return at != stage; };
    CHECK_THROWS_AS(make_mosaic(runs, folder / "out/mosaic.tif", options),
                    ensonify::engine::Stopped);
    CHECK(fs::is_empty(folder / "out"));
  }
}

TEST_CASE("A mosaic refuses what it cannot use, with one message and exit code 2") {
  const TemporaryFolder folder;
  run_into(folder, level_bed_scene, "good", {"track.pings=20"});
  fs::create_directory(folder / "out");
  const auto refused = [&](std::vector<std::string> arguments, const std::string& message) {
    CAPTURE(message);
    arguments.insert(arguments.begin(), "mosaic");
    arguments.insert(arguments.end(), {"-o", "out/mosaic.tif"});
    const Outcome outcome = run_program(folder.path(), arguments);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.starts_with("ensonify: "));
    CHECK(std::ranges::count(outcome.err, '\n') == 1);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(fs::is_empty(folder / "out"));
  };
  /// A copy of the good run with a change.
  const auto damaged = [&](const std::string& message,
                           const std::function<void(fs::path)>& change) {
    fs::remove_all(folder / "bad");
    fs::copy(folder / "good", folder / "bad");
    change(folder / "bad");
    refused({"bad"}, message);
  };

  refused({"none"}, "there is no manifest.json; give the folder of a finished `ensonify run`");
  refused({"good", "--sonar", "echosounder"}, "no sonar 'echosounder', expected one of: sidescan");
  refused({"good", "--layer", "grazing_rad"},
          "--layer: 'grazing_rad', expected one of brightness, sample, ");
  // Not the numbers of the words, either.
  for (const std::string word : {"1", "value", ""}) {
    refused({"good", "--positions", word},
            "--positions: '" + word + "', expected truth or navigation (see ensonify mosaic");
    refused({"good", "--overlap", word}, "'" + word + "', expected one of newest, mean, nearest");
  }
  CHECK(run_program(folder.path(), {"mosaic", "--help"}).out.find('{') == std::string::npos);
  refused({"good", "--layer", "class", "--overlap", "mean"}, "have no mean");
  refused({"good", "--pixel-m", "1e-8"}, "too many pixels");
  refused({"good", "--pixel-m", "-1"}, "--pixel-m");
  CHECK(run_program(folder.path(), {"mosaic", "good", "-o", "mosaic.png"}).code == 2);

  run_into(folder, level_bed_scene + "[sonar.ahead]\nbins = 100\n", "two", {"track.pings=2"});
  refused({"two"}, "the run has the sonars ahead, sidescan; choose one by its name with --sonar");
  run_into(folder, level_bed_scene, "npz",
           {"track.pings=2", "output.exr=false", "output.npz=true"});
  refused({"npz"}, "the run has no OpenEXR images; run its scene again with output.exr = true");
  run_into(folder, level_bed_scene, "one", {"track.pings=1"});
  refused({"one"}, "its pings do not move, so they cover no ground");

  damaged("sidescan.exr: the file is missing",
          [](const fs::path& run) { fs::remove(run / "sidescan.exr"); });
  damaged("copy the file again, or make the run again", [](const fs::path& run) {
    fs::resize_file(run / "sidescan.exr", fs::file_size(run / "sidescan.exr") / 2);
  });
  // Also if the manifest has the same size.
  damaged("OpenEXR cannot read rows 0 to 19", [](const fs::path& run) {
    fs::resize_file(run / "sidescan.exr", fs::file_size(run / "sidescan.exr") / 2);
    list_files(run, {"sidescan.exr"});
  });
  damaged("its content has changed since it was written", [](const fs::path& run) {
    std::string bytes = read_text(run / "sidescan.exr");
    std::fill(bytes.end() - 4000, bytes.end() - 3000, '\x55');
    write_text(run / "sidescan.exr", bytes);
  });
  damaged("this is not an OpenEXR file", [](const fs::path& run) {
    write_text(run / "sidescan.exr", "P5 1 1 255 0");
    list_files(run, {"sidescan.exr"});
  });
  damaged(
      "the layer 'sample' is missing; make the run again, without output.layers or with all of "
      "x_m, y_m, sample, region in it",
      [&](const fs::path& run) {
        copy_rows(folder / "good/sidescan.exr", 0, 20, run / "sidescan.exr", "sample");
        list_files(run, {"sidescan.exr"});
      });
  damaged("there are 20 pings, but the image has 19 rows", [&](const fs::path& run) {
    copy_rows(folder / "good/sidescan.exr", 0, 19, run / "sidescan.exr");
    list_files(run, {"sidescan.exr"});
  });
  damaged("no column altitude_m", [](const fs::path& run) {
    std::string table = read_text(run / "sidescan_pings.csv");
    table.replace(table.find("altitude_m"), 10, "altitude_k");
    write_text(run / "sidescan_pings.csv", table);
  });
  damaged("sidescan_pings.csv: there is no such file",
          [](const fs::path& run) { fs::remove(run / "sidescan_pings.csv"); });
  damaged("this is not the manifest of a run",
          [](const fs::path& run) { write_text(run / "manifest.json", "{\"files\": 3"); });
  damaged("the file '../good/sidescan.exr' is not in the run's folder",
          [](const fs::path& run) { list_files(run, {"../good/sidescan.exr"}); });
  damaged("do not fit the scene", [](const fs::path& run) {
    std::string manifest = read_text(run / "manifest.json");
    manifest.replace(manifest.find("sides = \\\"both\\\""), 16, "sides = \\\"port\\\"");
    write_text(run / "manifest.json", manifest);
  });
}
