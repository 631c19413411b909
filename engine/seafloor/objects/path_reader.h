#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// Reads a path of at least two points from a CsvTable with the columns east_m and north_m. Throws
/// SceneError.
std::vector<Eigen::Vector2d> read_path(const std::filesystem::path& file);

}  // namespace ensonify::engine
