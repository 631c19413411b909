#include <ensonify/engine/trace/intersector.h>

#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/trace/brute_force.h>
#include <ensonify/engine/trace/embree.h>

namespace ensonify::engine {
namespace {

constexpr double largest_component = 1e18;  // Embree's own bound is a little wider

bool fits(const Eigen::Vector3d& v) { return (v.array().abs() <= largest_component).all(); }

constexpr std::array kinds{
    IntersectorKind{"embree", "Embree's bounding volume hierarchy, packets of 16 rays, float",
                    &make_embree},
    IntersectorKind{"brute_force", "every face for every ray, double: the plain reference, slow",
                    &make_brute_force},
};

}  // namespace

std::span<const IntersectorKind> intersector_kinds() { return kinds; }

std::unique_ptr<Intersector> make_intersector(std::string_view name, refine::Triangles triangles) {
  std::vector<std::string_view> names;
  for (const IntersectorKind& kind : kinds) {
    if (kind.name == name) {
      check_vertices(triangles);
      return kind.make(triangles);
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
  for (const Eigen::Vector3d& direction : {fan.array_axis, fan.middle, fan.pole})
    check_ray({fan.origin, direction, 0.0, fan.range_m});
}

void check_vertices(refine::Triangles triangles) {
  for (std::size_t i = 0; i < triangles.positions.size(); ++i)
    if (!fits(triangles.positions[i].cast<double>()))
      throw refine::MeshError(fmt::format(
          "vertex {} is not finite, or beyond 1e18 m; repair the mesh before tracing it", i));
}

}  // namespace ensonify::engine
