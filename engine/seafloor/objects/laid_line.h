#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// A heavy line over a profile of the ground: the lowest curve that is nowhere below it and nowhere
/// bends upwards tighter than the radius. Between supports it is the parabola z'' = 1 /
/// sag_radius_m of a string whose tension is sag_radius_m times its weight a metre in water; a span
/// of length s sags by s^2 / (8 sag_radius_m). With u = z - s^2 / (2 sag_radius_m) that is the
/// upper convex hull of the ground's u: no iteration. `along_m` ascends.
std::vector<double> hang(std::span<const double> along_m, std::span<const double> ground_m,
                         double sag_radius_m);

/// The middle line of a tube that is laid along a path over the ground. The path's corners are
/// kept, and points no farther apart than step_m put between them; `ground_m(place)` is the bed's
/// height, and the tube's round underside is held against it. The line is then raised by lift_m.
/// Throws std::invalid_argument if the path has no length, and lets through what ground_m throws.
std::vector<Eigen::Vector3d> laid_line(
    std::span<const Eigen::Vector2d> path, double diameter_m, double step_m, double sag_radius_m,
    double lift_m, const std::function<double(const Eigen::Vector2d&)>& ground_m);

}  // namespace ensonify::engine
