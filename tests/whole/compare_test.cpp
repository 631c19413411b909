// `ensonify compare`, and a run's recording read back.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/small_recording.h"

#include <ensonify/engine/output/xtf.h>

using namespace ensonify;
using namespace ensonify::tests;

namespace {

const std::string compared_scene = R"(version = 1
[seafloor]
extent_east_m = 80
extent_north_m = 60
cell_m = 0.5
[track]
pings = 120
[sonar.left-right]
range_m = 30
bins = 300
elevations = 512
[output]
xtf = true
jsf = true
)";

}  // namespace

TEST_CASE("SIGTERM ends a comparison with a message, and nothing is left behind") {
  const TemporaryFolder folder;
  const engine::Recording recording = small_recording(64);
  write_text(folder / "a.xtf", as_text(engine::encode_xtf({&recording, 1})));
  // It waits for a reader of its output, so that it is still there.
  REQUIRE(mkfifo((folder / "output").c_str(), 0600) == 0);
  const int full_pipe = open((folder / "output").c_str(), O_RDWR | O_NONBLOCK);
  const std::string full(4096, 'x');
  while (write(full_pipe, full.data(), full.size()) > 0) {
  }
  const auto catches_it = [](pid_t process) {
    const std::string status = read_text("/proc/" + std::to_string(process) + "/status");
    const std::size_t at = status.find("SigCgt:");
    return at != std::string::npos &&
           (std::stoull(status.substr(at + 7), nullptr, 16) >> (SIGTERM - 1) & 1) != 0;
  };
  const Outcome outcome = run_program(
      folder.path(), {"compare", "a.xtf", "a.xtf"}, {},
      [&](pid_t process) {
        for (int tries = 0; tries < 200 && !catches_it(process); ++tries)
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
        kill(process, SIGTERM);
      },
      folder / "output");
  close(full_pipe);
  CHECK(outcome.code == 128 + SIGTERM);
  CHECK_THAT(outcome.err, Catch::Contains("ensonify: stopped on request"));
  CHECK(names_in(folder.path()) == std::set<std::string>{"a.xtf", "output"});
}

TEST_CASE("a folder without a run and without pictures is refused by both names") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "empty");
  const Outcome outcome = run_program(folder.path(), {"compare", "empty", "empty"});
  CHECK(outcome.code == 2);
  CHECK_THAT(outcome.err,
             Catch::StartsWith("ensonify: empty: has neither the manifest.json of a run "
                               "nor pictures"));
}

TEST_CASE("a run and its recordings have the same statistics") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  for (const std::string file : {"a/left-right.xtf", "a/left-right.jsf"}) {
    const Outcome same = run_program(
        folder.path(), {"compare", "a", file, "--json", "--limit", "0.001", "--html", "page.html"});
    CAPTURE(file, same.err);
    CHECK(same.code == 0);
    const nlohmann::json statistics = nlohmann::json::parse(same.out)["statistics"];
    CHECK(statistics.size() > 50);
    CHECK(statistics["contrast_at_20_to_40_deg"]["a"].is_number());
    for (const auto& [name, one] : statistics.items()) {
      CAPTURE(name);
      // JSF has the time between samples in whole nanoseconds.
      if (one["a"].is_number())
        CHECK(one["b"].get<double>() == Approx(one["a"].get<double>()).epsilon(1e-5));
      else
        CHECK(one["b"].is_null());
    }
  }
  CHECK(read_text(folder / "page.html").find("data:image/png;base64,iVBOR") != std::string::npos);
}

TEST_CASE("a run without EXR is compared by its recordings, in one part or in several") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  const auto expect_same = [&](const std::string& run, const std::vector<std::string>& options,
                               const std::vector<std::string>& choice = {}) {
    std::vector<std::string> arguments{"run", "s.toml",          "-o", run, "--quiet",
                                       "-D",  "output.exr=false"};
    for (const std::string& option : options) {
      arguments.emplace_back("-D");
      arguments.push_back(option);
    }
    REQUIRE(run_program(folder.path(), arguments).code == 0);
    std::vector<std::string> compare{"compare", "a", run, "--limit", "0.001"};
    compare.insert(compare.end(), choice.begin(), choice.end());
    const Outcome same = run_program(folder.path(), compare);
    CAPTURE(run, same.err);
    CHECK(same.code == 0);
  };
  expect_same("xtf", {"output.jsf=false"});
  expect_same("jsf", {"output.xtf=false"}, {"--sonar-b", "left-right"});
  expect_same("parts", {"output.pings_per_file=50"});
  expect_same("common", {"output.one_recording=true"});
  const Outcome none = run_program(
      folder.path(), {"run", "s.toml", "-o", "none", "--quiet", "-D", "output.exr=false", "-D",
                      "output.xtf=false", "-D", "output.jsf=false"});
  REQUIRE(none.code == 0);
  const Outcome refused = run_program(folder.path(), {"compare", "a", "none"});
  CHECK(refused.code == 2);
  CHECK_THAT(refused.err,
             Catch::Contains("none: the run has no OpenEXR images; run its scene again "
                             "with output.exr = true"));
  const Outcome other = run_program(folder.path(), {"compare", "a", "xtf", "--sonar-b", "right"});
  CHECK(other.code == 2);
  CHECK_THAT(other.err, Catch::Contains("there is no sonar 'right'"));
}

TEST_CASE("a sonar of one side has the statistics of its recordings") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene);
  for (const std::string side : {"port", "starboard"}) {
    REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", side, "--quiet", "-D",
                                        "sonar.left-right.sides=\"" + side + "\""})
                .code == 0);
    for (const std::string format : {".xtf", ".jsf"}) {
      const std::string file = side + "/left-right" + format;
      const Outcome same = run_program(folder.path(), {"compare", side, file, "--limit", "0.001"});
      CAPTURE(file, same.err);
      CHECK(same.code == 0);
      CHECK((same.err.find("is 0 in every sample; left out") != std::string::npos) ==
            (format == ".xtf"));
      const Outcome info = run_program(folder.path(), {"recording-info", file, "--json"});
      REQUIRE(info.code == 0);
      CHECK(nlohmann::json::parse(info.out).dump().find("\"sides\":\"" + side + "\"") !=
            std::string::npos);
    }
  }
}

TEST_CASE("recording-info has the warnings of all lines, each once") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene +
                                    "one_recording = true\n[sonar.low]\nfrequency_hz = 100e3\n"
                                    "range_m = 30\nbins = 300\nelevations = 512\n");
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  const std::string jsf = read_text(folder / "a/recording.jsf");
  // The clock of these subsystems is set back by 100 s in the middle.
  const auto warnings = [&](const std::vector<int>& subsystems) {
    std::string bytes = jsf;
    for (std::size_t at = 0; at < bytes.size();) {
      std::int32_t size = 0, time_s = 0, ping = 0;
      std::memcpy(&size, &bytes[at + 12], sizeof size);
      std::memcpy(&time_s, &bytes[at + 16], sizeof time_s);
      std::memcpy(&ping, &bytes[at + 24], sizeof ping);
      if (ping >= 60 && std::ranges::count(subsystems, bytes[at + 7]) > 0) {
        time_s -= 100;
        std::memcpy(&bytes[at + 16], &time_s, sizeof time_s);
      }
      at += 16 + static_cast<std::size_t>(size);
    }
    write_text(folder / "r.jsf", bytes);
    const Outcome info = run_program(folder.path(), {"recording-info", "r.jsf"});
    REQUIRE(info.code == 0);
    std::size_t found = 0;
    for (std::size_t at = info.err.find("r.jsf: "); at != std::string::npos;
         at = info.err.find("r.jsf: ", at + 1))
      ++found;
    return found;
  };
  CHECK(warnings({}) == 0);
  CHECK(warnings({20}) == 1);
  CHECK(warnings({21}) == 1);
  CHECK(warnings({20, 21}) == 1);
}

TEST_CASE("compare ends with code 1 beyond the limit, and with 2 for what it cannot read") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "b", "--quiet", "-D",
                                      "sonar.left-right.ping_mean=0.5"})
              .code == 0);
  const Outcome beyond = run_program(folder.path(), {"compare", "a", "b", "--limit", "0.001"});
  CHECK(beyond.code == 1);
  CHECK(beyond.err.find("differ by more than 0.001 times the spread of a") != std::string::npos);
  CHECK(beyond.out.find("statistic,a,b,spread_of_a,ratio\n") == 0);
  CHECK(run_program(folder.path(), {"compare", "a", "s.toml"}).code == 2);
  CHECK(run_program(folder.path(), {"compare", "a", "nowhere"}).code == 2);
  const Outcome second =
      run_program(folder.path(), {"compare", "a", "a/left-right.xtf", "--sonar-b", "2"});
  CHECK(second.code == 2);
  CHECK(second.err.find("has one line, not a line '2': leave --sonar-a or --sonar-b out") !=
        std::string::npos);
  CHECK(run_program(folder.path(), {"compare", "a", "b", "--sonar-a", "x"}).code == 2);
}

TEST_CASE("folders of pictures are compared by their brightness") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", compared_scene);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  for (const std::string name : {"p", "q"}) {
    std::filesystem::create_directory(folder / name);
    std::filesystem::copy_file(folder / "a/left-right.png", folder / (name + "/1.png"));
  }
  const Outcome same = run_program(folder.path(), {"compare", "p", "q", "--json"});
  CAPTURE(same.err);
  REQUIRE(same.code == 0);
  const nlohmann::json statistics = nlohmann::json::parse(same.out)["statistics"];
  CHECK(statistics["contrast_at_20_to_40_deg"]["a"].get<double>() > 0.1);
  CHECK(statistics["contrast_at_20_to_40_deg"]["a"] == statistics["contrast_at_20_to_40_deg"]["b"]);
  CHECK(run_program(folder.path(), {"compare", "p", "a"}).code == 0);  // a run's own folder
  write_text(folder / "q/2.jpg", "no picture");
  const Outcome damaged = run_program(folder.path(), {"compare", "p", "q"});
  CHECK(damaged.code == 2);
  CHECK(damaged.err.find("2.jpg: cannot be read as a PNG or JPEG picture") != std::string::npos);
}
