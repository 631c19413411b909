#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// The heights in metres of a heavy line that lies on a profile of the ground. The line is the
/// lowest curve that is nowhere below the ground and nowhere bends upwards with a radius smaller
/// than sag_radius_m. Between supports it is the parabola z'' = 1 / sag_radius_m of a string whose
/// tension is sag_radius_m times its weight per metre in water. A span of length s sags by s^2 / (8
/// sag_radius_m). With u = z - along_m^2 / (2 sag_radius_m), the curve is the upper convex hull of
/// the ground's u, so no iteration is needed. `along_m` must ascend and be as long as `ground_m`.
std::vector<double> hang(std::span<const double> along_m, std::span<const double> ground_m,
                         double sag_radius_m);

/// The middle line of a tube that is laid along a path over the ground. The line has the path's
/// corners and points between them, at most step_m apart. `ground_m(place)` is the height of the
/// bed on which the tube's round underside rests. The line is then raised by lift_m. Throws
/// std::invalid_argument if the path has no length, and what ground_m throws.
std::vector<Eigen::Vector3d> laid_line(
    std::span<const Eigen::Vector2d> path, double diameter_m, double step_m, double sag_radius_m,
    double lift_m, const std::function<double(const Eigen::Vector2d&)>& ground_m);

/// Reads the path of a line, two points or more, from a CsvTable with the columns east_m and
/// north_m. Throws SceneError.
std::vector<Eigen::Vector2d> read_path(const std::filesystem::path& file);

}  // namespace ensonify::engine
