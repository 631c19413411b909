#include <ensonify/engine/run/run_state.h>

#include <algorithm>

namespace ensonify::engine {

void RunState::report_stage(std::string_view stage, std::size_t done, std::size_t of) const {
  const std::lock_guard one_at_a_time(reported.lock);
  reported.stage = stage;
  reported.done = done;
  reported.of = of;
  report_again();
}

void RunState::stop_check() const {
  if (seconds_since(reported.at) < 0.1) return;
  const std::lock_guard one_at_a_time(reported.lock);
  report_again();
}

void RunState::report_again() const {
  reported.at = Clock::now();
  if (control.progress && !control.progress(reported.stage, reported.done, reported.of))
    throw Stopped("stopped on request; the files of this run were removed");
}

std::size_t RunState::pings_in_memory(const RunParts& parts) const {
  return std::min(parts.pings(), parts.longest() * (static_cast<std::size_t>(threads) + 1));
}

}  // namespace ensonify::engine
