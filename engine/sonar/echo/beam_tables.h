#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

// How the beam's tables (beam.h) are laid out, for the kernel that reads them as well; it takes no
// header that has more in it.

/// ArrayTable's rows are even in F / (F + 2): 0.008 apart in F where the beam is far, a few percent
/// of F near by. Its columns are even in x, from 0 to F + its reach.
inline constexpr std::int32_t array_rows = 256;
inline constexpr double array_middle_nearness = 2.0;

/// VerticalTable's values, even in the diamond angle, and one more behind.
inline constexpr std::int32_t vertical_directions = 8192;  // a turn

/// Part of a fan's plane, where the beam is sampled.
struct BeamSample {
  float sin_azimuth;
  float width_rad;  ///< the azimuth it stands for
};

}  // namespace ensonify::engine
