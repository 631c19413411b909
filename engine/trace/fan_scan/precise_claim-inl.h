// How near a face is on the rays of a fan's plane, in double. Kernels include it; they are compiled
// once per Highway target. It must not use inline functions of the rest of the program.

#if defined(ENSONIFY_PRECISE_CLAIM) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_PRECISE_CLAIM
#undef ENSONIFY_PRECISE_CLAIM
#else
#define ENSONIFY_PRECISE_CLAIM
#endif

#include <cmath>
#include <cstdint>
#include <limits>

#include <hwy/highway.h>

#include <ensonify/engine/trace/fan_frame.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

// NOLINTBEGIN(misc-definitions-in-headers): each target has its own
constexpr float nearest_of_all = 1e30f;  // 1 / t of a hit at the origin
constexpr double in_the_plane = 1e-30;   // metres from the origin
// NOLINTEND(misc-definitions-in-headers)

// A face's claim on a plane's rays: 1 / t = (level cos(elevation) + pole sin(elevation)) /
// distance, within bounds.
struct PreciseClaim {
  double level, pole, distance, least, greatest;
};

// The face's first corner is the one that is lowest in (x, y, z).
HWY_INLINE PreciseClaim precise_claim(const FanFrame& frame, const float (&positions)[3][3],
                                      double sin_azimuth, double cos_azimuth) {
  const double *o = &frame.origin[0], *axes = &frame.axes[0];
  double corners[3][3];
  for (std::int64_t k = 0; k < 3; ++k) {
    double from[3];
    for (std::int64_t i = 0; i < 3; ++i) from[i] = double{positions[k][i]} - o[i];
    for (std::int64_t i = 0; i < 3; ++i)
      corners[k][i] = axes[3 * i] * from[0] + axes[3 * i + 1] * from[1] + axes[3 * i + 2] * from[2];
  }
  const auto &a = corners[0], &b = corners[1], &c = corners[2];
  double normal[3], distance = 0.0, size = 0.0, far2 = 0.0, longest2 = 0.0;
  for (std::int64_t i = 0; i < 3; ++i) {
    const std::int64_t j = (i + 1) % 3, k = (i + 2) % 3;
    normal[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    distance += normal[i] * a[i];
    size += std::fabs(normal[i]);
  }
  if (!(std::fabs(distance) > in_the_plane * size))
    return {0.0, 0.0, 1.0, nearest_of_all, nearest_of_all};
  for (std::int64_t k = 0; k < 3; ++k) {
    double corner2 = 0.0, edge2 = 0.0;
    for (std::int64_t i = 0; i < 3; ++i) {
      const double edge = corners[(k + 1) % 3][i] - corners[k][i];
      corner2 += corners[k][i] * corners[k][i];
      edge2 += edge * edge;
    }
    far2 = far2 > corner2 ? far2 : corner2;
    longest2 = longest2 > edge2 ? longest2 : edge2;
  }
  const double far = std::sqrt(far2), near = far - std::sqrt(longest2);
  return {normal[0] * sin_azimuth + normal[1] * cos_azimuth, normal[2], distance, 1.0 / far,
          near > 0.0 ? 1.0 / near : std::numeric_limits<double>::infinity()};
}

// 1 / t on a ray.
HWY_INLINE double nearness_on(const PreciseClaim& face, double cos_elevation,
                              double sin_elevation) {
  const double facing = face.level * cos_elevation + face.pole * sin_elevation;
  const double plain = facing / face.distance;
  const double within = plain > face.least ? plain : face.least;
  return within < face.greatest ? within : face.greatest;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
