#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/sonar/echo/beam_tables.h>

namespace ensonify::engine {

/// Arrays of the kernel are longer by so much.
inline constexpr std::size_t lane_padding = 16;

/// What a vector has of a ray's direction, and of what a receiver drifts while the echo comes back:
/// the ray of elevation e has cos(e) level + sin(e) pole of it, less the drift.
struct AlongPlane {
  float level, pole, drift;
};

/// What the echo of one plane of a fan is computed from, and the result, as plain arrays: the loop
/// is compiled once for each kind of vector register, and must share no inline function with the
/// rest of the program. All do the same operations on each number, fused ones included: the results
/// are the same to the last bit.
///
/// A piece is a few neighbouring rays that hit one face, told by its plane as in FanRuns.
struct PieceKernelArgs {
  // Of each piece:
  const std::uint32_t *begin, *end;  ///< elevations [begin, end)
  const std::uint32_t* index;        ///< of the face
  const double *level, *pole, *distance;
  const std::int32_t* strengths_from;  ///< where its bottom's begin in `strengths`
  std::size_t pieces;
  // Of the elevations: the angles between neighbours, and sine and cosine of each (2 j) and of
  // those between (2 j + 1).
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

  double bin_m;

  // Out, of each piece:
  double *range_m_of, *energy;  ///< at its middle; energy of all of it
  double *to_last_m,
      *to_end_m;    ///< how much range grows from the middle to the last ray, and to the end
  double* middles;  ///< four a piece: x, y, z from the sonar and the grazing angle of what the
                    ///< middle saw,
  double* changes;  ///< and how they change from end to end
  float* weight;    ///< the two-way beam times the solid angle per radian of elevation; negative
                  ///< where nothing answers
  float* slant;      ///< by what share its energy's density over range changes from end to end
  float* width_rad;  ///< the elevation it stands for, and
  float* step_rad;   ///< a ray's share of that
  double *from_m, *until_m;  ///< its ends, halfway to those of its neighbours

  /// Pieces that do not surely go on from the one before on one surface, which has from_m and
  /// until_m to do.
  std::uint32_t* breaks;
  std::size_t break_count;
};

/// How many rays of a run count as one piece: so many that its range grows no more from end to end
/// than a straight line can tell.
struct RunLimits {
  // Of each run, as in FanRuns, and of the elevations, as above:
  const std::uint32_t *begin, *end;
  const double *level, *pole;
  std::size_t runs;
  const double *edge_rad, *cosines, *sines;
  double max_growth;    ///< as a share of the range
  std::uint32_t* most;  ///< out
};
void limit_runs(const RunLimits& limits);

/// Energy is per bin width of one, without absorption and source level: weight * strength / sine /
/// range^2 times the elevation that the piece stands for. Fills all that is put out.
void shade_pieces(PieceKernelArgs& plane);

/// A range bin while planes are laid into it.
struct alignas(64) EchoBin {  // one cache line
  static constexpr int branch_bits = 16;
  static constexpr std::int32_t nobody = -1;

  std::array<double, 4> seen{};  ///< middles times energy
  double energy = 0.0;
  float lit = 0.0f, shadowed = 0.0f;  ///< beam weights of the planes that see it, or jump over it
  float darkest = 0.0f;               ///< the largest weight that shadowed it
  std::uint32_t visit = 0;            ///< the last plane that came here, and which of its branches
  std::int32_t label = nobody;        ///< of what came first
  std::uint16_t blocker = 0;          ///< label of the one that was darkest
  std::uint16_t shadow_plane = 0;     ///< the last that jumped over it
};

/// Energy in a bin of another label than its first.
struct OtherShare {
  double energy;
  std::uint32_t bin;
  std::uint16_t label;
};

/// Where pieces are laid, and where their branch of a plane's profile of ranges over elevation
/// began.
struct EchoBins {
  EchoBin* bins;
  std::uint8_t* layover;
  std::size_t count;
  double bin_m;
  std::uint32_t visit;
  bool farther;         ///< the branch runs
  std::size_t turning;  ///< bin
  OtherShare* others;
  std::size_t other_count, other_room;
};

/// Lays pieces from a number on between their ends, those that answer. broken: pieces that another
/// surface begins with. Returns the first that was not laid, because there may not be room for its
/// shares.
std::size_t lay_pieces(const PieceKernelArgs& plane, const std::uint16_t* labels,
                       const std::uint8_t* broken, EchoBins& bins, std::size_t from);

}  // namespace ensonify::engine
