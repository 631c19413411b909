#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>

#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/parts.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// Joins the targets of all parts to those of the run, as targets_json() has them: outlines in rows
/// of one ping, pings numbered as in the run, contrast, range and ping as means weighted by area.
/// `visibility` and `sights`, by instance, are of the whole run; `visibility` is empty where it was
/// not counted. Throws SceneError for a damaged file, std::system_error.
std::string join_targets(const std::filesystem::path& folder, const RunParts& parts,
                         const std::string& sonar, std::span<const ObjectVisibility> visibility,
                         const std::map<std::uint32_t, TargetSights>& sights);

}  // namespace ensonify::engine
