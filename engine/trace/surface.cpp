#include <ensonify/engine/trace/surface.h>

#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/trace/exact_surface.h>
#include <ensonify/refine/tile_collapse.h>

namespace ensonify::engine {
namespace {

class StaticSurface final : public Surface {
 public:
  explicit StaticSurface(const SurfaceParts& parts) : all_(parts.all), whole_(parts.whole) {}
  const Intersector& prepare(std::span<const RayFan>) override { return *whole_; }
  refine::Triangles triangles() const override { return all_; }
  std::uint64_t version() const override { return 0; }

 private:
  refine::Triangles all_;
  std::shared_ptr<const Intersector> whole_;
};

constexpr std::array kinds{
    SurfaceKind{"static", "all faces, built once", false, &make_static_surface},
    SurfaceKind{"refined", "the exact faces of a mesh that is refined at each ping", true,
                &make_refined_surface},
    SurfaceKind{"footprint", "the same faces by a query at each ping", true,
                &make_footprint_surface},
};

}  // namespace

std::span<const SurfaceKind> surface_kinds() { return kinds; }

std::vector<std::string_view> surface_names() {
  std::vector<std::string_view> names;
  for (const SurfaceKind& kind : kinds) names.push_back(kind.name);
  return names;
}

const SurfaceKind& surface_kind(std::string_view name) {
  for (const SurfaceKind& kind : kinds)
    if (kind.name == name) return kind;
  throw std::invalid_argument(fmt::format("there is no surface '{}'; there are: {}", name,
                                          fmt::join(surface_names(), ", ")));
}

double surface_bytes_a_face(const SurfaceKind& kind, std::string_view intersector) {
  if (kind.needs_progressive_mesh) return refine::tile_collapse_bytes_a_face;
  // Measured over 2.4 million faces, and rounded down.
  if (intersector.starts_with("embree")) return 70.0;
  if (intersector == "pluecker") return 160.0;
  if (intersector == "fan_scan") return 30.0;
  return 0.0;
}

std::unique_ptr<Surface> make_static_surface(const SurfaceParts& parts) {
  return std::make_unique<StaticSurface>(parts);
}

}  // namespace ensonify::engine
