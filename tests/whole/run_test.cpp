#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/format.h>

#include "support/beds.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/message.h"
#include "support/paths.h"
#include "support/program.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/sonar/vehicle/ground_path.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A small scene that runs quickly.
Scene small_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 40.0;
  scene.seafloor.cell_m = 0.5;
  scene.track.pings = 50;
  scene.track.altitude_m = 8.0;
  scene.run.block_pings = 8;
  scene.output.npz = true;
  scene.sonars.front().range_m = 40.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 300;
  return scene;
}

std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path(), std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    files[entry.path().filename()] = bytes.str();
  }
  return files;
}

}  // namespace

TEST_CASE("a run writes the same bytes on one, two and four threads and when repeated") {
  const TemporaryFolder folder;
  run(small_scene(), folder / "one", {.threads = 1});
  const auto expected = contents(folder / "one");
  CHECK(expected.size() == 5);
  for (const int threads : {1, 2, 4}) {
    const std::string name = "again" + std::to_string(threads);
    run(small_scene(), folder / name, {.threads = threads});
    const auto found = contents(folder / name);
    REQUIRE(found.size() == expected.size());
    for (const auto& [file, bytes] : expected) {
      CAPTURE(threads, file);
      CHECK(found.at(file) == bytes);
    }
  }
}

TEST_CASE(
    "a run writes the same bytes if threads without a block refine ahead for the other threads") {
  const TemporaryFolder folder;
  for (const auto& [surface, intersector] :
       {std::pair{"refined", "embree"}, std::pair{"footprint", "fan_scan"}})
    for (const int tree_pings : {1, 6}) {
      Scene scene = small_scene();
      scene.output.exr = false;
      scene.artefacts = {.lost = 0.1, .repeated = 0.1};
      scene.run.block_pings = 30;  // two blocks
      scene.run.surface = surface;
      scene.run.intersector = intersector;
      scene.run.tree_pings = tree_pings;
      const std::string name = fmt::format("{}{}", surface, tree_pings);
      run(scene, folder / name, {.threads = 1});
      const auto expected = contents(folder / name);
      for (const int threads : {3, 5}) {
        CAPTURE(name, threads);
        const std::string again = fmt::format("{}on{}", name, threads);
        run(scene, folder / again, {.threads = threads});
        CHECK(contents(folder / again) == expected);
      }
    }
}

TEST_CASE("an unknown surface or intersector is refused by the library, too") {
  Scene scene = small_scene();
  scene.run.surface = "refind";
  CHECK_THROWS_WITH(Simulator(scene), Catch::Contains("expected one of auto, static"));
  scene = small_scene();
  scene.run.intersector = "embre";
  CHECK_THROWS_WITH(Simulator(scene), Catch::Contains("expected one of embree"));
}

TEST_CASE("another seed gives another image") {
  const TemporaryFolder folder;
  Scene scene = small_scene();
  run(scene, folder / "a", {});
  scene.seed = 2;
  run(scene, folder / "b", {});
  CHECK(contents(folder / "a")["sidescan.exr"] != contents(folder / "b")["sidescan.exr"]);
}

TEST_CASE("a single ping equals the same ping within a run, whatever was pinged before") {
  const Scene scene = small_scene();
  Simulator straight(scene), jumping(scene);
  const std::vector<Pose> poses = straight.track();
  std::vector<std::vector<float>> expected;
  for (std::size_t i = 0; i < poses.size(); ++i)
    expected.push_back(straight.ping_numbered(poses[i], i)[1].bins.intensity);
  for (const std::size_t i : {17u, 3u, 49u, 16u})
    CHECK(jumping.ping_numbered(poses[i], i)[1].bins.intensity == expected[i]);
}

TEST_CASE("the picture exists during the run and is complete at its end") {
  const TemporaryFolder folder;
  const std::filesystem::path picture = folder / "out" / "sidescan.png";
  std::uintmax_t early_bytes = 0;
  run(small_scene(), folder / "out",
      {.threads = 1, .progress = [&](std::string_view stage, std::size_t done, std::size_t) {
         // The first picture is due a second after the run's begin.
         if (stage == "pings" && done == 8) std::this_thread::sleep_for(std::chrono::seconds(1));
         if (stage == "pings" && done == 16) early_bytes = file_size(picture);
         return true;
       }});
  CHECK(early_bytes > 0);
  CHECK(file_size(picture) > 2 * early_bytes);
}

TEST_CASE("a stopped run leaves nothing behind") {
  const TemporaryFolder folder;
  const RunControl stop{.threads = 2,
                        .progress = [](std::string_view stage, std::size_t done, std::size_t) {
                          return !(stage == "pings" && done > 16);
                        }};
  CHECK_THROWS_AS(run(small_scene(), folder / "out", stop), Stopped);
  CHECK(!std::filesystem::exists(folder / "out"));
}

TEST_CASE("what a JSF cannot hold is refused before the first ping") {
  const TemporaryFolder folder;
  std::size_t pinged = 0;
  const RunControl control{.progress = [&](std::string_view stage, std::size_t, std::size_t) {
    pinged += stage == "pings";
    return true;
  }};
  Scene scene = small_scene();
  scene.track.pings = 9;
  scene.output.jsf = true;
  scene.output.start_time = "2038-01-19T03:14:07Z";  // 2^31 - 1 seconds after 1970
  CHECK_THROWS_WITH(run(scene, folder / "out", control), Catch::Contains("output.start_time"));
  CHECK(pinged == 0);
  scene.output.start_time = "2038-01-19T03:14:06Z";
  scene.track.ping_interval_s = 0.2;  // the last of the 9 pings is too late
  CHECK_THROWS_WITH(run(scene, folder / "out", control), Catch::Contains("output.start_time"));
  CHECK(pinged == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
  scene.output.start_time = "2038-01-19T03:14:05Z";
  run(scene, folder / "out", control);
  CHECK(std::filesystem::exists(folder / "out" / "sidescan.jsf"));
}

TEST_CASE("a run that cannot write names the file, and leaves nothing behind") {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "in the way";
  CHECK_THROWS_WITH(run(small_scene(), folder / "file", {}),
                    Catch::Contains((folder / "file").string()));
  CHECK(contents(folder.path()).size() == 1);
}

TEST_CASE(
    "every scene in scenes/ and the default scene have a valid track and no key without effect, every recipe samples") {
  CHECK(Simulator(Scene{}).track().size() == 600);
  const auto survey = data_file("bathymetry/massbay_5m.tif");
  const std::filesystem::path data = survey ? survey->parent_path().parent_path() : "";
  for (const auto& entry : std::filesystem::directory_iterator(tests::source_folder() / "scenes")) {
    if (entry.path().extension() != ".toml") continue;
    CAPTURE(entry.path());
    const std::string text = read_text(entry.path());
    if (text.find("\n[dataset]") != text.npos) {
      const Recipe recipe(entry.path(), {});
      CHECK_NOTHROW(recipe.sample(0));
      CHECK_NOTHROW(recipe.sample(recipe.samples() - 1));
      continue;
    }
    if (text.find("data:") != text.npos && !survey) {
      WARN("skipped " << entry.path() << ": the real data are not there");
      continue;
    }
    Scene scene = read_scene(entry.path(), {}, data);
    CHECK(scene.warnings.empty());
    if (scene.seafloor.kind == SeafloorKind::fractal) {  // a coarser bed has the same extent
      scene.seafloor.cell_m *= 4.0;
      scene.seafloor.seabed = {};
      scene.objects.clear();
    }
    const std::size_t pings = SimulatorInternals::track_poses(Simulator(scene)).poses.size();
    const bool ahead = std::ranges::all_of(scene.sonars, &Sonar::steers);  // a picture per ping
    CHECK(pings >= (ahead ? 8 : 460));
  }
}

TEST_CASE("a track that leaves the seafloor or the water is refused with advice") {
  const auto refusal = [](auto spoil) -> std::string {
    Scene scene = small_scene();
    spoil(scene);
    return message_thrown<SceneError>([&] { Simulator(scene).track(); }, "accepted");
  };
  using Catch::Contains;
  CHECK_THAT(refusal([](Scene& s) { s.track.middle_east_m = 80.0; }), Contains("off the seafloor"));
  CHECK_THAT(refusal([](Scene& s) { s.track.pings = 5000; }), Contains("track.pings"));
  CHECK_THAT(refusal([](Scene& s) { s.track.altitude_m = 30.0; }),
             Contains("above the sea surface"));
  CHECK_THAT(refusal([](Scene& s) {
               s.track.altitude_m = 0.01;
               s.seafloor.fractal.height_at_1m_m = 0.3;
             }),
             Contains("below the bed"));
}

TEST_CASE("an object to starboard is on the right of the picture, one ahead is at the top") {
  // A box 20 m to the right and 5 m ahead of the middle of a northward, then of an eastward track.
  for (const double heading_rad : {0.0, 1.5707963267948966}) {
    CAPTURE(heading_rad);
    Seafloor bed = level_bed(20.0);
    const Eigen::Matrix3d body = body_to_world({.heading_rad = heading_rad});
    const Eigen::Vector3d place = 20.0 * body.col(1) + 5.0 * body.col(0);
    const Eigen::Vector3f half{1.0f, 1.0f, 0.0f};
    const Eigen::Vector3f foot{static_cast<float>(place.x()), static_cast<float>(place.y()),
                               -20.0f};
    add_box(bed, foot - half, foot + half + Eigen::Vector3f(0.0f, 0.0f, 1.5f));

    Sonar sonar = plain_sonar();
    sonar.bins = 500;
    std::vector<Pose> poses =
        generate_pings({.pings = 101, .speed_mps = 2.0, .heading_rad = heading_rad}, 0.1).poses;
    for (Pose& pose : poses) pose.position.z() = -10.0;
    Waterfall image(sonar, poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i)
      image.set_row(i, ping_once(sonar, bed, poses[i], 10.0), {.pose = poses[i]});
    const Picture picture = render(image, {}, {.level_bed = std::vector<double>(1000, 1e9)});
    REQUIRE(picture.width == 1000);
    REQUIRE(picture.height == 101);

    // The brightest spot: slant range hypot(19, 10) to starboard, 5 m = 25 pings after the middle.
    std::size_t x = 0, y = 0, objects = 0;
    for (std::size_t row = 0; row < image.rows(); ++row)
      for (std::size_t column = 0; column < image.columns(); ++column)
        if (image.pixels.instance[row * image.columns() + column] == 7) {
          x += column;
          y += row;
          ++objects;
        }
    REQUIRE(objects > 100);
    const double range_m =
        (static_cast<double>(x) / static_cast<double>(objects) - 500.0) * sonar.bin_m();
    CHECK(range_m == Approx(std::hypot(19.0, 10.0)).margin(1.5));
    CHECK(static_cast<double>(y) / static_cast<double>(objects) == Approx(75.0).margin(3.0));
    // In the picture that row is a quarter from the top, and the shadow is beyond the object.
    const std::size_t row = 100 - 75;
    const auto at = [&](double r) {
      const auto from_middle = static_cast<std::ptrdiff_t>(r / sonar.bin_m());  // negative: port
      return picture.pixels[row * 1000 + static_cast<std::size_t>(500 + from_middle)];
    };
    CHECK(at(std::hypot(19.0, 9.5)) > at(std::hypot(17.0, 10.0)) + 20);
    CHECK(at(std::hypot(22.0, 10.0)) == 0);
    CHECK(at(-std::hypot(22.0, 10.0)) > 0);
  }
}
