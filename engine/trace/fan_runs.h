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

/// What the rays of a fan hit, as runs: neighbouring rays of a plane with the same nearest face.
/// Runs are in order of planes, and within a plane in order of rays. Rays that miss, or are outside
/// the beam, belong to no run.
///
/// A run describes the plane of its face within the fan's plane: a ray of elevation e meets the
/// face at the range distance / (level cos e + pole sin e). The sine of its grazing angle is
/// -(level cos e + pole sin e) if the face's front is hit, for which distance is negative.
class FanRuns {
 public:
  CacheLines<std::uint32_t> begin, end;   ///< elevations [begin, end)
  CacheLines<std::uint32_t> index, face;  ///< as in Hit
  /// Components of the face's unit normal: along the direction of the fan's plane at elevation 0,
  /// and along the pole.
  CacheLines<double> level, pole;
  CacheLines<double> distance;     ///< of the face's plane from the fan's origin, along the normal
  std::vector<std::size_t> first;  ///< run of each plane, then the end; other arrays are longer

  /// Makes room for the most runs that a grid may have, and removes all runs.
  void start(const FanGrid& grid);
  /// Makes the runs from `hits`: one per ray of the fan, by ray number. The hits index `triangles`.
  void take(const RayFan& fan, refine::Triangles triangles, std::span<const Hit> hits);
  /// Writes the hits of these runs by ray number, without u and v. All other rays of the fan miss.
  void give_hits(const RayFan& fan, std::span<Hit> hits) const;
  /// Copies the face of run `other` of `from` to `run`, but not the rays.
  void copy_face(std::size_t run, const FanRuns& from, std::size_t other) {
    index[run] = from.index[other], face[run] = from.face[other];
    level[run] = from.level[other], pole[run] = from.pole[other];
    distance[run] = from.distance[other];
  }

  /// Copies runs [from, until) of another fan to `run` and the following ones. May overwrite runs
  /// behind the copied ones.
  void copy_runs(std::size_t run, const FanRuns& other, std::size_t from, std::size_t until);

  std::size_t size() const { return first.back(); }
};

}  // namespace ensonify::engine
