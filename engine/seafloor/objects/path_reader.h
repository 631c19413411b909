#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// Reads a path from CSV: a header row `east_m,north_m`, then at least two points, one per row.
/// Blank lines and lines that begin with # are ignored. At most 4 MiB. Throws refine::MeshError
/// with `file:line: what is wrong, what was expected`.
std::vector<Eigen::Vector2d> read_path(const std::filesystem::path& file);

}  // namespace ensonify::engine
