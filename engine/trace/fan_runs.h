#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/trace/ray.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// What the rays of a fan hit, run by run: neighbouring rays of a plane whose nearest face is one.
/// Runs come plane by plane, and within a plane in the order of rays; those that miss, or are
/// outside the beam, are in none.
///
/// A run's face is told by its plane, as the fan's plane cuts it: a ray of elevation e meets it at
/// the range distance / (level cos e + pole sin e), and its grazing angle's sine is -(level cos e +
/// pole sin e) if the face's front is hit, for which distance is negative.
class FanRuns {
 public:
  CacheLines<std::uint32_t> begin, end;   ///< elevations [begin, end)
  CacheLines<std::uint32_t> index, face;  ///< as in Hit
  CacheLines<double> level,
      pole;  ///< of the face's unit normal: along the direction of the fan's plane
             ///< at elevation 0, and along the pole
  CacheLines<double> distance;     ///< of the face's plane from the fan's origin, along the normal
  std::vector<std::size_t> first;  ///< of each plane, and their end; the rows are longer

  /// Makes room for as many as a grid may have, and forgets what there was.
  void start(const FanGrid& grid);
  /// Those of hits by ray number, over these triangles.
  void take(const RayFan& fan, refine::Triangles triangles, std::span<const Hit> hits);

  std::size_t size() const { return first.back(); }
};

}  // namespace ensonify::engine
