#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <ensonify/engine/base/clock.h>

#include "app.h"

namespace ensonify::engine::app {

/// Shows progress on stderr: on a terminal as a bar, elsewhere as one line every 10 seconds. There
/// are no colours, so that NO_COLOR has no effect.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();  ///< removes the bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows that `done` of `of` steps of a stage are done. `found` is a text that follows.
  void report(std::string_view stage, std::size_t done, std::size_t of,
              std::string_view found = {});

 private:
  enum class Way { none, bar, lines } way_;
  std::string stage_;
  Clock::time_point stage_began_;
  Clock::time_point shown_;
};

/// Returns work(progress). progress(stage, done, of) shows it, and returns false after a signal.
template <class Work>
auto watched(bool quiet, const Work& work) {
  const SignalWatch signals;
  Progress progress(quiet);
  return work([&](std::string_view stage, std::size_t done, std::size_t of) {
    progress.report(stage, done, of);
    return SignalWatch::caught() == 0;
  });
}

}  // namespace ensonify::engine::app
