#pragma once

#include <cstdint>

namespace ensonify::engine {

// The layout of the tables of the beam (beam.h) and of rays (ray_layout.h). They are here because
// echo_kernel.cpp also reads the tables, and may include only plain constants and structs.

/// The rows of ArrayTable are at equal steps of F / (F + 2): in F, steps of 0.008 in the far field,
/// and of a few percent in the near field. Its columns are at equal steps of x, from 0 to F +
/// reach.
inline constexpr std::int32_t array_rows = 256;
inline constexpr double array_middle_nearness = 2.0;

/// Number of values of VerticalTable over a full turn, at equal steps of the diamond angle. One
/// more value closes the turn.
inline constexpr std::int32_t vertical_directions = 8192;

/// Where the beam is sampled across a fan's plane.
struct BeamSample {
  float sin_azimuth;
  float width_rad;  ///< the azimuth that the sample stands for
};

/// The direction of an elevation in a fan's plane.
struct RayDirection {
  double cosine, sine;
};

}  // namespace ensonify::engine
