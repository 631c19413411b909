#include <ensonify/engine/trace/intersector.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/trace/brute_force.h>
#include <ensonify/engine/trace/embree.h>
#include <ensonify/engine/trace/fan_scan.h>
#include <ensonify/engine/trace/pluecker.h>

namespace ensonify::engine {
namespace {

bool fits(const Eigen::Vector3d& v) { return (v.array().abs() <= largest_component).all(); }

constexpr std::array kinds{
    IntersectorKind{"embree", "Embree's bounding volume hierarchy, packets of rays, float",
                    &make_embree},
    IntersectorKind{"embree-single", "the same, ray by ray: what packets bring",
                    &make_embree_single},
    IntersectorKind{"fan_scan", "scan conversion of a fan, no tree: fans only, for few faces",
                    &make_fan_scan, false},
    IntersectorKind{"pluecker", "the reference: Plücker's test, double, ties decided exactly",
                    &make_pluecker},
    IntersectorKind{"brute_force", "the same test of every face for every ray: slow",
                    &make_brute_force},
};

}  // namespace

std::span<const IntersectorKind> intersector_kinds() { return kinds; }

std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles,
                                              const IntersectorOptions& options) {
  std::vector<std::string_view> names;
  for (const IntersectorKind& kind : kinds) {
    if (kind.name == name) {
      std::unique_ptr<Intersector> made = kind.make(options);
      made->build(triangles);
      return made;
    }
    names.push_back(kind.name);
  }
  throw std::invalid_argument(
      fmt::format("there is no intersector '{}'; there are: {}", name, fmt::join(names, ", ")));
}

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
    throw std::invalid_argument("a fan's hits need one place for every ray of its grid");
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
  bool within = true;  // no ray is looked at one by one: a sine beyond 1 is as far as it goes
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
        throw refine::MeshError(fmt::format("face {} has a vertex {}, of {}; repair the mesh", i,
                                            corner, triangles.positions.size()));
      if (!(triangles.positions[corner].array().abs() <= bound).all())
        throw refine::MeshError(fmt::format(
            "vertex {} is not finite, or beyond {:g} m; repair the mesh before tracing it", corner,
            largest_m));
    }
}

}  // namespace ensonify::engine
