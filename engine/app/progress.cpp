#include "progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

constexpr std::size_t widest_bar = 30, narrowest_bar = 5;
constexpr std::string_view clear_line = "\r\x1b[K";

bool on_terminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) && term && std::string_view(term) != "dumb";
}

}  // namespace

Progress::Progress(bool quiet)
    : way_(quiet           ? Way::none
           : on_terminal() ? Way::bar
                           : Way::lines),
      shown_(Clock::now()) {}

Progress::~Progress() {
  if (way_ == Way::bar) write_note(clear_line);
}

void Progress::report(std::string_view stage, std::size_t done, std::size_t of,
                      std::string_view found) {
  using namespace std::chrono_literals;
  if (way_ == Way::none) return;
  const Clock::time_point now = Clock::now();
  const bool new_stage = stage != stage_;
  if (new_stage) {
    stage_ = stage;
    stage_began_ = now;
  }
  if (now - shown_ < (way_ == Way::lines ? 10s : new_stage || done == of ? 0ms : 100ms)) return;
  shown_ = now;
  if (!can_write_now(STDERR_FILENO)) return;  // do not wait for the reader of a mere progress line

  const double elapsed_s = std::chrono::duration<double>(now - stage_began_).count();
  std::string more;
  if (done > 0 && elapsed_s > 0.0) {
    const double per_s = static_cast<double>(done) / elapsed_s;
    more = fmt::format(", {:.3g}/s, {:.0f} s left", per_s, static_cast<double>(of - done) / per_s);
  }
  if (!found.empty()) more += fmt::format("; {}", found);
  if (way_ == Way::lines) {
    print_note("{} {}/{}{}\n", stage, done, of, more);
  } else {
    const std::string text = fmt::format(" {} {}/{}{}", stage, done, of, more);
    // One column stays free, because some terminals wrap after writing the last one.
    const std::size_t columns = terminal_columns(STDERR_FILENO) - 1;
    const std::size_t room = columns > text.size() + 2 ? columns - text.size() - 2 : 0;
    const std::size_t bar = room < narrowest_bar ? 0 : std::min(widest_bar, room);
    const std::size_t filled = of > 0 ? bar * done / of : 0;
    std::string line = bar > 0 ? fmt::format("[{:#>{}}{:.>{}}]", "", filled, "", bar - filled) : "";
    line += text.substr(bar > 0 ? 0 : 1);
    write_note(clear_line);
    print_note("{}", line.substr(0, columns));
    std::fflush(stderr);
  }
}

}  // namespace ensonify::engine::app
