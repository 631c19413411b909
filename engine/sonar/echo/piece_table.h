#pragma once

#include <cstddef>
#include <cstdint>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/sonar/echo/bin_kernel.h>

namespace ensonify::engine {

/// The pieces of one plane of a fan, in the order of their rays, as columns: a structure of arrays,
/// one value per piece. EchoFormer adds them, compute_echoes() fills the second group, SurfaceWalk
/// finishes the third and may add a piece where a surface leaves the range, and RangeBins lays them
/// into bins. The memory is kept from plane to plane.
struct PieceTable {
  /// What a piece is; the names as in PieceGeometry.
  struct Piece {
    std::uint32_t begin, end;
    std::uint32_t index;
    std::uint16_t label;  ///< as in FaceLabels
    std::int32_t strengths_from;
    double level, pole, distance;
  };

  std::size_t count = 0;
  CacheLines<std::uint32_t> begin, end, index;
  CacheLines<std::uint16_t> label;
  CacheLines<std::int32_t> strengths_from;
  CacheLines<double> level, pole, distance;

  // As in PieceEchoes.
  CacheLines<std::int32_t> answers;
  CacheLines<double> range_m, to_last_m, to_end_m, energy;
  CacheLines<double> middles, changes;  ///< four values per piece
  CacheLines<float> beam_weight, aside_m, energy_slope, width_rad, ray_step_rad;

  CacheLines<double> from_m, until_m;
  CacheLines<std::uint32_t> breaks;
  std::size_t break_count = 0;
  CacheLines<std::uint8_t> starts_surface;  ///< as in PiecesToLay

  /// Makes room for the pieces of a plane of that many rays. Keeps no values.
  void make_room(std::size_t rays);
  /// Forgets the pieces.
  void clear() { count = break_count = 0; }
  /// Adds a piece behind the last. There must be room.
  void add(const Piece& piece) {
    begin[count] = piece.begin;
    end[count] = piece.end;
    index[count] = piece.index;
    label[count] = piece.label;
    strengths_from[count] = piece.strengths_from;
    level[count] = piece.level;
    pole[count] = piece.pole;
    distance[count] = piece.distance;
    ++count;
  }
  /// Repeats the last piece behind the end, since the kernel works on whole vector registers.
  void pad();

  /// Slant ranges of a piece's first and last ray, on the straight line through its ranges.
  double first_ray_m(std::size_t piece) const { return range_m[piece] - to_last_m[piece]; }
  double last_ray_m(std::size_t piece) const { return range_m[piece] + to_last_m[piece]; }

  // Views for the kernel; valid until make_room().
  PieceGeometry geometry() const;
  PieceEchoes echoes();
  PiecesToLay to_lay();
};

}  // namespace ensonify::engine
