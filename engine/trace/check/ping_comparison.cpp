#include <ensonify/engine/trace/check/ping_comparison.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <ensonify/engine/trace/check/near_faces.h>

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

AgreementCounts compare_ping(FaceSource& surface, const CheckedMesh& mesh,
                             std::span<const RayFan> fans, Precision precision) {
  const NearFaces near(mesh.triangles, fans);
  const auto reference = make_intersector(reference_intersector, near.triangles());
  const Judge judge(near.triangles(), *reference, mesh.bounds);
  FanComparison comparison(judge, precision);
  const Faces faces = comparison.prepare(surface, fans);
  AgreementCounts counts;
  std::vector<Hit> expected;
  for (std::size_t i = 0; i < fans.size(); ++i) {
    expected.resize(fans[i].grid->rays());
    reference->intersect(fans[i], expected);
    comparison.fan(i, faces, fans[i], {expected, {}}, counts);
  }
  return counts;
}

AgreementCounts compare_height(const CheckedMesh& mesh, double x_m, double y_m, double height_m) {
  // A fan of one ray.
  FanGrid grid(FanLayout{.sector_high_rad = 1.0, .truncation_rad = 1.0, .main_lobe_rad = 1.0});
  grid.sin_truncation = 0.0;
  grid.planes = {{0.0, 1.0, 1.0}};
  grid.elevation_rad = grid.sin_elevation = {0.0};
  grid.cos_elevation = {1.0};
  const RayFan fan{
      .grid = std::make_shared<const FanGrid>(std::move(grid)),
      .origin = {x_m, y_m, double(mesh.bounds.highest.z()) + 1.0},
      .array_axis = Eigen::Vector3d::UnitX(),
      .middle = -Eigen::Vector3d::UnitZ(),
      .pole = Eigen::Vector3d::UnitY(),
      .range_m = double(mesh.bounds.highest.z()) - double(mesh.bounds.lowest.z()) + 2.0};
  const NearFaces near(mesh.triangles, {&fan, 1});
  const auto reference = make_intersector(reference_intersector, near.triangles());
  const Ray down = fan.ray(0, 0);
  AgreementCounts counts;
  judge_height(Judge(near.triangles(), *reference, mesh.bounds), down,
               bed_below(down, mesh.bed_faces, *reference), height_m, counts);
  return counts;
}

}  // namespace ensonify::engine
