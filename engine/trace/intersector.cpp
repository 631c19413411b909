#include <ensonify/engine/trace/intersector.h>

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

bool fits(const Eigen::Vector3d& v) { return (v.array().abs() <= largest_component).all(); }

}  // namespace

void check_ray(const Ray& ray) {
  if (!fits(ray.origin) || !fits(ray.direction))
    throw std::invalid_argument("a ray's origin and direction must be finite and within 1e18");
  if (ray.direction.isZero(0.0)) throw std::invalid_argument("a ray's direction must not be zero");
  if (!(ray.t_min >= 0.0 && ray.t_min <= largest_component))
    throw std::invalid_argument("a ray's t_min must be between 0 and 1e18");
  if (!(ray.t_max >= ray.t_min))
    throw std::invalid_argument("a ray's t_max must not be below its t_min");
}

void check_fan(const RayFan& fan, std::span<const Hit> hits) {
  if (hits.size() != fan.grid->rays())
    throw std::invalid_argument("`hits` must have one element for every ray of the fan's grid");
  check_fan(fan);
}

void check_fan(const RayFan& fan) {
  check_frame(fan);
  check_grid(*fan.grid);
}

void check_frame(const RayFan& fan) {
  for (const Eigen::Vector3d& direction : {fan.array_axis, fan.middle, fan.pole}) {
    check_ray({fan.origin, direction, 0.0, fan.range_m});
    if (!(std::abs(direction.squaredNorm() - 1.0) <= 1e-6))
      throw std::invalid_argument("a fan's array axis, middle and pole must be unit vectors");
  }
}

void check_grid(const FanGrid& grid) {
  bool within = true;  // single rays are not checked
  for (const FanGrid::Plane& plane : grid.planes)
    within &= std::abs(plane.sin_azimuth) <= 1.0 && std::abs(plane.cos_azimuth) <= 1.0;
  for (std::size_t i = 0; i < grid.elevation_rad.size(); ++i)
    within &= std::abs(grid.sin_elevation[i]) <= 1.0 && std::abs(grid.cos_elevation[i]) <= 1.0;
  if (!within) throw std::invalid_argument("a fan's sines and cosines must be within 1");
}

void check_vertices(refine::Triangles triangles, double largest_m) {
  const auto bound = static_cast<float>(largest_m);
  for (std::size_t i = 0; i < triangles.faces.size(); ++i)
    for (const std::uint32_t corner : triangles.faces[i]) {
      if (corner >= triangles.positions.size())
        throw refine::MeshError(
            fmt::format("face {} has vertex {}, but the mesh has {} vertices; repair the mesh", i,
                        corner, triangles.positions.size()));
      if (!(triangles.positions[corner].array().abs() <= bound).all())
        throw refine::MeshError(fmt::format(
            "vertex {} is not finite or is beyond {:g} m; repair the mesh before tracing it",
            corner, largest_m));
    }
}

}  // namespace ensonify::engine
