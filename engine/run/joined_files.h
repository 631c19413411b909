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

/// How many pings each row of the whole run's picture shows: the smallest number that gives at most
/// 30,000 rows. Most viewers open such a picture.
std::size_t pings_per_row(std::size_t pings);

/// Joins the pictures of a run's first `finished_parts` parts to FOLDER/SONAR.png, the newest ping
/// on top. A row is the mean of pings_per_row() pings of the whole run. Takes the memory of one
/// part's picture. Throws SceneError for a damaged picture, std::system_error.
void join_pictures(const std::filesystem::path& folder, const RunParts& parts,
                   std::size_t finished_parts, const std::string& sonar);

/// Joins the targets of all parts to the targets of the run, in the format of targets_json(). The
/// rows in an outline are rows of the parts' pictures, also where a row of the joined picture is
/// the mean of several of these rows. Pings are numbered as in the run. Contrast, range and ping
/// are means weighted by area. `visibility` (empty if not counted) and `sights` (by instance) are
/// of the whole run. Throws SceneError for a damaged file, std::system_error.
std::string join_targets(const std::filesystem::path& folder, const RunParts& parts,
                         const std::string& sonar, std::span<const ObjectVisibility> visibility,
                         const std::map<std::uint32_t, TargetSights>& sights);

/// The sum of the records (part.json) of the parts [first, end) of a run; 0 pings if there are
/// none. The names of the files begin with the folder of their part. Throws SceneError as
/// read_part_json() and PartRecord::operator+=.
PartRecord sum_of_parts(const std::filesystem::path& folder, const RunParts& parts,
                        std::size_t first, std::size_t end);

/// Writes the pictures, targets and manifest of a whole run in parts, whose parts must all be
/// there. Returns the run's record. `waiting` is as in StagingFolder::wait_for(). Throws
/// SceneError, std::system_error.
PartRecord finish_run(const std::filesystem::path& folder, const RunPlan& plan,
                      const std::function<void()>& waiting);

}  // namespace ensonify::engine
