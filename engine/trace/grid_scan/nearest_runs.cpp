// The comparison of two faces is compiled once per Highway target (vector_targets.h).

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/grid_scan/nearest_runs.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <hwy/highway.h>

#include <ensonify/engine/trace/fan_scan/precise_claim-inl.h>
#include <ensonify/engine/trace/grid_scan/nearest_runs.h>

namespace ensonify::engine {

#ifndef ENSONIFY_FACE_PAIR
#define ENSONIFY_FACE_PAIR
/// Two faces over the rays of a plane, as plain arrays.
struct FacePair {
  FanFrame frame;
  double sin_azimuth, cos_azimuth;
  float a[3][3], b[3][3];  ///< corners, the lowest in (x, y, z) first
  std::uint32_t number_a, number_b;
  const double *cos_elevation, *sin_elevation;
};
#endif

}  // namespace ensonify::engine

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {

// Moves `until` to the first of the rays [from, until) whose nearer face is not the nearer face of
// ray `from`. Returns whether the nearer face of ray `from` is a.
bool nearer_until(const FacePair& pair, std::uint32_t from, std::uint32_t* until) {
  const PreciseClaim a = precise_claim(pair.frame, pair.a, pair.sin_azimuth, pair.cos_azimuth);
  const PreciseClaim b = precise_claim(pair.frame, pair.b, pair.sin_azimuth, pair.cos_azimuth);
  const auto nearer = [&](std::uint32_t ray) HWY_ATTR {
    const double cosine = pair.cos_elevation[ray], sine = pair.sin_elevation[ray];
    const double of_a = nearness_on(a, cosine, sine), of_b = nearness_on(b, cosine, sine);
    return of_a != of_b ? of_a > of_b : pair.number_a < pair.number_b;
  };
  const bool first = nearer(from);
  std::uint32_t ray = from + 1;
  while (ray < *until && nearer(ray) == first) ++ray;
  *until = ray;
  return first;
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(nearer_until);

namespace {

void take_corners(const refine::Triangles& triangles, std::uint32_t index, float (&to)[3][3]) {
  std::array<Eigen::Vector3f, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = triangles.positions[triangles.faces[index][k]];
  const auto lowest = std::min_element(
      corners.begin(), corners.end(), [](const Eigen::Vector3f& p, const Eigen::Vector3f& q) {
        return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
      });
  std::rotate(corners.begin(), lowest, corners.end());
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 3; ++i) to[k][i] = corners[k][static_cast<Eigen::Index>(i)];
}

/// 1 / t on a ray is `facing` divided by `distance_m`; both are positive here. If `facing` is not
/// small, the quotient is nearly exact for a face of any shape.
struct Nearness {
  double facing, distance_m;
  bool exact_enough() const { return facing > 0.01; }
};
Nearness nearness(const FanRuns& runs, std::size_t run, const FanGrid& grid, std::uint32_t ray) {
  return {std::abs(runs.level[run] * grid.cos_elevation[ray] +
                   runs.pole[run] * grid.sin_elevation[ray]),
          std::abs(runs.distance[run])};
}

enum class Nearer { a, b, unclear };
/// Which of two runs is nearer on all of the rays [begin, end). Over less than a quarter turn, the
/// difference of their 1 / t is least at one of the ends, if it has the same sign at both.
Nearer clearly_nearer(const FanGrid& grid, const FanRuns& a, std::size_t i, const FanRuns& b,
                      std::size_t j, std::uint32_t begin, std::uint32_t end) {
  constexpr double surely = 1.0 + 1e-4;
  const std::uint32_t last = end - 1;
  const double turn = grid.cos_elevation[begin] * grid.cos_elevation[last] +
                      grid.sin_elevation[begin] * grid.sin_elevation[last];
  bool a_nearer = turn > 0.0, b_nearer = turn > 0.0;
  for (const std::uint32_t ray : {begin, last}) {
    const Nearness of_a = nearness(a, i, grid, ray), of_b = nearness(b, j, grid, ray);
    const bool both = of_a.exact_enough() && of_b.exact_enough();
    const double for_a = of_a.facing * of_b.distance_m, for_b = of_b.facing * of_a.distance_m;
    a_nearer &= both && for_a > for_b * surely;
    b_nearer &= both && for_b > for_a * surely;
  }
  return a_nearer ? Nearer::a : b_nearer ? Nearer::b : Nearer::unclear;
}

}  // namespace

void nearest_runs(const RayFan& fan, refine::Triangles triangles, const FanRuns& a,
                  const FanRuns& b, FanRuns& nearest) {
  nearest.start(*fan.grid);
  std::size_t count = 0;
  FacePair pair{};
  pair.frame = frame_of(fan);
  pair.cos_elevation = fan.grid->cos_elevation.data();
  pair.sin_elevation = fan.grid->sin_elevation.data();
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const std::size_t first = count;
    const auto add = [&](const FanRuns& from, std::size_t run, std::uint32_t begin,
                         std::uint32_t end) {
      if (begin >= end) return;
      if (count > first && nearest.end[count - 1] == begin &&
          nearest.index[count - 1] == from.index[run]) {
        nearest.end[count - 1] = end;
        return;
      }
      nearest.begin[count] = begin;
      nearest.end[count] = end;
      nearest.copy_face(count++, from, run);
    };
    pair.sin_azimuth = fan.grid->planes[plane].sin_azimuth;
    pair.cos_azimuth = fan.grid->planes[plane].cos_azimuth;
    std::size_t i = a.first[plane], j = b.first[plane];
    const std::size_t end_a = a.first[plane + 1], end_b = b.first[plane + 1];
    std::uint32_t ray = 0;  // all before it are decided
    while (i < end_a && j < end_b) {
      if (ray <= a.begin[i] && a.end[i] <= b.begin[j]) {
        std::size_t end = i + 1;
        while (end < end_a && a.end[end] <= b.begin[j]) ++end;
        nearest.copy_runs(count, a, i, end);
        count += end - i;
        i = end;
        continue;
      }
      const std::uint32_t begin_a = std::max(ray, a.begin[i]), begin_b = std::max(ray, b.begin[j]);
      ray = std::max(begin_a, begin_b);
      add(a, i, begin_a, std::min(a.end[i], ray));
      add(b, j, begin_b, std::min(b.end[j], ray));
      const std::uint32_t both = std::min(a.end[i], b.end[j]);
      const Nearer clearly =
          ray < both ? clearly_nearer(*fan.grid, a, i, b, j, ray, both) : Nearer::a;
      if (clearly != Nearer::unclear) {
        if (clearly == Nearer::a) add(a, i, ray, both);
        if (clearly == Nearer::b) add(b, j, ray, both);
        ray = both;
      } else {
        take_corners(triangles, a.index[i], pair.a);
        take_corners(triangles, b.index[j], pair.b);
        pair.number_a = a.face[i];
        pair.number_b = b.face[j];
        while (ray < both) {
          std::uint32_t until = both;
          if (HWY_DYNAMIC_DISPATCH(nearer_until)(pair, ray, &until))
            add(a, i, ray, until);
          else
            add(b, j, ray, until);
          ray = until;
        }
      }
      if (a.end[i] == both) ++i;
      if (j < end_b && b.end[j] == both) ++j;
    }
    if (i < end_a && a.begin[i] < ray) add(a, i, ray, a.end[i]), ++i;
    nearest.copy_runs(count, a, i, end_a);
    count += end_a - i;
    for (; j < end_b; ++j) add(b, j, std::max(ray, b.begin[j]), b.end[j]);
    nearest.first.push_back(count);
  }
}

}  // namespace ensonify::engine
#endif
