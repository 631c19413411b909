#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace ensonify::engine::app {

/// Says on stderr how far a run is: a bar on a terminal, elsewhere a line every 10 seconds. It has
/// no colours, so NO_COLOR has nothing to forbid.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();  // takes the bar away
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `found` is what is known so far, said behind how far it is.
  void tell(std::string_view stage, std::size_t done, std::size_t of, std::string_view found = {});

 private:
  using Clock = std::chrono::steady_clock;
  enum class Way { none, bar, lines } way_;
  std::string stage_;
  Clock::time_point stage_began_;
  Clock::time_point shown_;
};

}  // namespace ensonify::engine::app
