#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/parts.h>
#include <ensonify/engine/run/run_plan.h>

namespace ensonify::engine {

/// What the parts [first, end) of a run made, from their part.json; no pings if there are none. The
/// names of files begin with the part's folder. Throws SceneError as read_part_json() and
/// PartRecord::operator+=.
PartRecord sum_of_parts(const std::filesystem::path& folder, const RunParts& parts,
                        std::size_t first, std::size_t end);

/// Warnings that follow from a whole run's counts.
std::vector<std::string> warnings_of(const PartRecord& run, const std::string& intersector);

/// All counts of a run, those of its seafloor included.
std::map<std::string, std::uint64_t> counts_of(const PartRecord& run);

/// The content of a run's manifest.json. `parts` is empty for a run of one part.
std::string manifest_of(const PartRecord& run, const RunPlan& plan,
                        std::vector<ManifestPart> parts = {});

/// Writes what the whole of a run in parts has, once all parts are there: pictures, targets and the
/// manifest. Returns the run's record. `waiting` as in StagingFolder::wait_for(). Throws
/// SceneError, std::system_error.
PartRecord finish_run(const std::filesystem::path& folder, const RunPlan& plan,
                      const std::function<void()>& waiting);

}  // namespace ensonify::engine
