#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/live/server.h>
#include <ensonify/engine/live/session.h>

#include <cstring>
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
#include <ensonify/engine/live/ping_loop.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/prepare.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tiny_scene.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using namespace std::chrono_literals;

namespace {

template <class T>
T number_at(const std::string& frame, std::size_t at) {
  T value;
  std::memcpy(&value, frame.data() + at, sizeof value);
  return value;
}
FrameKind kind_of(const Bytes& frame) { return number_at<FrameKind>(*frame, 0); }

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

}  // namespace

TEST_CASE("The lines of a session equal the run's picture byte by byte") {
  const TemporaryFolder folder;
  std::string stationary = tiny_scene;
  stationary.insert(stationary.find("pings ="), "speed_mps = 0\n");
  for (const std::string& text :
       {tiny_scene,
        tiny_scene +
            "[artefacts]\nlost = 0.2\nrepeated = 0.2\n[display]\nslant_range_correction = true\n",
        stationary}) {
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
      REQUIRE(number_at<std::uint32_t>(*frame, 8 + 16) == picture.width);
      const std::size_t brightness = 8 + 64 + 2 * picture.width;
      CHECK(std::memcmp(frame->data() + brightness, &picture.pixels[row * picture.width],
                        picture.width) == 0);
    }
    CHECK(row == 0);
  }
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

TEST_CASE("A faulty change is refused with the right kind of error, and a good one is made") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  LiveSession session({.scene = folder / "tiny.toml", .pings_per_s = 0.0});
  for (const std::string wrong :
       {"", "[]", "{}", "{\"set\"", R"({"jump": true})", R"({"hold": 1})", R"({"pings_per_s": -1})",
        R"({"set": {}})", R"({"add": {}})", R"({"add": {"shape": "barrel", "ahead_m": "x"}})",
        R"({"pings_per_s": 5, "set": 3})"})
    CHECK_THROWS_AS(session.change(wrong), std::invalid_argument);
  const std::string deep = std::string(9000, '[') + std::string(9000, ']');
  CHECK_THROWS_AS(session.change(R"({"set": {"a": )" + deep + "}}"), std::invalid_argument);
  for (const std::string wrong :
       {R"({"set": {"sonar.left-right.range_m": -1}})", R"({"set": {"sonar.other.range_m": 5}})",
        R"({"set": {"nonsense": 1}})", R"({"set": {"track.altitude_m": "high"}})",
        R"({"set": {"seafloor.material": 3}})", R"({"add": {"shape": "house"}})"})
    CHECK_THROWS_AS(session.change(wrong), SceneError);
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
    return *read_change(R"({"set": {")" + key + R"(": 12.0}})", now, {}).set;
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
  Mailbox mailbox(source, scene, 0.0, false);
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
  Mailbox mailbox(source, scene, 0.0, false);
  LineRing ring(1 << 20);
  PingLoop loop(std::make_shared<LiveScene>(scene, Preparation{}), "tiny", mailbox, ring);
  // As a sonar that needs too much memory: the key is valid, and the loop cannot make the sonar.
  SceneChange change{.keys = {{"sonar.left-right.range_m", "12.0"}},
                     .before = source,
                     .scene = scene,
                     .vehicle = mailbox.control().vehicle};
  Sonar sonar = scene.sonars[0], impossible = sonar;
  sonar.bins = 50;
  impossible.range_m = -1.0;
  change.sonars = {{0, sonar}, {0, impossible}};
  mailbox.accept({.set = change});
  CHECK(mailbox.present().first.with().sonars[0].range_m == 12.0);
  std::thread pings([&] { loop.run(); });
  std::size_t lines = 0;
  for (const Bytes& frame : frames_of(ring, 9))
    if (kind_of(frame) == FrameKind::line) {
      ++lines;
      CHECK(number_at<std::uint32_t>(*frame, 8 + 16) ==
            2u * static_cast<unsigned>(scene.sonars[0].bins));
    }
  mailbox.stop();
  pings.join();
  CHECK(lines == 9);
  CHECK(mailbox.present().first.with().sonars[0].range_m == scene.sonars[0].range_m);
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
  Mailbox mailbox(source, source.with(), 5.0, true);
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
  mailbox.give_up(seabed, "too steep");
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
  CHECK(mailbox.present().first.with().sonars[0].range_m == source.with().sonars[0].range_m);
  CHECK(mailbox.present().first.with().display.gamma == 0.5);
  mailbox.deliver(nullptr);
  CHECK(mailbox.take()->sonars->keys == sonar.keys);

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

TEST_CASE("Only addresses that no other machine can reach are loopback") {
  for (const std::string own : {"127.0.0.1", "127.1.2.3", "::1", "localhost"})
    CHECK(is_loopback(own));
  for (const std::string other :
       {"0.0.0.0", "::", "192.168.0.1", "127.0.0.1.example.com", "128.0.0.1", "127..0.1", "127.0.0",
        "127.0.0.1234", "", "localhost.example.com"})
    CHECK_FALSE(is_loopback(other));
}

TEST_CASE("a watched bed is static, and one in tiles has the surface that tiles take") {
  Scene scene;
  CHECK(with_session_surface(scene).run.surface == "static");
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 1300.0;
  scene.seafloor.cell_m = 0.1;
  CHECK(with_session_surface(scene).run.surface == "auto");
}
