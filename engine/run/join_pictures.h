#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <ensonify/engine/run/parts.h>

namespace ensonify::engine {

/// How many pings a row of the whole run's picture shows: as few as give at most 30,000 rows, which
/// most viewers open.
std::size_t pings_per_row(std::size_t pings);

/// Joins the pictures of a run's first `finished_parts` parts to FOLDER/SONAR.png, the newest ping
/// on top. A row is the mean of pings_per_row() pings of the whole run. Takes the memory of one
/// part's picture. Throws SceneError for a damaged picture, std::system_error.
void join_pictures(const std::filesystem::path& folder, const RunParts& parts,
                   std::size_t finished_parts, const std::string& sonar);

}  // namespace ensonify::engine
