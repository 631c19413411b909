#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <ensonify/engine/run/parts.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// Joins the targets of all parts to those of the run, as targets_json() has them: outlines in rows
/// of one ping, pings numbered as in the run, contrast, range and aspect as means weighted by area.
/// `visibility` is of the whole run; empty where it was not counted. Throws SceneError for
/// a damaged file, std::system_error.
std::string join_targets(const std::filesystem::path& folder, const RunParts& parts,
                         const std::string& sonar, std::span<const ObjectVisibility> visibility);

}  // namespace ensonify::engine
