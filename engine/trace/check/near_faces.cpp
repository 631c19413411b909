#include <ensonify/engine/trace/check/near_faces.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

/// A box along a fan's axes that holds all its rays.
class FanBox {
 public:
  explicit FanBox(const RayFan& fan) : origin_(fan.origin) {
    to_frame_ << fan.array_axis.transpose(), fan.middle.transpose(), fan.pole.transpose();
    const double range_m = fan.range_m * fan.bend.lengthening;
    const double turn = std::min(fan.bend.turn_rad, 2.0);
    const double slack_m = 1e-5 * range_m + 1e-5;  // the axes' lengths are within 1e-6 of 1
    const double along_m = range_m * std::min(1.0, fan.grid->sin_truncation + turn);
    const double most = std::clamp(fan.grid->elevation_rad.back() + turn, -1.6, 1.6);
    const double least = std::clamp(fan.grid->elevation_rad.front() - turn, -1.6, 1.6);
    highest_ = {along_m, range_m, std::max(0.0, range_m * std::sin(most))};
    lowest_ = {-along_m, std::max(most, -least) > 1.5 ? -range_m : 0.0,
               std::min(0.0, range_m * std::sin(least))};
    // In a very wide fan, planes far to the side look backwards.
    for (const FanGrid::Plane& plane : fan.grid->planes)
      if (plane.cos_azimuth < 0.0) lowest_.y() = -range_m;
    highest_.array() += slack_m;
    lowest_.array() -= slack_m;
  }

  bool may_touch(const std::array<Vector3d, 3>& corners) const {
    const Vector3d a = to_frame_ * (corners[0] - origin_), b = to_frame_ * (corners[1] - origin_),
                   c = to_frame_ * (corners[2] - origin_);
    return (a.cwiseMin(b).cwiseMin(c).array() <= highest_.array()).all() &&
           (a.cwiseMax(b).cwiseMax(c).array() >= lowest_.array()).all();
  }

 private:
  Vector3d origin_, lowest_, highest_;
  Eigen::Matrix3d to_frame_;
};

}  // namespace

NearFaces::NearFaces(refine::Triangles mesh, std::span<const RayFan> fans) {
  const std::vector<FanBox> boxes(fans.begin(), fans.end());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> near;  // number, place in the mesh
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    const refine::Face& face = mesh.faces[i];
    if (std::ranges::any_of(face, [&](std::uint32_t v) { return v >= mesh.positions.size(); }))
      continue;
    const std::array corners{mesh.corner(i, 0), mesh.corner(i, 1), mesh.corner(i, 2)};
    if (std::ranges::any_of(boxes, [&](const FanBox& box) { return box.may_touch(corners); }))
      near.emplace_back(mesh.number(i), i);
  }
  std::ranges::sort(near);

  std::vector<std::uint32_t> used;
  for (const auto& [number, i] : near)
    used.insert(used.end(), mesh.faces[i].begin(), mesh.faces[i].end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (const std::uint32_t vertex : used) positions.push_back(mesh.positions[vertex]);
  for (const auto& [number, i] : near) {
    refine::Face& face = faces.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      face[k] = static_cast<std::uint32_t>(std::ranges::lower_bound(used, mesh.faces[i][k]) -
                                           used.begin());
    numbers.push_back(number);
  }
}

void NearFaces::add(const std::array<Eigen::Vector3f, 3>& corners, std::uint32_t number) {
  const auto first = static_cast<std::uint32_t>(positions.size());
  positions.insert(positions.end(), corners.begin(), corners.end());
  faces.push_back({first, first + 1, first + 2});
  numbers.push_back(number);
}

}  // namespace ensonify::engine
