#include <ensonify/engine/trace/check/height_comparison.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ensonify::engine {

Hit bed_below(Ray ray, std::size_t bed_faces, const Intersector& reference) {
  for (;;) {
    Hit hit;
    reference.intersect({&ray, 1}, {&hit, 1});
    if (!hit || hit.face < bed_faces) return hit;
    // At equal distance the bed's face is reported, because its number is lower.
    ray.t_min = std::nextafter(hit.t, std::numeric_limits<double>::infinity());
  }
}

void judge_height(const Judge& judge, const Ray& ray, const Hit& bed, double height_m,
                  AgreementCounts& counts) {
  Hit found = bed;
  found.t = ray.origin.z() - height_m;
  if (std::isnan(height_m)) found = {};
  if (!bed && !std::isnan(height_m)) found.face = 0;  // any face
  Verdict verdict = bed || found ? Verdict::unexplained : Verdict::same;
  if (bed && found) {
    const double dt_m = std::abs(found.t - bed.t);
    const double tolerance_m = judge.tolerance_m(ray, bed.face, Precision::in_double);
    if (dt_m <= tolerance_m) verdict = Verdict::same;
    if (verdict == Verdict::same && dt_m > 0.0) {
      counts.largest_dt_m = std::max(counts.largest_dt_m, dt_m);
      counts.largest_dt_relative = std::max(counts.largest_dt_relative, dt_m / bed.t);
      counts.largest_dt_of_tolerance = std::max(counts.largest_dt_of_tolerance, dt_m / tolerance_m);
    }
  }
  counts.add(verdict, {ray, bed, found});
}

}  // namespace ensonify::engine
