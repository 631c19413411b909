#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/sonar/echo/beam_tables.h>

namespace ensonify::engine {

// The inner loops of an echo, compiled once for each kind of vector register. They take plain
// arrays, because they must share no inline function with the rest of the program. All targets do
// the same operations on each number, also the same fused operations, so the results are the same
// to the last bit.
//
// A piece is a few neighbouring rays of one plane of a fan that hit one face. Pieces come as
// columns, one value per piece. The names that end in `_rad` and `_m` are in radians and metres.

/// Columns of pieces have room for this many values behind the last piece: one vector register.
inline constexpr std::size_t lane_padding = 16;

/// What pieces are, in the order of their rays. The values in the padding repeat the last piece.
struct PieceGeometry {
  std::size_t count;
  const std::uint32_t *begin, *end;  ///< rays [begin, end) of the plane, by elevation
  const std::uint32_t* index;        ///< of the face, as in Hit
  /// The plane of the face, as in FanRuns: a ray of elevation e meets it at the range
  /// distance / (level cos e + pole sin e).
  const double *level, *pole, *distance;
  const std::int32_t* strengths_from;  ///< where the face's material begins in `strengths`
};

/// The elevations of a fan's rays, as in RayLayout.
struct RayAngles {
  const double* edge_rad;          ///< halfway from each elevation to the elevation before
  const RayDirection* directions;  ///< of each elevation (2 j), and halfway to the next (2 j + 1)
};

/// A vector in a plane of a fan: its component along a ray of elevation e is cos(e) level + sin(e)
/// pole. `drift` is its part along ReceiverMotion::drift.
struct AlongPlane {
  float level, pole, drift;
};

/// The two-way beam over one plane: the arguments of Beam::two_way as plain tables.
struct PlaneBeam {
  const BeamSample* samples;  ///< across the plane
  std::size_t sample_count;
  float sin_azimuth;  ///< of the plane
  /// The horizontal pattern: ArrayTable's values, and what turns an array's angle into its columns.
  struct Array {
    const float* power;
    std::int32_t columns;  ///< of one row, with two values each
    float reach;
    float nearness_m, x_per_sine, offset_m;  ///< as in Beam::Array
    std::size_t zone_count;                  ///< of zones_per_m, that it is focused in
  } transmit, receive;
  bool same_arrays;          ///< transmit and receive
  bool focused;              ///< nearness is 0: only the table's first row counts
  const float* zones_per_m;  ///< as Beam::zones_per_m()
  const float* vertical;     ///< VerticalTable's values
  // How the receiver moves, as in ReceiverMotion.
  bool steady;
  AlongPlane abeam, down, array_turn, abeam_turn, down_turn;
  float drift_along;
};

/// What the echoes of one plane's pieces are computed from.
struct PieceKernelArgs {
  PieceGeometry pieces;
  RayAngles rays;
  std::array<double, 3> direction;       ///< of elevation 0 of the plane, unit
  std::array<double, 3> pole_direction;  ///< unit
  double range_m;                        ///< of the fan
  double bin_m;
  PlaneBeam beam;
  const float* strengths;  ///< scatter::BackscatterTable::values of all materials, in a row
};

/// The echoes of pieces: columns that compute_echoes() fills.
struct PieceEchoes {
  /// 1 where sound comes back, 0 where the rays see the back of a face, or nearly its edge.
  std::int32_t* answers;
  double* range_m;    ///< at the middle of the piece
  double* to_last_m;  ///< how much the range grows from the middle to the last ray
  double* to_end_m;   ///< how much it grows from the middle to the end of the piece
  /// Energy of the whole piece, without absorption and source level: beam_weight * sigma /
  /// sin(grazing) / range^2 * width_rad.
  double* energy;
  /// At the middle of the piece: x, y, z from the sonar and the grazing angle, four values per
  /// piece; and how much they change from end to end.
  double *middles, *changes;
  /// The two-way beam times the solid angle per radian of elevation; 0 where no echo comes back.
  float* beam_weight;
  /// One of several beams: how far the energy's middle lies ahead of the rays, along the array.
  /// Such a beam may be so asymmetric that the rays of wide planes do not lie in the middle of
  /// their energy.
  float* aside_m;
  /// How much the energy's density over range changes from end to end, as a share of its mean.
  float* energy_slope;
  float* width_rad;     ///< the elevations that the piece stands for
  float* ray_step_rad;  ///< the part of width_rad that belongs to one ray
  /// The ranges between which a piece is laid: halfway to its neighbours' ranges. Not final for the
  /// pieces in `breaks` and for the pieces before these.
  double *from_m, *until_m;
  /// Ascending: the pieces that do not surely continue the surface of the piece before them.
  std::uint32_t* breaks;
};

/// Computes the echo of each piece; returns the number of breaks.
std::size_t compute_echoes(const PieceKernelArgs& in, const PieceEchoes& out);

/// Runs of rays on one face, as in FanRuns, and how much the range of a piece may grow from end to
/// end, as a share of itself.
struct RunLimitArgs {
  std::size_t count;
  const std::uint32_t *begin, *end;
  const double *level, *pole;
  RayAngles rays;
  double max_growth;
};

/// How many rays of each run may form one piece: so few that a straight line describes its ranges.
void limit_runs(const RunLimitArgs& in, std::uint32_t* max_rays);

/// How the echoes of a moving sonar are shifted in range: by the part of ReceiverMotion::drift
/// along a ray, times the sum of half the range and `closing_shift_m`.
struct RangeShiftArgs {
  std::size_t count;  ///< of pieces
  const std::uint32_t *begin, *end;
  RayAngles rays;
  double drift_level, drift_pole;  ///< as in AlongPlane
  double closing_shift_m;
};

/// Shifts the ranges between which pieces are laid.
void shift_ranges(const RangeShiftArgs& in, double* from_m, double* until_m);

}  // namespace ensonify::engine
