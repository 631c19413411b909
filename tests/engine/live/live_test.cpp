#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/live/server.h>
#include <ensonify/engine/live/session.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/frames.h>
#include <ensonify/engine/live/live_scene.h>
#include <ensonify/engine/live/mailbox.h>
#include <ensonify/engine/live/mesh_viewer.h>
#include <ensonify/engine/live/ping_loop.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/height_tiles.h>

#include "support/at.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tiny_scene.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using namespace std::chrono_literals;

namespace {

FrameKind kind_of(const Bytes& frame) { return at<FrameKind>(*frame, 0); }

std::shared_ptr<LiveLine> line_of(std::uint64_t number, std::size_t bytes) {
  auto line = std::make_shared<LiveLine>();
  line->number = number;
  line->setting = nullptr;
  line->frame = json_frame(FrameKind::line, std::string(bytes, ' '));
  return line;
}

/// The frames of a ring until there are `lines` lines, for at most a minute.
std::vector<Bytes> frames_of(LineRing& ring, std::size_t lines) {
  LineReader reader(ring, false);
  std::vector<Bytes> all;
  std::size_t count = 0;
  for (int i = 0; i < 600 && count < lines; ++i)
    for (Bytes& frame : reader.next(100ms)) {
      count += kind_of(frame) == FrameKind::line;
      all.push_back(std::move(frame));
    }
  return all;
}

/// Reads until a frame of this kind has this text, for at most a minute.
bool reads(LineReader& reader, FrameKind kind, const std::string& text) {
  for (int i = 0; i < 600; ++i)
    for (const Bytes& frame : reader.next(100ms))
      if (kind_of(frame) == kind && frame->find(text) != std::string::npos) return true;
  return false;
}

}  // namespace

TEST_CASE("The lines of a session equal the run's picture byte by byte") {
  const TemporaryFolder folder;
  std::string stationary = tiny_scene;
  stationary.insert(stationary.find("pings ="), "speed_mps = 0\n");
  for (const std::string& text :
       {tiny_scene, tiny_scene + "[artefacts]\nlost = 0.2\nrepeated = 0.2\n", stationary}) {
    write_text(folder / "tiny.toml", text);
    const Scene scene = read_scene(folder / "tiny.toml");
    Simulator simulator(scene);
    const ScenePings pings = ping_all(scene, simulator, 2);
    const Picture picture = render(pings.images.front(), scene.display, simulator.calibration(0));
    LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0});
    session.start();
    std::size_t row = picture.height;
    bool setting = false;
    for (const Bytes& frame : frames_of(session.ring(), picture.height)) {
      setting = setting || kind_of(frame) == FrameKind::setting;
      if (kind_of(frame) != FrameKind::line) continue;
      REQUIRE(setting);
      REQUIRE(row-- > 0);
      REQUIRE(at<std::uint32_t>(*frame, 8 + 16) == picture.width);
      const std::size_t brightness = 8 + 64 + 2 * picture.width;
      CHECK(std::memcmp(frame->data() + brightness, &picture.pixels[row * picture.width],
                        picture.width) == 0);
    }
    CHECK(row == 0);
  }
}

TEST_CASE("A line in slant range and its sonar's height give the run's picture in ground range") {
  const TemporaryFolder folder;
  std::string text = tiny_scene;
  text.insert(text.find("range_m ="), "forward_m = 1.5\nstarboard_m = 0.5\ndown_m = 3\n");
  text += "[display]\nslant_range_correction = true\n";
  write_text(folder / "tiny.toml", text);
  const Scene scene = read_scene(folder / "tiny.toml");
  Simulator simulator(scene);
  const ScenePings pings = ping_all(scene, simulator, 2);
  const Picture picture = render(pings.images.front(), scene.display, simulator.calibration(0));
  LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0});
  session.start();
  std::size_t row = picture.height;
  const auto bins = static_cast<std::size_t>(scene.sonars[0].bins);
  const double bin_m = scene.sonars[0].bin_m();
  for (const Bytes& frame : frames_of(session.ring(), picture.height)) {
    if (kind_of(frame) == FrameKind::setting)
      CHECK(frame->find("\"ground\":true") != std::string::npos);
    if (kind_of(frame) != FrameKind::line) continue;
    REQUIRE(row-- > 0);
    const std::size_t end = frame->size();
    const Pose sonar = mounted(pings.images.front().pings[picture.height - 1 - row].pose,
                               scene.sonars[0].mounting);
    CHECK(at<double>(*frame, end - 40) == sonar.position.x());
    CHECK(at<double>(*frame, end - 32) == sonar.position.y());
    CHECK(at<double>(*frame, end - 24) == sonar.position.z());
    CHECK(at<double>(*frame, end - 16) == sonar.heading_rad);
    const auto height_m = at<double>(*frame, end - 8);
    const std::size_t levels = 8 + 64, brightness = levels + 2 * picture.width;
    std::size_t wrong = 0;
    for (std::size_t column = 0; column < picture.width; ++column) {
      const bool port = column < bins;
      const double over_m =
          (static_cast<double>(port ? bins - 1 - column : column - bins) + 0.5) * bin_m;
      const auto bin =
          static_cast<std::size_t>(std::sqrt(over_m * over_m + height_m * height_m) / bin_m);
      const std::size_t from = port ? bins - 1 - bin : bins + bin;
      const int shown = bin < bins ? static_cast<unsigned char>((*frame)[brightness + from]) : 0;
      wrong += shown != picture.pixels[row * picture.width + column];
    }
    CHECK(wrong == 0);
  }
  CHECK(row == 0);
}

TEST_CASE("A level is sent in steps of a 256th of a decibel, and no echo as 0") {
  CHECK(level_number(0.0f) == 0);
  CHECK(level_number(1.0f) == 32768);
  CHECK(level_number(10.0f) == 32768 + 2560);
  CHECK(level_number(1e-30f) == 1);
  CHECK(level_number(1e30f) == 65535);
}

TEST_CASE("A ring keeps the newest lines, and a reader that was up to date gets a gap frame") {
  LineRing ring(10'000);
  const Bytes setting = json_frame(FrameKind::setting, "{}");
  ring.post(LatestFrame::setting, setting);
  const auto push = [&](std::uint64_t first, std::uint64_t end) {
    for (std::uint64_t i = first; i < end; ++i) {
      auto line = line_of(i, 992);
      line->setting = setting;
      ring.push(std::move(line));
    }
  };
  push(0, 25);
  CHECK(ring.line(14) == nullptr);
  REQUIRE(ring.line(15) != nullptr);
  CHECK(ring.line(15)->number == 15);
  CHECK(ring.line(25) == nullptr);
  LineReader reader(ring, false);
  std::vector<Bytes> frames = reader.next(0ms);
  REQUIRE(frames.size() == 11);  // a new reader has missed nothing
  CHECK(kind_of(frames.front()) == FrameKind::setting);
  CHECK(reader.next(0ms).empty());
  push(25, 60);
  frames = reader.next(0ms);
  REQUIRE(frames.size() == 2);
  CHECK(kind_of(frames.front()) == FrameKind::gap);
  CHECK(frames.front()->find(R"({"first":25,"count":34})") != std::string::npos);
  ring.close();
  CHECK(reader.next(1h).empty());
}

TEST_CASE("A page gets the setting, and each new one, also while no line is made") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session({.scene = folder / "tiny.toml", .hold = true});
  session.start();
  LineReader reader(session.ring(), false);
  std::string setting;
  const auto shows = [&](const std::string& wanted) {
    for (int i = 0; i < 600 && setting.find(wanted) == std::string::npos; ++i)
      for (const Bytes& frame : reader.next(100ms)) {
        REQUIRE(kind_of(frame) != FrameKind::line);
        if (kind_of(frame) == FrameKind::setting) setting = *frame;
      }
    return setting.find(wanted) != std::string::npos;
  };
  CHECK(shows("\"palette\":\"grey\""));
  session.change(R"({"set": {"display.palette": "copper"}})");
  CHECK(shows("\"palette\":\"copper\""));
  session.change(R"({"set": {"sonar.left-right.range_m": 12.0}})");
  CHECK(shows("\"range_m\":12.0"));
}

TEST_CASE("A session has its scene's warnings, and those of changes become troubles") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  CHECK(LiveSession({.scene = folder / "tiny.toml"}).warnings().empty());
  LiveSession session(
      {.scene = folder / "tiny.toml", .overrides = {"sonar.left-right.elevations=17"}});
  REQUIRE(session.warnings().size() == 1);
  LiveSession changed({.scene = folder / "tiny.toml", .hold = true});
  changed.start();
  changed.change(R"({"set": {"sonar.left-right.elevations": 17}})");
  LineReader reader(changed.ring(), false);
  std::string status;
  for (int i = 0; i < 600 && status.find(session.warnings()[0]) == std::string::npos; ++i)
    for (const Bytes& frame : reader.next(100ms))
      if (kind_of(frame) == FrameKind::status) status = *frame;
  CHECK(status.find("\"trouble\":\"" + session.warnings()[0]) != std::string::npos);
  CHECK(status.find("\"trouble_number\":1,") != std::string::npos);
}

TEST_CASE("Keys of the picture that the live view does not have are named in one warning") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const LiveSession session({.scene = folder / "tiny.toml",
                             .overrides = {"display.speed_correction=true",
                                           "display.smoothing_px=2", "display.mapping=equalised"}});
  REQUIRE(session.warnings().size() == 1);
  CHECK_THAT(session.warnings()[0],
             Catch::StartsWith("the live view ") &&
                 Catch::Contains("display.speed_correction, display.smoothing_px, "
                                 "display.mapping = \"equalised\":"));
}

TEST_CASE("The vehicle of a recorded track begins at the track's own altitude and speed") {
  const TemporaryFolder folder;
  write_text(folder / "track.csv",
             "t_s,x_m,y_m,z_m,heading_deg\n0,0,-3,-14,0\n0.5,0,-1.5,-14,0\n1,0,0,-14,0\n"
             "1.5,0,1.5,-14,0\n2,0,3,-14,0\n");
  std::string text = tiny_scene;
  text.replace(text.find("pings = 9"), 9,
               "kind = \"file\"\nfile = \"track.csv\"\nping_interval_s = 0.1");
  write_text(folder / "tiny.toml", text);
  const SessionScene source = SessionScene::of_file(folder / "tiny.toml", {}, {});
  const Scene scene = source.with();
  Mailbox mailbox(source, 0.0, false);
  LineRing ring(1 << 20);
  PingLoop loop(std::make_shared<LiveScene>(scene, Preparation{}), "tiny", mailbox, ring);
  const Vehicle vehicle = mailbox.control().vehicle;
  CHECK(vehicle.speed_mps == Approx(3.0));
  CHECK(vehicle.altitude_m == Approx(scene.seafloor.depth_m - 14.0).margin(0.5));

  // Half of the speed takes twice the pings, and the altitude stays.
  mailbox.accept(
      {.set = SceneChange{
           .before = source, .scene = scene, .vehicle = {.speed_mps = 0.5 * vehicle.speed_mps}}});
  std::thread pings([&] { loop.run(); });
  std::vector<float> north_m, up_m;
  for (const Bytes& frame : frames_of(ring, 10))
    if (kind_of(frame) == FrameKind::line) {
      north_m.push_back(at<float>(*frame, 8 + 28));
      up_m.push_back(at<float>(*frame, 8 + 32));
    }
  mailbox.stop();
  pings.join();
  REQUIRE(north_m.size() >= 10);
  CHECK(north_m[9] - north_m[0] == Approx(9 * 0.1 * 1.5).margin(0.01));
  CHECK(std::ranges::all_of(up_m, [](float z) { return z == -14.0f; }));
}

TEST_CASE("A vehicle that is to rise above the water dives as soon as it is to") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session(
      {.scene = folder / "tiny.toml",
       .overrides = {"track.pings=100000", "track.speed_mps=0.0001", "track.ping_interval_s=1"},
       .pings_per_s = 300.0});
  session.start();
  session.change(R"({"set": {"track.altitude_m": 500}})");
  LineReader reader(session.ring(), false);
  std::size_t at_surface = 0, still = 0;
  bool dives = false;
  for (int i = 0; i < 600 && !dives; ++i)
    for (const Bytes& frame : reader.next(100ms)) {
      if (kind_of(frame) != FrameKind::line) continue;
      const bool highest = at<float>(*frame, 8 + 32) > -0.6f;
      if (highest && at_surface < 200 && ++at_surface == 200)
        session.change(R"({"set": {"track.altitude_m": 5}})");
      else if (highest && at_surface == 200)
        ++still;
      dives = dives || (!highest && at_surface == 200);
    }
  CHECK(dives);
  CHECK(still < 100);  // those that were on their way
  session.stop();
}

TEST_CASE("A faulty change is refused with the right kind of error, and a good one is made") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0});
  for (const std::string wrong :
       {"", "[]", "{}", "{\"set\"", R"({"jump": true})", R"({"hold": 1})", R"({"pings_per_s": -1})",
        R"({"set": {}})", R"({"add": 3})", R"({"add": {"shape": "barrel", "ahead_m": "x"}})",
        R"({"set": {"track.altitude_m": null}})", R"({"set": {"sonar": {"left-right": {}}}})",
        R"({"pings_per_s": 5, "set": 3})"})
    CHECK_THROWS_AS(session.change(wrong), std::invalid_argument);
  const std::string deep = std::string(9000, '[') + std::string(9000, ']');
  CHECK_THROWS_AS(session.change(R"({"set": {"a": )" + deep + "}}"), std::invalid_argument);
  for (const std::string wrong :
       {R"({"set": {"sonar.left-right.range_m": -1}})", R"({"set": {"sonar.other.range_m": 5}})",
        R"({"set": {"nonsense": 1}})", R"({"set": {"track.altitude_m": "high"}})",
        R"({"set": {"seafloor.material": 3}})", R"({"add": {"shape": "house"}})", R"({"add": {}})"})
    CHECK_THROWS_AS(session.change(wrong), SceneError);
  CHECK_THROWS_WITH(session.change(R"({"set": {"track.altitude_m": NaN}})"),
                    Catch::StartsWith("this is not JSON"));
  CHECK_THROWS_WITH(session.change(R"({"set": {"track.altitude_m": null}})"),
                    Catch::StartsWith("'track.altitude_m' is null, expected a number"));
  CHECK_NOTHROW(session.change(R"({"set": {"sonar.left-right.range_m": 12.0}, "hold": false})"));
  session.start();
  bool other = false;
  for (const Bytes& frame : frames_of(session.ring(), 9))
    other = other || frame->find("\"range_m\":12.0") != std::string::npos;
  CHECK(other);
}

TEST_CASE("A sonar's key changes the sonar, however TOML writes it") {
  const SessionScene now(tiny_scene, "tiny", {}, {});
  const auto read = [&](const std::string& key) {
    return *read_change(R"({"set": {")" + key + R"(": 12.0}})", now).set;
  };
  const SceneChange bare = read("sonar.left-right.range_m");
  CHECK(!bare.seabed);
  CHECK(bare.sonars.size() == 1);
  // Other ways have the whole scene made ready again.
  for (const std::string key : {"sonar. left-right.range_m", R"(sonar.\"left-right\".range_m)"}) {
    const SceneChange odd = read(key);
    CHECK(odd.seabed);
    CHECK(odd.scene.sonars.front().range_m == 12.0);
  }
}

TEST_CASE("A sonar mounted out of the water is reported once, and the session continues") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0, .hold = true});
  session.start();
  session.change(R"({"set": {"sonar.left-right.down_m": 30.0}, "hold": false})");
  LineReader reader(session.ring(), false);
  std::size_t lines = 0;
  std::string status;
  const auto until = [&](const auto& enough) {
    for (int i = 0; i < 600 && !enough(); ++i)
      for (const Bytes& frame : reader.next(100ms)) {
        lines += kind_of(frame) == FrameKind::line;
        if (kind_of(frame) == FrameKind::status) status = *frame;
      }
    return enough();
  };
  REQUIRE(until([&] { return status.find("\"finished\":true") != std::string::npos; }));
  CHECK(status.find("sonar left-right") != std::string::npos);
  CHECK(status.find("m below the bed") != std::string::npos);
  CHECK(status.find("\"trouble_number\":1,") != std::string::npos);
  CHECK(lines == 0);
  session.change(R"({"set": {"sonar.left-right.down_m": 0.0}, "again": true})");
  CHECK(until([&] { return lines == 9; }));
  CHECK(!session.fault());
}

TEST_CASE("An object that cannot be added is reported, and the session continues") {
  const SessionScene source(tiny_scene, "tiny", {}, {});
  const Scene scene = source.with();
  Mailbox mailbox(source, 0.0, false);
  LineRing ring(1 << 20);
  PingLoop loop(std::make_shared<LiveScene>(scene, Preparation{}), "tiny", mailbox, ring);
  mailbox.accept({.add = AddedObject{.object = {}, .ahead_m = 1.0, .starboard_m = 1.0}});
  std::thread pings([&] { loop.run(); });
  std::size_t lines = 0;
  for (const Bytes& frame : frames_of(ring, 9)) lines += kind_of(frame) == FrameKind::line;
  mailbox.stop();
  pings.join();
  CHECK(lines == 9);
  CHECK(mailbox.status().trouble == "Simulator: the mesh has no faces");
  CHECK(!mailbox.fault());
}

TEST_CASE("A sonar that cannot be had leaves no key behind, and the session continues") {
  const SessionScene source(tiny_scene, "tiny", {}, {});
  const Scene scene = source.with();
  Mailbox mailbox(source, 0.0, false);
  LineRing ring(1 << 20);
  PingLoop loop(std::make_shared<LiveScene>(scene, Preparation{}), "tiny", mailbox, ring);
  // As a sonar that needs too much memory: the key is valid, and the loop cannot make the sonar.
  SceneChange change{
      .keys = {{"sonar.left-right.range_m", "12.0"}}, .before = source, .scene = scene};
  Sonar sonar = scene.sonars[0], impossible = sonar;
  sonar.bins = 50;
  impossible.range_m = -1.0;
  change.sonars = {{0, sonar}, {0, impossible}};
  mailbox.accept({.set = change});
  CHECK(mailbox.present().with().sonars[0].range_m == 12.0);
  std::thread pings([&] { loop.run(); });
  std::size_t lines = 0;
  for (const Bytes& frame : frames_of(ring, 9))
    if (kind_of(frame) == FrameKind::line) {
      ++lines;
      CHECK(at<std::uint32_t>(*frame, 8 + 16) == 2u * static_cast<unsigned>(scene.sonars[0].bins));
    }
  mailbox.stop();
  pings.join();
  CHECK(lines == 9);
  CHECK(mailbox.present().with().sonars[0].range_m == scene.sonars[0].range_m);
  CHECK(mailbox.status().trouble_number == 1);
  CHECK(!mailbox.fault());
}

TEST_CASE("The truth of a bin equals the run's while the line is kept") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const Scene scene = read_scene(folder / "tiny.toml");
  Simulator simulator(scene);
  const ScenePings pings = ping_all(scene, simulator, 1);
  LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0});
  session.start();
  frames_of(session.ring(), 9);
  CHECK(session.truth(3, 100) == R"({"region":"water column"})");
  const BinLayers& layers = pings.images.front().pixels;
  const std::string truth = session.truth(3, 10);
  CHECK(truth.find("\"sediment\":\"plain\"") != std::string::npos);
  const std::size_t at = truth.find("\"x_m\":") + 6;
  CHECK(std::stod(truth.substr(at)) == Approx(layers.x_m[3 * 200 + 10]));
  CHECK_THROWS_AS(session.truth(9, 0), std::out_of_range);
  CHECK_THROWS_AS(session.truth(3, 200), std::out_of_range);
}

TEST_CASE("A mailbox keeps changes until they are taken, and prepares one seabed at a time") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const SessionScene source = SessionScene::of_file(folder / "tiny.toml", {}, {});
  Mailbox mailbox(source, 5.0, true);
  CHECK(mailbox.control().hold);
  CHECK(mailbox.control().pings_per_s == 5.0);

  SceneChange sonar{.before = source, .scene = source.with()};
  sonar.keys = {{"sonar.left-right.bins", "100"}};
  sonar.sonars.emplace_back(0, sonar.scene.sonars[0]);
  SceneChange later = sonar;
  later.sonars[0].second.bins = 90;
  mailbox.accept({.set = sonar, .hold = false});
  mailbox.accept({.set = later, .again = true});
  CHECK(!mailbox.control().hold);
  mailbox.wait_for_changes(std::chrono::hours(1));  // there are some
  std::optional<PendingChanges> taken = mailbox.take();
  REQUIRE(taken);
  REQUIRE(taken->sonars);  // one change with the latest settings
  REQUIRE(taken->sonars->sonars.size() == 1);
  CHECK(taken->sonars->sonars[0].second.bins == 90);
  CHECK(taken->sonars->keys.size() == 2);
  CHECK(taken->again);
  CHECK(!mailbox.take()->sonars);

  SceneChange seabed{.before = source, .scene = source.with(), .seabed = true};
  mailbox.accept({.set = seabed});
  CHECK(mailbox.status().preparing);
  CHECK_THROWS_AS(mailbox.accept({.set = seabed}), std::invalid_argument);
  mailbox.give_up("too steep");
  CHECK(!mailbox.status().preparing);
  CHECK(mailbox.status().trouble == "too steep");
  CHECK(mailbox.status().trouble_number == 1);
  mailbox.accept({.set = seabed});

  // Sonars that change meanwhile change again over the new seabed, except a refused one.
  mailbox.accept({.set = sonar});
  SceneChange refused = sonar;
  refused.keys = {{"sonar.left-right.range_m", "12.0"}, {"display.gamma", "0.5"}};
  mailbox.accept({.set = refused});
  CHECK(mailbox.take()->sonars->keys.size() == 3);
  mailbox.refuse(refused, "too large");
  CHECK(mailbox.status().trouble == "too large");
  CHECK(mailbox.present().with().sonars[0].range_m == source.with().sonars[0].range_m);
  CHECK(mailbox.present().with().display.gamma == 0.5);
  mailbox.deliver(nullptr, seabed);
  taken = mailbox.take();
  REQUIRE(taken->sonars);
  REQUIRE(taken->sonars->sonars.size() == 1);
  CHECK(taken->sonars->sonars[0].second.range_m == source.with().sonars[0].range_m);
  CHECK(taken->display->gamma == 0.5);

  // A page cannot make the loop's work grow without end.
  LiveChange added;
  added.add = AddedObject{.object = {}, .ahead_m = 0.0, .starboard_m = 0.0};
  for (int i = 0; i < 64; ++i) mailbox.accept(added);
  CHECK_THROWS_WITH(mailbox.accept(added), Catch::Contains("64 objects wait to be added"));
  CHECK(mailbox.take()->objects.size() == 64);

  mailbox.stop();
  CHECK(!mailbox.take());
  mailbox.wait_for_changes(std::chrono::hours(1));
  mailbox.wait_until(std::chrono::steady_clock::now() + std::chrono::hours(1));
}

TEST_CASE("A seabed that cannot be made leaves nothing of its change, and others made meanwhile") {
  const SessionScene source(tiny_scene, "tiny", {}, {});
  const Sonar sonar = source.with().sonars[0];
  Mailbox mailbox(source, 5.0, true);
  mailbox.set_vehicle({.altitude_m = 10.0, .speed_mps = 2.0});
  const auto read = [&](const std::string& set) {
    return *read_change(R"({"set": )" + set + "}", mailbox.present()).set;
  };
  const auto accept = [&](const std::string& set) { mailbox.accept({.set = read(set)}); };
  const SceneChange seabed = read(
      R"({"seafloor.depth_m": 18, "display.gamma": 0.5, "track.altitude_m": 7,
          "sonar.left-right.range_m": 12, "sonar.left-right.frequency_hz": 300e3})");
  const auto meanwhile = [&] {
    mailbox.accept({.set = seabed});
    CHECK(!mailbox.take()->display);
    accept(R"({"sonar.left-right.bins": 60, "track.speed_mps": 1})");
    accept(R"({"display.gain_db": 3, "sonar.left-right.range_m": 13})");
    // The present seabed goes on without any key of the next one.
    const std::optional<PendingChanges> taken = mailbox.take();
    REQUIRE(taken->sonars);
    REQUIRE(taken->sonars->sonars.size() == 1);
    CHECK(taken->sonars->sonars[0].second.range_m == 13.0);
    CHECK(taken->sonars->sonars[0].second.frequency_hz == sonar.frequency_hz);
    CHECK(taken->display->gamma == source.with().display.gamma);
    CHECK(taken->display->gain_db == 3.0);
    CHECK(mailbox.control().vehicle.altitude_m == 10.0);
  };
  const auto frequency_hz = [&] { return mailbox.present().with().sonars[0].frequency_hz; };

  meanwhile();
  mailbox.give_up("too steep");
  std::optional<PendingChanges> taken = mailbox.take();
  CHECK(!taken->sonars);
  CHECK(!taken->display);
  CHECK(mailbox.control().vehicle.altitude_m == 10.0);
  CHECK(mailbox.control().vehicle.speed_mps == 1.0);
  CHECK(mailbox.present().with().seafloor.depth_m == source.with().seafloor.depth_m);
  CHECK(mailbox.present().with().sonars[0].range_m == 13.0);
  CHECK(frequency_hz() == sonar.frequency_hz);

  // One that is made has all of both; of the same key, the later value.
  meanwhile();
  mailbox.deliver(nullptr, seabed);
  taken = mailbox.take();
  REQUIRE(taken->sonars);
  REQUIRE(taken->sonars->sonars.size() == 1);
  CHECK(taken->sonars->sonars[0].second.range_m == 13.0);
  CHECK(taken->sonars->sonars[0].second.bins == 60);
  CHECK(taken->sonars->sonars[0].second.frequency_hz == 300e3);
  CHECK(taken->display->gamma == 0.5);
  CHECK(taken->display->gain_db == 3.0);
  CHECK(mailbox.control().vehicle.altitude_m == 7.0);
  CHECK(mailbox.control().vehicle.speed_mps == 1.0);
  CHECK(mailbox.present().with().seafloor.depth_m == 18.0);
  CHECK(frequency_hz() == 300e3);
}

TEST_CASE("Changes that do not fit the new seabed are undone, and said") {
  Mailbox mailbox(SessionScene(tiny_scene, "tiny", {}, {}), 5.0, true);
  const auto read = [&](const std::string& set) {
    return *read_change(R"({"set": )" + set + "}", mailbox.present()).set;
  };
  const SceneChange seabed =
      read(R"({"seafloor.depth_m": 18, "sonar.left-right.sector_high_deg": 60})");
  mailbox.accept({.set = seabed});
  mailbox.accept({.set = read(R"({"sonar.left-right.sector_low_deg": 70})")});
  CHECK(mailbox.take()->sonars);
  mailbox.deliver(nullptr, seabed);
  CHECK(!mailbox.take()->sonars);
  CHECK(mailbox.present().with().seafloor.depth_m == 18.0);
  const Sonar sonar = mailbox.present().with().sonars[0];
  CHECK(sonar.sector_high_rad == seabed.scene.sonars[0].sector_high_rad);
  CHECK(sonar.sector_low_rad == seabed.scene.sonars[0].sector_low_rad);
  CHECK(mailbox.status().trouble.find("changes that do not fit the new seabed are undone: ") == 0);
  CHECK(!mailbox.status().preparing);
}

TEST_CASE("Objects, their removal and a new beginning that wait together keep their order") {
  Mailbox mailbox(SessionScene(tiny_scene, "tiny", {}, {}), 5.0, true);
  const auto add = [&](double ahead_m) {
    mailbox.accept({.add = AddedObject{.object = {}, .ahead_m = ahead_m, .starboard_m = 0.0}});
  };
  add(1.0);
  mailbox.accept({.clear = true});
  add(2.0);
  mailbox.accept({.again = true});
  add(3.0);
  std::optional<PendingChanges> taken = mailbox.take();
  CHECK(taken->clear);
  CHECK(taken->again);
  REQUIRE(taken->objects.size() == 1);
  CHECK(taken->objects[0].ahead_m == 2.0);
  REQUIRE(taken->objects_after_again.size() == 1);
  CHECK(taken->objects_after_again[0].ahead_m == 3.0);
  mailbox.accept({.again = true});
  add(4.0);
  mailbox.accept({.clear = true});
  taken = mailbox.take();
  CHECK(taken->objects.empty());
  CHECK(taken->objects_after_again.empty());
}

TEST_CASE("An object that is added after a new beginning lies ahead of the beginning") {
  const SessionScene source(tiny_scene, "tiny", {}, {});
  const LiveChange add =
      read_change(R"({"add": {"shape": "barrel", "ahead_m": 0.5, "starboard_m": 6}})", source);
  // What the lines show while the vehicle goes along the track, beside an object at its beginning.
  const auto lines = [&](std::size_t earlier_runs) {
    Mailbox mailbox(source, 0.0, earlier_runs == 0);
    LineRing ring(1 << 20);
    PingLoop loop(std::make_shared<LiveScene>(source.with(), Preparation{}), "tiny", mailbox, ring);
    std::thread pings([&] { loop.run(); });
    frames_of(ring, 9 * earlier_runs);
    mailbox.accept({.hold = true, .again = true});
    mailbox.accept(add);
    LineReader reader(ring, false);
    REQUIRE(reads(reader, FrameKind::status, "\"things\":1,"));
    mailbox.accept({.hold = false});
    std::vector<std::string> all;
    for (const Bytes& frame : frames_of(ring, 9 * (earlier_runs + 1)))
      if (kind_of(frame) == FrameKind::line) all.push_back(frame->substr(8 + 64));
    mailbox.stop();
    pings.join();
    REQUIRE(all.size() == 9 * (earlier_runs + 1));
    return std::vector<std::string>(all.end() - 9, all.end());
  };
  CHECK((lines(1) == lines(0)));
}

TEST_CASE("Added objects lie on a new seabed as if they had been added to it") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const std::string add = R"({"add": {"shape": "barrel", "ahead_m": 0.5, "starboard_m": 6}})",
                    seabed = R"({"set": {"seafloor.depth_m": 18}})";
  // The regions and classes of all bins. The levels have other last bits, because the beginning of
  // the track is a few micrometres off over another bed.
  const auto labels_after = [&](const std::vector<std::string>& changes) {
    LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0, .hold = true});
    session.start();
    LineReader reader(session.ring(), false);
    REQUIRE(reads(reader, FrameKind::bed, ""));
    for (const std::string& change : changes) {
      session.change(change);
      REQUIRE((change == add ? reads(reader, FrameKind::status, "\"things\":1,")
                             : reads(reader, FrameKind::bed, "")));
    }
    session.change(R"({"hold": false})");
    std::vector<std::string> labels;
    for (const Bytes& frame : frames_of(session.ring(), 9))
      if (kind_of(frame) == FrameKind::line)
        labels.push_back(frame->substr(8 + 64 + 3 * 200, 2 * 200));
    REQUIRE(labels.size() == 9);
    return labels;
  };
  const std::vector<std::string> kept = labels_after({add, seabed});
  CHECK((kept == labels_after({seabed, add})));
  CHECK((kept != labels_after({seabed})));
}

TEST_CASE("Objects beside a new seabed are left out, and said") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session({.scene = folder / "tiny.toml", .hold = true});
  session.start();
  LineReader reader(session.ring(), false);
  session.change(R"({"add": {"shape": "barrel", "starboard_m": 15, "ahead_m": 0}})");
  REQUIRE(reads(reader, FrameKind::status, "\"things\":1,"));
  session.change(R"({"set": {"seafloor.extent_east_m": 24}})");
  CHECK(reads(reader, FrameKind::status, "there is no seafloor at its position"));
}

TEST_CASE("Only addresses that no other machine can reach are loopback") {
  for (const std::string own : {"127.0.0.1", "127.1.2.3", "::1", "localhost"})
    CHECK(is_loopback(own));
  for (const std::string other :
       {"0.0.0.0", "::", "192.168.0.1", "127.0.0.1.example.com", "128.0.0.1", "127..0.1", "127.0.0",
        "127.0.0.1234", "", "localhost.example.com"})
    CHECK_FALSE(is_loopback(other));
}

TEST_CASE(
    "The mesh for display is that of a whole bed which fits the memory, or a stop check ends it") {
  SeafloorOptions options;
  options.extent_east_m = options.extent_north_m = 60.0;
  options.cell_m = 0.5;
  const Seafloor bed = make_seafloor(options, 1, {}, {}, {}, BedForm::grid);
  const std::size_t rows = 120;
  std::size_t checks = 0, end = std::numeric_limits<std::size_t>::max();
  struct Stop {};
  const auto stop_check = [&] {
    if (++checks == end) throw Stop{};
  };
  const MeshPreview whole(bed, {}, stop_check);
  CHECK(checks > rows);  // also in the analysis
  for (const std::size_t each : {std::size_t{1}, rows / 2, checks}) {
    checks = 0;
    end = each;
    CHECK_THROWS_AS(MeshPreview(bed, {}, stop_check), Stop);
    CHECK(checks == end);
  }
  CHECK_THROWS_AS(MeshPreview(bed, {.bytes = 1.0}, {}), MemoryError);
  const Seafloor in_tiles = make_seafloor_in_tiles(options, 1, {}, {}, {});
  CHECK_THROWS_WITH(MeshPreview(in_tiles, {}, {}), Catch::Contains("made in tiles"));
  CHECK(in_tiles.grid->tiles_in_file()->tiles_made() == 0);
}

TEST_CASE("a watched bed is static, and one in tiles has the surface that tiles take") {
  Scene scene;
  CHECK(with_session_surface(scene).run.surface == "static");
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 1300.0;
  scene.seafloor.cell_m = 0.1;
  CHECK(with_session_surface(scene).run.surface == "auto");
}
