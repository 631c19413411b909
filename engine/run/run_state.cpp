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
  const auto written = static_cast<std::size_t>(threads);
  const std::size_t of_parts = std::min(parts.pings(), parts.longest() * (written + 1));
  if (parts.count() == 1) return of_parts;
  return of_parts +
         std::min(parts.count(), written) * 2 * neighbour_pings(scene.display, scene.sonars);
}

}  // namespace ensonify::engine
