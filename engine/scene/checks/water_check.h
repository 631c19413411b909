#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

namespace ensonify::engine {

/// How far a position is out of the water, as a text such as "2.0 m below the bed"; none if it is
/// in the water. If there is no bed (its height is NaN), no position is below it.
std::optional<std::string> out_of_water(const Eigen::Vector3d& place, double bed_height_m);

/// Why a velocity is too fast for a sonar, as a text: "2000 m/s, expected less than the speed of
/// sound, 1500 m/s"; none if it is slower than sound.
std::optional<std::string> as_fast_as_sound(const Eigen::Vector3d& velocity_mps,
                                            double sound_speed_mps);

}  // namespace ensonify::engine
