#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

namespace ensonify::engine {

/// How far a position is out of the water, such as "2.0 m below the bed"; none for one in the
/// water. Without a bed (a height of NaN) nothing is below it.
std::optional<std::string> out_of_water(const Eigen::Vector3d& place, double bed_height_m);

}  // namespace ensonify::engine
