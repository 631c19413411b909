#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>

#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/run_plan.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// How many pings a row of the whole run's picture shows: as few as give at most 30,000 rows, which
/// most viewers open.
std::size_t pings_per_row(std::size_t pings);

/// Joins the pictures of a run's first `finished_parts` parts to FOLDER/SONAR.png, the newest ping
/// on top. A row is the mean of pings_per_row() pings of the whole run. Takes the memory of one
/// part's picture. Throws SceneError for a damaged picture, std::system_error.
void join_pictures(const std::filesystem::path& folder, const RunParts& parts,
                   std::size_t finished_parts, const std::string& sonar);

/// Joins the targets of all parts to those of the run, as targets_json() has them: outlines in rows
/// of one ping, pings numbered as in the run, contrast, range and ping as means weighted by area.
/// `visibility` and `sights`, by instance, are of the whole run; `visibility` is empty where it was
/// not counted. Throws SceneError for a damaged file, std::system_error.
std::string join_targets(const std::filesystem::path& folder, const RunParts& parts,
                         const std::string& sonar, std::span<const ObjectVisibility> visibility,
                         const std::map<std::uint32_t, TargetSights>& sights);

/// What the parts [first, end) of a run made, from their part.json; no pings if there are none. The
/// names of files begin with the part's folder. Throws SceneError as read_part_json() and
/// PartRecord::operator+=.
PartRecord sum_of_parts(const std::filesystem::path& folder, const RunParts& parts,
                        std::size_t first, std::size_t end);

/// Writes what the whole of a run in parts has, once all parts are there: pictures, targets and the
/// manifest. Returns the run's record. `waiting` as in StagingFolder::wait_for(). Throws
/// SceneError, std::system_error.
PartRecord finish_run(const std::filesystem::path& folder, const RunPlan& plan,
                      const std::function<void()>& waiting);

}  // namespace ensonify::engine
