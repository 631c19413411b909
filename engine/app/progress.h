#pragma once

#include <string>
#include <string_view>

#include <ensonify/engine/clock.h>

namespace ensonify::engine::app {

/// Shows progress on stderr: a bar on a terminal, elsewhere one line every 10 seconds. Without
/// colours, so it need not read NO_COLOR.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();  ///< removes the bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows that `done` of `of` steps of a stage are done. `found` is a text shown after that.
  void report(std::string_view stage, std::size_t done, std::size_t of,
              std::string_view found = {});

 private:
  enum class Way { none, bar, lines } way_;
  std::string stage_;
  Clock::time_point stage_began_;
  Clock::time_point shown_;
};

}  // namespace ensonify::engine::app
