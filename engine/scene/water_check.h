#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

namespace ensonify::engine {

/// How a place is out of the water, as "2.0 m below the bed"; nothing for one in the water. Where
/// there is no bed (a height of NaN) nothing is below it.
std::optional<std::string> out_of_water(const Eigen::Vector3d& place, double bed_height_m);

}  // namespace ensonify::engine
