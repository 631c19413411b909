#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/sonar/beam_tables.h>

namespace ensonify::engine {

/// Arrays of the kernel are longer by so much.
inline constexpr std::size_t echo_room = 16;

/// What a vector has of a ray's direction, and of what a receiver drifts while the echo comes back: the
/// ray of elevation e has cos(e) level + sin(e) pole of it, less the drift.
struct AlongPlane {
  float level, pole, drift;
};

/// What the echo of one plane of a fan is computed from, and the result, as plain arrays: the loop is
/// compiled once for each kind of vector register, and must share no inline function with the rest of the
/// program. All do the same operations on each number, fused ones included: the results are the same to the
/// last bit.
///
/// A piece is a few neighbouring rays that hit one face, told by its plane as in FanRuns.
struct EchoPlane {
  // Of each piece:
  const std::uint32_t *begin, *end;  ///< elevations [begin, end)
  const double *level, *pole, *distance;
  const std::int32_t* strengths_from;  ///< where its bottom's begin in `strengths`
  std::size_t pieces;
  // Of the elevations: the angles between neighbours, and sine and cosine of each (2 j) and of those between
  // (2 j + 1).
  const double *edge_rad, *cosines, *sines;
  std::array<double, 3> direction, pole_direction;  ///< of elevation 0, and along the pole
  double range_m;
  // The beam: BeamSamples across the plane, ...
  const BeamSample* samples;
  std::size_t sample_count;
  const float* array_power;  ///< ArrayTable's, with so many columns a row
  std::int32_t columns;
  float reach;
  struct Array {
    float nearness_m, x_per_sine;
  } transmit, receive;
  bool alike;  ///< the two
  bool far;    ///< focused: nearness is 0
  // ... the vertical pattern, VerticalTable's, and how the receiver moves.
  const float* vertical;
  bool still;
  AlongPlane abeam, down, array_turn, abeam_turn, down_turn;  ///< as in Reception
  float drift_along;
  const float* strengths;  ///< scatter::BackscatterTable's, one after another

  // Out, of each piece, four in a row:
  // range at its middle, how much it grows from there to its last ray and to its end, and its energy;
  double* ranges;
  // what its middle saw: x, y, z from the sonar and the grazing angle, which is negative where nothing answers;
  double* middles;
  // and how that changes from the one end to the other.
  double* changes;
  float* weight;     ///< the two-way beam times the solid angle per radian of elevation
  float* slant;      ///< by what share its energy's density over range changes from end to end
  float* width_rad;  ///< the elevation it stands for
};

/// Energy is per bin width of one, without absorption and source level: weight * strength / sine / range^2
/// times the elevation that the piece stands for.
void shade_pieces(const EchoPlane& plane);

}  // namespace ensonify::engine
