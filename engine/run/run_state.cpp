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

PartRecord RunState::record_files(ScenePings& pings, const Simulator& simulator,
                                  const std::string& ending, int file_threads,
                                  const WriteFile& write) const {
  PartRecord record =
      write_files(scene, xxh128(scene_toml), world, pings, simulator, ending, file_threads, write);
  if (control.verify_pings == 0) record.verification.clear();
  record.surface = report.surface;
  record.warnings = report.extrapolation.appended_to(warnings);
  return record;
}

}  // namespace ensonify::engine
