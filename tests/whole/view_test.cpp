#include <algorithm>
#include <chrono>
#include <thread>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/tiny_scene.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

/// A number of four bytes in a PNG's header.
std::size_t number_at(const std::string& png, std::size_t offset) {
  std::size_t number = 0;
  for (std::size_t i = 0; i < 4; ++i)
    number = 256 * number + static_cast<unsigned char>(png.at(offset + i));
  return number;
}

struct ViewFolder : TemporaryFolder {
  ViewFolder() { write_text(*this / "tiny.toml", tiny_scene); }
  Outcome view(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"view", "tiny.toml"});
    return run_program(path(), arguments);
  }
  std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(path()), fs::directory_iterator());
  }
};

}  // namespace

TEST_CASE("view draws a ping of a scene, by default the middle one") {
  const ViewFolder folder;
  const Outcome outcome = folder.view({"-o", "a.png", "--width-px", "160"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.out.empty());
  CHECK(outcome.err.empty());
  const std::string png = read_text(folder / "a.png");
  REQUIRE(png.starts_with("\x89PNG"));
  CHECK(number_at(png, 16) == 160);
  CHECK(number_at(png, 20) == 90);
  for (const auto& [ping, same] : {std::pair{"4", true}, std::pair{"8", false}}) {
    REQUIRE(folder.view({"-o", "b.png", "--width-px", "160", "--ping", ping}).code == 0);
    CHECK((read_text(folder / "b.png") == png) == same);
  }
}

TEST_CASE(
    "view refuses a ping that does not exist and a file that is not PNG or cannot be written") {
  const ViewFolder folder;
  const auto check = [&](const std::vector<std::string>& arguments, int code, const char* message) {
    const Outcome outcome = folder.view(arguments);
    CAPTURE(arguments, outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.out.empty());
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(std::ranges::count(outcome.err, '\n') == 1);
    CHECK(folder.files() == 1);
  };
  check({"-o", "a.png", "--ping", "9"}, 2, "--ping 9: the track has 9 pings; expected 0 to 8");
  check({"-o", "a.png", "--ping", "-1"}, 2, "--ping");
  check({"-o", "a.jpg"}, 2, "a.jpg");
  check({}, 2, "--output");
  check({"-o", "a.png", "--width-px", "0"}, 2, "--width-px");
  // The place is checked first, not after the drawing.
  check({"-o", "none/a.png", "--ping", "9"}, 1, "none/a.png");
}

TEST_CASE("view stops at a signal and leaves nothing behind") {
  const ViewFolder folder;
  const Outcome stopped =
      run_program(folder.path(), {"view", "tiny.toml", "-o", "a.png", "--width-px", "16384"}, {},
                  [](pid_t process) {
                    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
                    kill(process, SIGINT);
                  });
  CHECK(stopped.code == 130);
  CHECK(stopped.err.find("stopped on request") != std::string::npos);
  CHECK(folder.files() == 1);
}
