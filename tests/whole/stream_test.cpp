// `ensonify stream`: reads poses, writes echo lines.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/tiny_scene.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulate.h>

using namespace ensonify;
using Json = nlohmann::json;
using engine::degree;

namespace {

struct StreamFolder : tests::TemporaryFolder {
  StreamFolder() { tests::write_text(*this / "tiny.toml", tests::tiny_scene); }
  tests::Outcome stream(const std::string& lines, std::vector<std::string> more = {}) const {
    tests::write_text(*this / "in", lines);
    std::vector<std::string> arguments = {"stream", "tiny.toml", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return tests::run_program(path(), arguments, {}, {}, {}, path() / "in");
  }
};

std::vector<Json> json_lines(const std::string& text) {
  std::vector<Json> all;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    all.push_back(Json::parse(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return all;
}

const std::string pose =
    R"({"t_s": 0.5, "x_m": 0, "y_m": 1, "z_m": -12, "roll_deg": 2, "heading_deg": 10})"
    "\n";

}  // namespace

TEST_CASE("a stream's lines equal the simulator's, as a block of floats and as JSON") {
  const StreamFolder folder;
  engine::Simulator simulator(engine::read_scene(folder / "tiny.toml"));
  engine::Pose same{
      .t_s = 0.5, .position = {0, 1, -12}, .roll_rad = 2 * degree, .heading_rad = 10 * degree};
  const tests::Outcome blocks = folder.stream(pose + pose, {"--layers", "intensity,region"});
  REQUIRE(blocks.code == 0);
  const std::vector<Json> json =
      json_lines(folder.stream(pose + pose, {"--layers", "intensity,region", "--json"}).out);
  REQUIRE(json.size() == 5);
  CHECK(json[0]["sonars"][0]["name"] == "left-right");
  CHECK(json[0]["sonars"][0]["bins"] == 100);

  std::size_t at = blocks.out.find('\n') + 1;
  for (const int ping : {0, 1}) {
    const std::span<const engine::EchoLine> lines = simulator.ping(same);
    for (const std::size_t side : {0u, 1u}) {
      const std::size_t end = blocks.out.find('\n', at);
      const Json header = Json::parse(blocks.out.substr(at, end - at));
      CHECK(header["ping"] == ping);
      CHECK(header["t_s"] == 0.5);
      CHECK(header["side"] == (side == 0 ? "port" : "starboard"));
      CHECK(header["sector"] == side);
      CHECK(header["first_return"] == lines[side].first_return);
      REQUIRE(header["bytes"] == 2 * 100 * sizeof(float));
      std::vector<float> values(200);
      std::memcpy(values.data(), &blocks.out[end + 1], 800);
      at = end + 1 + 800;
      const Json& text = json[static_cast<std::size_t>(1 + 2 * ping) + side];
      for (std::size_t bin = 0; bin < 100; ++bin) {
        CHECK(values[bin] == lines[side].bins.intensity[bin]);
        CHECK(values[100 + bin] == static_cast<float>(lines[side].bins.region[bin]));
        CHECK(text["intensity"][bin].get<float>() == values[bin]);
        CHECK(text["region"][bin] == lines[side].bins.region[bin]);
      }
    }
  }
  CHECK(at == blocks.out.size());
}

TEST_CASE("in a stream a sonar can be set, and objects can be added, moved and removed") {
  const StreamFolder folder;
  const tests::Outcome outcome = folder.stream(
      // Without what a side hears past nadir, the other side has no object.
      R"({"set": {"sonar.left-right.range_m": 10, "sonar.left-right.bins": 50, "sonar.left-right.sector_high_deg": 90}})"
      "\n" +
          pose +
          R"({"add": {"shape": "cylinder", "length_m": 2}, "x_m": 5, "y_m": 0, "z_m": -18})"
          "\n" +
          R"({"x_m": 0, "y_m": 0, "z_m": -12})"
          "\n" +
          R"({"move": 1, "x_m": -5, "y_m": 0, "z_m": -18})"
          "\n" +
          R"({"x_m": 0, "y_m": 0, "z_m": -12})"
          "\n" +
          R"({"remove": 1})"
          "\n" +
          R"({"x_m": 0, "y_m": 0, "z_m": -12})"
          "\n",
      {"--json", "--layers", "instance"});
  CHECK(outcome.err == "");
  const std::vector<Json> answers = json_lines(outcome.out);
  REQUIRE(answers.size() == 3 + 4 * 2);
  CHECK(answers[1]["sonars"][0]["bins"] == 50);
  CHECK(answers[2]["bin_m"] == 0.2);
  CHECK(answers[4]["added"] == 1);
  const auto seen = [&](std::size_t i) {
    const std::vector<int> instances = answers[i]["instance"];
    return std::count(instances.begin(), instances.end(), 1) > 0;
  };
  CHECK_FALSE(seen(5));
  CHECK(seen(6));
  CHECK(seen(7));
  CHECK_FALSE(seen(8));
  CHECK_FALSE(seen(9));
  CHECK_FALSE(seen(10));
}

TEST_CASE("in a stream a blank line is skipped, also one that ends as on Windows") {
  const StreamFolder folder;
  const tests::Outcome outcome = folder.stream("\r\n" + pose + "\n \t\n" + pose, {"--json"});
  CHECK(outcome.err == "");
  CHECK(json_lines(outcome.out).size() == 5);
}

TEST_CASE("a client finds the number of a ping's lines in the start line, and after each set") {
  const StreamFolder folder;
  const std::string changed_beams = R"({"set": {"sonar.left-right.beams": 3}})"
                                    "\n";
  const tests::Outcome outcome =
      folder.stream(pose + changed_beams + pose,
                    {"--json", "-D", "sonar.left-right.beams=2", "--layers", "region"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const std::vector<Json> answers = json_lines(outcome.out);
  std::size_t at = 0;
  for (const int beams : {2, 3}) {
    REQUIRE(at < answers.size());
    std::size_t lines = 0;
    for (const Json& sonar : answers[at]["sonars"]) {
      CHECK(sonar.value("beams", 0) == beams);
      lines += sonar["sides"].size() * sonar.value("beams", std::size_t{0});
    }
    CHECK(lines == 2 * static_cast<std::size_t>(beams));
    at += 1 + lines;
  }
  CHECK(at == answers.size());
}

/// Lines that are refused, and what the message says.
const std::vector<std::pair<std::string, std::string>> wrong_lines = {
    {"pose", "is not JSON"},
    {"[1]", "expected an object"},
    {R"({"x_m": 1, "y_m": 2})", "there is no 'z_m'"},
    {R"({"x_m": 1, "y_m": 2, "z_m": "deep"})", "expected a number"},
    {R"({"x_m": 1, "y_m": 2, "z_m": -3, "yaw_deg": 4})", "unknown key 'yaw_deg'"},
    {R"({"x_m": 1e999, "y_m": 2, "z_m": -3})", "is not JSON"},
    {R"({"x_m": 1, "y_m": 2, "z_m": 3})", "sonar left-right 3.0 m above the sea surface"},
    {R"({"x_m": 1, "y_m": 2, "z_m": 0})", "sonar left-right at the sea surface"},
    {R"({"x_m": 1, "y_m": 2, "z_m": -60})", " m below the bed"},
    {R"({"x_m": 1e300, "y_m": 2, "z_m": -3})", "the pose is at (1e+300, 2, -3) m"},
    {R"({"x_m": 1, "y_m": 2, "z_m": -3, "heading_rate_degps": 1e308})", "expected at most 1e+06"},
    {R"({"x_m": 1, "y_m": 2, "z_m": -3, "heading_rate_degps": 1e9})", "degrees per second"},
    {R"({"set": {"track.pings": 4}})", "cannot be set"},
    {R"({"set": {"sonar.left-right.range_m": -4}})", "expected a number from"},
    {R"({"set": {}})", "names no key"},
    {R"({"add": {"shape": "teapot"}, "x_m": 1, "y_m": 2, "z_m": -3})", "shape"},
    {R"({"add": {"shape": "sphere", "scale": null}, "x_m": 1, "y_m": 2, "z_m": -3})",
     "'scale' is null, expected a number"},
    {R"({"set": {"sonar.left-right.frequencies_hz": [1, {"a": 2}]}})", "expected a number"},
    {R"({"add": {"mesh": "../../etc/passwd"}, "x_m": 1, "y_m": 2, "z_m": -3})", "without '..'"},
    {R"({"move": 3, "x_m": 1, "y_m": 2, "z_m": -3})", "instance 3"},
    {R"({"remove": -1})", "is not an instance"},
    {std::string(2 << 20, ' '), "longer than 1 MiB"},
    {R"({"set": {"a": )" + std::string(400000, '[') + std::string(400000, ']') + "}}",
     "levels deep"},
};

TEST_CASE("a wrong line ends a stream with its line number and advice") {
  const StreamFolder folder;
  for (const auto& [line, message] : wrong_lines) {
    CAPTURE(line.substr(0, 100), message);
    const tests::Outcome outcome = folder.stream(pose + "\n" + line + "\n" + pose);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find("ensonify: stdin:3: ") == 0);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
  }
  CHECK(folder.stream("", {"--layers", "intensty"}).code == 2);
}

TEST_CASE("an input that cannot be read is no end of a stream") {
  const StreamFolder folder;
  const tests::Outcome outcome = tests::run_program(
      folder.path(), {"stream", "tiny.toml", "--quiet"}, {}, {}, {}, folder.path());
  CHECK(outcome.code == 1);
  CHECK(outcome.err == "ensonify: stdin: cannot be read: Is a directory\n");
}

TEST_CASE("a line without an end is refused once it is too long, and the next line is read") {
  const StreamFolder folder;
  const tests::Outcome endless = tests::run_program(
      folder.path(), {"stream", "tiny.toml", "--quiet"}, {}, {}, {}, "/dev/zero");
  CHECK(endless.code == 2);
  CHECK(endless.err == "ensonify: stdin:1: the line is longer than 1 MiB\n");
  const std::string wrong(3 << 20, 'x');
  const tests::Outcome answered =
      folder.stream(wrong + "\n" + pose + wrong, {"--answer-all", "--json"});
  CHECK(answered.code == 0);
  const std::vector<Json> answers = json_lines(answered.out);
  REQUIRE(answers.size() == 5);
  CHECK(answers[1]["error"] == "stdin:1: the line is longer than 1 MiB");
  CHECK(answers[2]["ping"] == 0);
  CHECK(answers[4]["error"] == "stdin:3: the line is longer than 1 MiB");
}

TEST_CASE("a stream warns once of poses out of reach of the seafloor") {
  const StreamFolder folder;
  const std::string far = R"({"x_m": 5000, "y_m": 0, "z_m": -12})"
                          "\n";
  const tests::Outcome outcome = folder.stream(pose + far + far);
  CHECK(outcome.code == 0);
  CHECK(outcome.err.find("ensonify: warning: the pose at 5000.0 m east") == 0);
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
}

TEST_CASE("a stream loses and repeats no ping, and warns of a scene that would") {
  const StreamFolder folder;
  const tests::Outcome plain = folder.stream(pose + pose);
  const tests::Outcome lossy =
      folder.stream(pose + pose, {"-D", "artefacts.lost=0.9", "-D", "artefacts.repeated=0.9"});
  CHECK(lossy.out == plain.out);
  for (const char* key : {"artefacts.lost", "artefacts.repeated"})
    CHECK(lossy.err.find(std::string("ensonify: warning: ") + key + ": has no effect") !=
          std::string::npos);
  CHECK(plain.err.empty());
}

TEST_CASE("with --answer-all each request has an answer, and a faulty one changes nothing") {
  const StreamFolder folder;
  std::string lines = pose;
  for (const auto& [line, message] : wrong_lines) lines += line + "\n";
  const std::string place = R"(, "x_m": 5, "y_m": 0, "z_m": -18})";
  lines += pose + R"({"add": {"shape": "sphere"})" + place + "\n" + R"({"move": 1)" + place + "\n" +
           R"({"remove": 1})" + "\n" + R"({"remove": 1})" + "\n";
  const tests::Outcome outcome =
      folder.stream(lines, {"--json", "--answer-all", "--layers", "intensity_mean"});
  CHECK(outcome.code == 0);
  CHECK(outcome.err == "");
  const std::vector<Json> answers = json_lines(outcome.out);
  REQUIRE(answers.size() == 1 + 2 + wrong_lines.size() + 2 + 4);
  CHECK(answers[0]["protocol"] == 1);
  for (std::size_t i = 0; i < wrong_lines.size(); ++i) {
    const std::string error = answers[3 + i]["error"];
    CAPTURE(error, wrong_lines[i].second);
    CHECK(error.find("stdin:" + std::to_string(2 + i) + ": ") == 0);
    CHECK(error.find(wrong_lines[i].second) != std::string::npos);
  }
  const std::size_t behind = 3 + wrong_lines.size();
  for (std::size_t side = 0; side < 2; ++side) {
    Json first = answers[1 + side], again = answers[behind + side];
    CHECK(again["ping"] == 1);
    first.erase("ping");
    again.erase("ping");
    CHECK(again == first);
  }
  CHECK(answers[behind + 2]["added"] == 1);
  CHECK(answers[behind + 3]["moved"] == 1);
  CHECK(answers[behind + 4]["removed"] == 1);
  CHECK(answers[behind + 5].contains("error"));
}

TEST_CASE("with --answer-all a stream answers a request that does not fit into memory") {
  const StreamFolder folder;
  const std::string rays =
      R"({"set": {"sonar.left-right.planes": 1024, "sonar.left-right.elevations": 50000}})"
      "\n";
  const tests::Outcome outcome =
      folder.stream(pose + rays + pose, {"--json", "--answer-all", "--memory", "500MB"});
  CHECK(outcome.code == 0);
  const std::vector<Json> answers = json_lines(outcome.out);
  REQUIRE(answers.size() == 1 + 2 + 1 + 2);
  CHECK(std::string(answers[3]["error"]).find("stdin:2: ") == 0);
  CHECK(answers[4]["ping"] == 1);
  CHECK(folder.stream(pose + rays, {"--json", "--memory", "500MB"}).code == 1);
}

TEST_CASE("a stream warns once of levels that a request makes extrapolated") {
  const StreamFolder folder;
  const std::string set = R"({"set": {"sonar.left-right.frequency_hz": 2e6}})"
                          "\n";
  const std::string add =
      R"({"add": {"shape": "box", "material": "gravel"}, "x_m": 5, "y_m": 0, "z_m": -18})"
      "\n";
  const std::string warning = "levels are extrapolated";
  CHECK(folder.stream(pose + set).err.find(warning) == std::string::npos);  // "plain" has no model
  const std::string err = folder.stream(pose + set + add + set + pose).err;
  const std::size_t first = err.find(warning);
  REQUIRE(first != std::string::npos);
  CHECK(err.find("gravel", first) != std::string::npos);
  CHECK(err.find(warning, first + 1) == std::string::npos);
}

TEST_CASE("a signal ends a stream whose reader has stopped reading") {
  const StreamFolder folder;
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += pose;
  tests::write_text(folder / "in", lines);
  REQUIRE(mkfifo((folder / "lines").c_str(), 0600) == 0);
  const int reader = open((folder / "lines").c_str(), O_RDWR);
  const tests::Outcome outcome = tests::run_program(
      folder.path(), {"stream", "tiny.toml", "--quiet", "--json"}, {},
      [&](pid_t process) {
        char first = 0;  // the program has begun to write, however slow it is
        CHECK(read(reader, &first, 1) == 1);
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        kill(process, SIGTERM);
      },
      folder / "lines", folder / "in");
  CHECK(outcome.code == 128 + SIGTERM);
  CHECK(outcome.err == "ensonify: stopped on request\n");
  close(reader);
}

TEST_CASE("a signal ends a stream whose reader stops in the middle of a long answer") {
  const StreamFolder folder;
  tests::write_text(folder / "in", pose);
  REQUIRE(mkfifo((folder / "lines").c_str(), 0600) == 0);
  const int reader = open((folder / "lines").c_str(), O_RDWR);
  std::chrono::steady_clock::time_point killed;
  const tests::Outcome outcome = tests::run_program(
      folder.path(),
      {"stream", "tiny.toml", "--quiet", "-D", "sonar.left-right.bins=20000", "--layers",
       "intensity,intensity_mean,region,range_m"},
      {},
      [&](pid_t process) {
        std::vector<char> some(1000);  // the reader takes the beginning of the answer
        CHECK(read(reader, some.data(), some.size()) > 0);
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        kill(process, SIGTERM);
        killed = std::chrono::steady_clock::now();
      },
      folder / "lines", folder / "in");
  CHECK(std::chrono::steady_clock::now() - killed < std::chrono::seconds(10));
  CHECK(outcome.code == 128 + SIGTERM);
  CHECK(outcome.err == "ensonify: stopped on request\n");
  close(reader);
}

TEST_CASE("a stream takes the names of layers with - or _ and answers with _") {
  const StreamFolder folder;
  const tests::Outcome lines = folder.stream(pose, {"--layers", "shadow-instance"});
  CHECK(lines.code == 0);
  CHECK(lines.out.find("\"shadow_instance\"") != std::string::npos);
  CHECK(lines.out == folder.stream(pose, {"--layers", "shadow_instance"}).out);
}

TEST_CASE("a stream ends at the end of its input, and at a signal, also one before it waits") {
  const StreamFolder folder;
  CHECK(folder.stream("").code == 0);
  CHECK(folder.stream(pose.substr(0, pose.size() - 1)).code == 0);
  REQUIRE(mkfifo((folder / "poses").c_str(), 0600) == 0);
  const int keeps_it_open = open((folder / "poses").c_str(), O_RDWR);
  const auto ended_after = [&](int wait_ms) {
    return tests::run_program(
               folder.path(), {"stream", "tiny.toml", "--quiet"}, {},
               [&](pid_t process) {
                 std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
                 kill(process, SIGTERM);
               },
               {}, folder / "poses")
        .code;
  };
  CHECK(ended_after(1500) == 128 + SIGTERM);
  // While it prepares; or before it watches for signals, which then end it.
  for (int wait_ms = 5; wait_ms < 400; wait_ms += 20) {
    const int code = ended_after(wait_ms);
    CHECK((code == 128 + SIGTERM || code == -SIGTERM));
  }
  close(keeps_it_open);
}
