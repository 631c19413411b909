#include <csignal>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/little_memory.h"
#include "support/meshes.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tiny_scene.h"

#include <ensonify/refine/mesh_reader.h>

using namespace ensonify::tests;

namespace {

// Makes the tiny scene have a million faces.
const std::vector<std::string> fine{"-D", "seafloor.cell_m=0.04", "-D", "sonar.left-right.bins=50"};

/// Runs the tiny scene with more arguments, into the folder `out`, which is removed first.
Outcome run_tiny(const TemporaryFolder& folder, std::vector<std::string> more,
                 const std::function<void(pid_t)>& meanwhile = {},
                 const std::string& scene = tiny_scene) {
  write_text(folder / "tiny.toml", scene);
  more.insert(more.begin(), {"run", "tiny.toml", "-o", "out", "--quiet"});
  std::filesystem::remove_all(folder / "out");
  return run_program(folder.path(), more, {}, meanwhile);
}

}  // namespace

#ifdef ENSONIFY_CAN_LIMIT_MEMORY  // not under sanitizers, whose own memory would count
namespace {

/// The peak memory of a process so far, without mapped files; 0: it has ended.
double max_bytes(pid_t process) {
  std::ifstream in(fmt::format("/proc/{}/status", process));
  double kib = 0.0;
  for (std::string word; in >> word;)
    if (word == "VmHWM:") in >> kib;
  return 1024.0 * kib;
}

/// Finds the peak memory of a process during its life.
auto watch(double& most) {
  return [&most](pid_t process) {
    for (double now = 1.0; now > 0.0; most = std::max(most, now)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      now = max_bytes(process);
    }
  };
}

}  // namespace

TEST_CASE("a library that ends the process by a signal does so with a message and an exit code") {
  for (const int number : {SIGABRT, SIGSEGV}) {
    CAPTURE(number);
    const TemporaryFolder folder;
    // Later than the program's beginning on any machine; the run takes minutes.
    const Outcome ended = run_tiny(folder,
                                   {"-D", "track.pings=20000", "-D", "track.speed_mps=0.0001", "-D",
                                    "sonar.left-right.elevations=32768"},
                                   [number](pid_t process) {
                                     std::this_thread::sleep_for(std::chrono::seconds(1));
                                     kill(process, number);
                                   });
    CHECK(ended.code == 1);
    CHECK(ended.err.find("stopped by a fault") != std::string::npos);
  }
}

TEST_CASE("a run is refused only if it would need more memory than allowed") {
  const std::string tree = "a seafloor of 1001 x 501 points and what is built over it";
  struct Case {
    std::string surface, intersector, what;
    std::vector<std::string> more;
  };
  for (const Case& c : {Case{"static", "embree", tree, fine},
                        {"static", "pluecker", tree, fine},
                        {"refined", "embree", tree, fine}}) {
    CAPTURE(c.surface, c.intersector);
    const TemporaryFolder folder;
    std::vector<std::string> arguments = c.more;
    arguments.insert(arguments.end(), {"--surface", c.surface, "--intersector", c.intersector});
    double most = 0.0;
    const Outcome free = run_tiny(folder, arguments, watch(most));
    CAPTURE(free.err, most);
    REQUIRE(free.code == 0);
    const auto run_within = [&](double bytes) {
      std::vector<std::string> within = arguments;
      within.insert(within.end(), {"--memory", fmt::format("{:.0f}", bytes)});
      return run_tiny(folder, within);
    };
    CHECK(run_within(most).code == 0);
    const Outcome refused = run_within(0.6 * most);
    CHECK(refused.code == 1);
    CHECK(refused.err.find(c.what) != std::string::npos);
    CHECK(refused.err.find("--memory allows") != std::string::npos);
    CHECK(refused.err.find("make seafloor.cell_m larger") != std::string::npos);
    CHECK(!std::filesystem::exists(folder / "out"));
  }
}

TEST_CASE("the meshes of objects count as memory, and each copy of them") {
  const TemporaryFolder folder;
  ensonify::refine::write_ply(folder / "wavy.ply", sheet(500, 500, [](double i, double j) {
                                return Eigen::Vector3d(i, j, 20.0 * std::sin(0.1 * (i + 2.0 * j)));
                              }));
  const std::string object = "[[objects]]\nmesh = \"wavy.ply\"\nscale = 0.002\n";
  double most = 0.0;
  const Outcome free = run_tiny(folder, {}, watch(most), tiny_scene + object);
  CAPTURE(free.err, most);
  REQUIRE(free.code == 0);
  const auto run_within = [&](double bytes, const std::string& more) {
    return run_tiny(folder, {"--memory", fmt::format("{:.0f}", bytes)}, {},
                    tiny_scene + object + more);
  };
  CHECK(run_within(most, "").code == 0);
  for (const Outcome& refused : {run_within(0.7 * most, ""), run_within(most, "count = 40\n")}) {
    CAPTURE(refused.err);
    CHECK(refused.code == 1);
    CHECK(refused.err.find("wavy.ply: the ") != std::string::npos);
    CHECK(refused.err.find("use a coarser mesh, or fewer copies") != std::string::npos);
    CHECK(!std::filesystem::exists(folder / "out"));
  }
}
#endif

TEST_CASE("rays that do not fit are refused") {
  const TemporaryFolder folder;
  const Outcome refused =
      run_tiny(folder, {"--memory", "150MB", "-D", "sonar.left-right.elevations=200000", "-D",
                        "sonar.left-right.planes=64"});
  CAPTURE(refused.err);
  CHECK(refused.code == 1);
  CHECK(refused.err.find("26 million rays of a ping") != std::string::npos);
  CHECK(refused.err.find("use fewer elevations or planes") != std::string::npos);
  CHECK(!std::filesystem::exists(folder / "out"));
}

TEST_CASE("The option --memory takes sizes with units, and no others") {
  const TemporaryFolder folder;
  CHECK(run_tiny(folder, {"--memory", "2GB"}).code == 0);
  const Outcome small = run_tiny(folder, {"--memory", "1MB"});
  CHECK(small.code == 1);
  CHECK(small.err.find("--memory allows 1 MB") != std::string::npos);
  const Outcome fraction = run_tiny(folder, {"--memory", "0.5MiB"});
  CHECK(fraction.err.find("--memory allows 1 MB") != std::string::npos);  // 524288 bytes, rounded
  for (const char* wrong : {"much", "-3GB", "0", "5parsecs", "3GBB", "GB", "inf", "nan"}) {
    CAPTURE(wrong);
    const Outcome refused = run_tiny(folder, {"--memory", wrong});
    CHECK(refused.code == 2);
    CHECK(refused.err.find("is not a size, expected for example 800MB") != std::string::npos);
  }
}
