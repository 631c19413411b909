#include <ensonify/engine/run/run_state.h>

#include <algorithm>

namespace ensonify::engine {

void RunState::report_stage(std::string_view stage, std::size_t done, std::size_t of) const {
  if (control.progress && !control.progress(stage, done, of))
    throw Stopped("stopped on request; the files of this run were removed");
}

std::size_t RunState::pings_in_memory(const RunParts& parts) const {
  return std::min(parts.pings(), parts.longest() * (static_cast<std::size_t>(threads) + 1));
}

}  // namespace ensonify::engine
