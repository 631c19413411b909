#include <ensonify/engine/trace/check/ping_comparison.h>

#include <memory>
#include <utility>
#include <vector>

#include <ensonify/engine/trace/check/height_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/check/near_faces.h>

namespace ensonify::engine {

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
