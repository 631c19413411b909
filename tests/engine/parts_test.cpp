// What a run in parts is made of: their number, their rows, and the files of the whole run.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/run/joined_files.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/refine/atomic_file.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

Scene scene_for_parts() {
  Scene scene;
  scene.seafloor.extent_east_m = 60.0;
  scene.seafloor.extent_north_m = 20.0;
  scene.seafloor.cell_m = 0.5;
  scene.track.pings = 25;
  scene.track.altitude_m = 6.0;
  scene.run.block_pings = 4;
  scene.sonars.front().range_m = 25.0;
  scene.sonars.front().bins = 100;
  scene.sonars.front().elevations = 128;
  scene.artefacts.lost = 0.1;
  scene.artefacts.repeated = 0.2;
  return scene;
}

std::vector<std::byte> picture_of(std::size_t first_ping, std::size_t rows, int bits) {
  // The value of a row is its ping, modulo the range; the newest ping is on top.
  Picture picture{2, rows, 1, {}, bits};
  for (std::size_t row = 0; row < rows; ++row)
    for (int column = 0; column < 2; ++column) {
      const std::size_t ping = first_ping + rows - 1 - row;
      if (bits == 16) picture.pixels.push_back(static_cast<std::uint8_t>(ping >> 8));
      picture.pixels.push_back(static_cast<std::uint8_t>(ping));
    }
  return encode_png(picture);
}

}  // namespace

TEST_CASE("short runs have one part, long ones parts of whole blocks that take 64 MiB") {
  std::vector<Sonar> sonars(1);
  sonars.front().bins = 1000;
  const double bytes = image_bytes(sonars, 1);
  const auto most = static_cast<std::size_t>(1024.0 * 1024 * 1024 / bytes);
  CHECK(pings_per_part({}, sonars, most) == most);
  const std::size_t part = pings_per_part({}, sonars, most + 1);
  CHECK(part % 64 == 0);
  CHECK(bytes * static_cast<double>(part) <= 64.0 * 1024 * 1024);
  CHECK(bytes * static_cast<double>(part + 64) > 64.0 * 1024 * 1024);
  CHECK(pings_per_part({.pings_per_file = 7}, sonars, 20) == 7);
  CHECK(pings_per_part({.pings_per_file = 30}, sonars, 20) == 20);

  const RunParts parts = equal_parts(20, 7);
  REQUIRE(parts.count() == 3);
  CHECK(parts.range(1).first == 7);
  CHECK(parts.range(1).count == 7);
  CHECK(parts.range(2).end() == 20);
  CHECK(parts.folder(0) == "part_0001");
  CHECK(equal_parts(123456, 1).folder(9) == "part_000010");
}

TEST_CASE("legs have a part each, and long legs have several") {
  const std::vector<std::size_t> starts{0, 10, 14};
  const RunParts legs = parts_of_legs(starts, 31, 31);
  CHECK(std::ranges::equal(legs.first_pings(), starts));
  CHECK(legs.range(2).count == 17);
  CHECK(legs.longest() == 17);
  const RunParts split = parts_of_legs(starts, 31, 7);
  CHECK(std::ranges::equal(split.first_pings(), std::vector<std::size_t>{0, 7, 10, 14, 21, 28}));
  CHECK(split.longest() == 7);
  for (std::size_t part = 0; part < split.count(); ++part) {
    const PingRange range = split.range(part);
    CHECK(split.part_of(range.first) == part);
    CHECK(split.part_of(range.end() - 1) == part);
  }
  CHECK_THROWS_AS(RunParts({0, 5, 5}, 9), std::invalid_argument);
  CHECK_THROWS_AS(RunParts({1, 5}, 9), std::invalid_argument);
  CHECK_THROWS_AS(RunParts({0, 9}, 9), std::invalid_argument);
  CHECK_THROWS_AS(RunParts({}, 9), std::invalid_argument);
}

TEST_CASE("the rows of parts are those of the whole track, bit by bit, and counts add up") {
  Scene scene = scene_for_parts();
  const auto beams = static_cast<std::size_t>(GENERATE(1, 3));
  scene.sonars.front().beams = static_cast<int>(beams);
  scene.texture = GENERATE(false, true);
  Simulator whole(scene), simulator(scene);
  const ScenePings all = ping_all(scene, whole, 1);
  const TrackPings track(scene, simulator);
  const RunParts parts = equal_parts(track.count(), 7);
  std::mutex mutex;
  std::size_t next = 0, rows = 0;
  std::uint64_t rays = 0, hits = 0;
  ping_parts(scene, simulator, track, 3,
             {.next_part = [&]() -> std::optional<PingRange> {
                if (next == parts.count()) return std::nullopt;
                return parts.range(next++);
              },
              .finished =
                  [&](const PingRange& range, ScenePings pings, const Simulator&) {
                    // Several threads call this, and Catch takes assertions from one at a time.
                    const std::lock_guard lock(mutex);
                    const Waterfall &a = all.images.front(), &b = pings.images.front();
                    const std::size_t first = beams * range.first;
                    REQUIRE(b.pings.front().number == first);
                    REQUIRE(b.rows() == beams * range.count);
                    CHECK(pings.pings.first == range.first);
                    CHECK(pings.pings.count == range.count);
                    const std::size_t columns = b.columns();
                    BinLayers::for_each([&](std::string_view name, auto layer) {
                      CAPTURE(name, range.first);
                      const auto from =
                          (a.pixels.*layer).begin() + static_cast<std::ptrdiff_t>(first * columns);
                      CHECK(std::equal((b.pixels.*layer).begin(), (b.pixels.*layer).end(), from));
                    });
                    for (std::size_t row = 0; row < b.rows(); ++row) {
                      const PingRow &one = a.pings[first + row], &other = b.pings[row];
                      CHECK(one.recorded == other.recorded);
                      CHECK(one.interval_s == other.interval_s);
                      CHECK(one.artefacts.bits == other.artefacts.bits);
                    }
                    rows += b.rows();
                    rays += pings.rays;
                    hits += pings.hits;
                  }});
  CHECK(rows == all.images.front().rows());
  CHECK(rays == all.rays);
  CHECK(hits == all.hits);
}

TEST_CASE("a picture of more rows than viewers open shows means of pings, the newest on top") {
  const TemporaryFolder folder;
  const RunParts parts = equal_parts(70001, 20000);
  REQUIRE(pings_per_row(parts.pings()) == 3);
  REQUIRE(pings_per_row(30000) == 1);
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const PingRange range = parts.range(part);
    std::filesystem::create_directory(folder / parts.folder(part));
    refine::write_file(folder / parts.folder(part) / ("towfish_" + parts.number(part) + ".png"),
                       picture_of(range.first, range.count, 16));
  }
  for (const std::size_t finished : {std::size_t{2}, parts.count()}) {
    const std::size_t pings = parts.range(finished - 1).end();
    join_pictures(folder.path(), parts, finished, "towfish");
    const std::string bytes = read_text(folder / "towfish.png");
    const Picture picture = decode_png(std::as_bytes(std::span(bytes)));
    REQUIRE(picture.width == 2);
    REQUIRE(picture.bits == 16);
    REQUIRE(picture.height == (pings + 2) / 3);
    for (std::size_t row = 0; row < picture.height; ++row) {
      // Groups of three pings are counted from the oldest, at the bottom.
      const std::size_t group = picture.height - 1 - row;
      std::size_t sum = 0, count = 0;
      for (std::size_t ping = 3 * group; ping < std::min(3 * group + 3, pings); ++ping, ++count)
        sum += ping & 0xffff;
      const std::size_t value = 256u * picture.pixels[4 * row] + picture.pixels[4 * row + 1];
      REQUIRE(value == (sum + count / 2) / count);
    }
  }
}

TEST_CASE("a picture of parts with several beams has a row for each of a ping's beams") {
  const TemporaryFolder folder;
  const RunParts parts = equal_parts(7, 3);
  constexpr std::size_t beams = 5;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const PingRange range = parts.range(part);
    std::filesystem::create_directory(folder / parts.folder(part));
    refine::write_file(folder / parts.folder(part) / ("towfish_" + parts.number(part) + ".png"),
                       picture_of(beams * range.first, beams * range.count, 8));
  }
  join_pictures(folder.path(), parts, parts.count(), "towfish");
  const std::string bytes = read_text(folder / "towfish.png");
  const Picture picture = decode_png(std::as_bytes(std::span(bytes)));
  REQUIRE(picture.height == 35);
  for (std::size_t row = 0; row < picture.height; ++row)
    CHECK(picture.pixels[2 * row] == picture.height - 1 - row);
}

TEST_CASE("a PNG that was encoded decodes to the same picture, and damage is refused") {
  for (const int channels : {1, 3})
    for (const int bits : {8, 16}) {
      Picture picture{5, 4, channels, {}, bits};
      for (int i = 0; i < 5 * 4 * channels * bits / 8; ++i)
        picture.pixels.push_back(static_cast<std::uint8_t>(37 * i));
      const std::vector<std::byte> bytes = encode_png(picture);
      const Picture back = decode_png(bytes);
      CHECK(back.width == 5);
      CHECK(back.height == 4);
      CHECK(back.channels == channels);
      CHECK(back.bits == bits);
      CHECK(back.pixels == picture.pixels);
      for (std::size_t size = 0; size < bytes.size() - 12; ++size)
        CHECK_THROWS_AS(decode_png(std::span(bytes).first(size)), std::runtime_error);
    }
}

TEST_CASE("parts whose pictures have another width or number of rows are not put together") {
  const TemporaryFolder folder;
  const RunParts parts({0, 4}, 8);
  const auto write = [&](std::size_t part, const Picture& picture) {
    const std::string number = parts.number(part);
    std::filesystem::create_directories(folder / parts.folder(part));
    refine::write_file(folder / (parts.folder(part) + "/a_" + number + ".png"),
                       encode_png(picture));
  };
  const auto grey = [](std::size_t width, std::size_t height) {
    return Picture{width, height, 1, std::vector<std::uint8_t>(width * height)};
  };
  write(1, grey(5, 4));
  for (const Picture& wrong : {grey(4, 4), grey(5, 3), Picture{5, 4, 3, grey(15, 4).pixels}}) {
    write(0, wrong);
    CHECK_THROWS_AS(join_pictures(folder.path(), parts, 2, "a"), SceneError);
  }
  write(1, grey(5, 3));  // less rows than pings
  CHECK_THROWS_AS(join_pictures(folder.path(), parts, 2, "a"), SceneError);
  write(0, grey(5, 4));
  write(1, grey(5, 4));
  CHECK_NOTHROW(join_pictures(folder.path(), parts, 2, "a"));
}

TEST_CASE(
    "outlines that leave their picture, or have an odd number of coordinates, are not put together") {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "part_0001");
  const auto joined = [&](const std::string& outline) {
    write_text(folder / "part_0001/a_0001_targets.json",
               R"({"picture": {"columns": 9, "rows": 2}, "targets": [{"instance": 1, "range_m": 5,)"
               R"( "side": "port", "ping": 1, "contrast_db": 3, "shadow": null, "body":)"
               R"( {"box": [1, 1, 2, 1], "area_px": 2, )" +
                   outline + "}}]}");
    return join_targets(folder.path(), RunParts({0}, 2), "a", {}, {{1, TargetSights{}}});
  };
  CHECK_NOTHROW(joined(R"("polygons": [[1, 1, 3, 1, 3, 2, 1, 2]])"));
  for (const std::string wrong :
       {R"("polygons": [[1, 1, 3, 1, 3, 2, 1]])", R"("polygons": [[1, 1, 1000000000000, 1]])",
        R"("polygons": [[1, 9, 3, 9, 3, 2, 1, 2]])",
        R"("polygons": [], "rle": {"size": [2, 9], "counts": [0, 100000000000000]})",
        R"("polygons": [], "rle": {"size": [0, 9], "counts": [0, 1]})"})
    CHECK_THROWS_AS(joined(wrong), SceneError);
}

TEST_CASE("the plan of a run in parts follows what its files are read with") {
  const TemporaryFolder folder;
  Scene scene;
  scene.seafloor.kind = SeafloorKind::survey;
  scene.seafloor.survey = {"bed.asc", folder / "bed.asc"};
  write_text(folder / "bed.asc",
             "ncols 3\nnrows 2\nxllcorner 1\nyllcorner 2\ncellsize 2\n-9 -9 -9\n-9 -9 -9\n");
  const auto plan = [&] { return make_plan(scene, "", 0, RunParts({0, 64}, 100)); };
  const RunPlan before = plan();
  // As of a file that nothing belongs to.
  CHECK(before.files.at("seafloor.survey") == xxh128(read_text(folder / "bed.asc")));
  CHECK(differences(before, plan()).empty());
  for (const char* const zone : {"32", "33"}) {
    const RunPlan earlier = plan();
    write_text(folder / "bed.prj", "Projection UTM\nZone " + std::string(zone) + "\n");
    const std::vector<std::string> changes = differences(earlier, plan());
    REQUIRE(changes.size() == 1);
    CHECK(
        changes[0] ==
        "the file of seafloor.survey has another content (or one of its sources, or a file beside it)");
  }
  std::filesystem::remove(folder / "bed.prj");
  CHECK(differences(before, plan()).empty());
}

TEST_CASE("plans are compared key by key, also of tables that one of them lacks") {
  Scene scene;
  scene.objects.resize(2, {.shape = "box", .class_name = "crate"});
  scene.materials.push_back({.name = "mud", .model = "solid"});
  const auto plan = [&] { return make_plan(scene, "", 0, RunParts({0, 64}, 100)); };
  const RunPlan before = plan();
  CHECK(differences(before, plan()).empty());
  scene.seed = 7;
  scene.objects[1].class_name = "chest";
  scene.sea.sound_speed_mps = 1480.0;
  CHECK(differences(before, plan()) ==
        std::vector<std::string>{"objects.1.class was \"crate\" and is \"chest\"",
                                 "sea.sound_speed_mps was not set and is 1480",
                                 "seed was 1 and is 7"});
  const RunPlan with_chest = plan();
  scene.objects.pop_back();
  scene.materials.clear();
  const std::vector<std::string> removed = differences(with_chest, plan());
  CHECK(std::ranges::count(removed, "objects.1.class was \"chest\" and is not set") == 1);
  CHECK(std::ranges::count(removed, "material.mud.model was \"solid\" and is not set") == 1);
  CHECK(std::ranges::none_of(removed, [](const std::string& one) {
    return one.starts_with("objects.0.") || one.starts_with("sonar.");
  }));
}
