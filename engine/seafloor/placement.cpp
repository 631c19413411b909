#include <ensonify/engine/seafloor/placement.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/mesh_reader.h>

namespace ensonify::engine {
namespace {

using Eigen::AngleAxisd, Eigen::Vector3d, Eigen::Vector3f;

Eigen::Matrix3d attitude(const ObjectOptions& object) {
  return (AngleAxisd(-object.heading_rad, Vector3d::UnitZ()) *
          AngleAxisd(object.pitch_rad, Vector3d::UnitX()) *
          AngleAxisd(object.roll_rad, Vector3d::UnitY()))
      .toRotationMatrix();
}

/// The faces of a bed that, seen from above, can meet a box.
std::vector<refine::Face> faces_below(const refine::Bounds& box, refine::Triangles bed) {
  std::vector<refine::Face> faces;
  for (const refine::Face& face : bed.faces) {
    const Vector3f &a = bed.positions[face[0]], &b = bed.positions[face[1]],
                   &c = bed.positions[face[2]];
    const Vector3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    if ((low.head<2>().array() <= box.highest.head<2>().array()).all() &&
        (high.head<2>().array() >= box.lowest.head<2>().array()).all())
      faces.push_back(face);
  }
  return faces;
}

std::vector<Vector3f> corners(refine::Triangles triangles) {
  std::vector<std::uint32_t> used;
  for (const refine::Face& face : triangles.faces)
    used.insert(used.end(), face.begin(), face.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<Vector3f> points;
  for (const std::uint32_t vertex : used) points.push_back(triangles.positions[vertex]);
  return points;
}

/// The least height of points over the triangles below them (or under those above, with `up`);
/// infinite where no point has any.
double least_gap_m(std::span<const Vector3f> points, refine::Triangles triangles, bool up) {
  // From beyond the triangles, so that their outer side is met even where the two overlap.
  const refine::Bounds box = refine::bounds(triangles);
  const double start_m = up ? box.lowest.z() - 1.0 : box.highest.z() + 1.0;
  const Vector3d direction = (up ? 1.0 : -1.0) * Vector3d::UnitZ();
  std::vector<Ray> rays;
  rays.reserve(points.size());
  for (const Vector3f& p : points) rays.push_back({{p.x(), p.y(), start_m}, direction});
  std::vector<Hit> hits(rays.size());
  make_intersector("pluecker", triangles)->intersect(rays, hits);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (hits[i]) least = std::min(least, direction.z() * (start_m - points[i].z()) + hits[i].t);
  return least;
}

/// How far an object can be let down until it touches the bed; negative if it must be raised.
double drop_m(refine::Triangles object, refine::Triangles bed) {
  const std::vector<refine::Face> faces = faces_below(refine::bounds(object), bed);
  const refine::Triangles ground{bed.positions, faces};
  return std::min(least_gap_m(corners(object), ground, false),
                  least_gap_m(corners(ground), object, true));
}

}  // namespace

refine::RepairedMesh place_object(const ObjectOptions& object, refine::Triangles bed) {
  refine::RepairedMesh placed =
      refine::repair(refine::read_mesh(object.mesh.path), object.weld_m / object.scale);
  const std::vector<Vector3f> original = placed.mesh.positions;
  const refine::Bounds box = refine::bounds(placed.mesh);
  const Vector3d middle = 0.5 * (box.lowest.cast<double>() + box.highest.cast<double>());
  const Eigen::Matrix3d turn = object.scale * attitude(object);
  const auto put_at = [&](double z_m) {
    const Vector3d place(object.east_m, object.north_m, z_m);
    for (std::size_t i = 0; i < original.size(); ++i)
      placed.mesh.positions[i] =
          (turn * (original[i].cast<double>() - middle) + place).cast<float>();
  };
  put_at(0.0);
  const double drop = drop_m(placed.mesh, bed);
  if (!std::isfinite(drop))
    throw refine::MeshError(
        fmt::format("{}: there is no bed below this object at {:.1f} m east, {:.1f} m north; move "
                    "its east_m and "
                    "north_m over the seafloor",
                    object.mesh.path.string(), object.east_m, object.north_m));
  put_at(object.height_m - drop);
  placed.mesh.world_origin.setZero();
  return placed;
}

}  // namespace ensonify::engine
