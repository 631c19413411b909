#include <ensonify/engine/trace/surface.h>

#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace ensonify::engine {
namespace {

struct SurfaceKind {
  std::string_view name;
  std::unique_ptr<Surface> (*make)(std::shared_ptr<const Intersector> whole);
};

constexpr std::array kinds{
    SurfaceKind{"static",
                [](std::shared_ptr<const Intersector> whole) -> std::unique_ptr<Surface> {
                  return std::make_unique<StaticSurface>(std::move(whole));
                }},
};

}  // namespace

std::vector<std::string_view> surface_names() {
  std::vector<std::string_view> names;
  for (const SurfaceKind& kind : kinds) names.push_back(kind.name);
  return names;
}

std::unique_ptr<Surface> make_surface(std::string_view name,
                                      std::shared_ptr<const Intersector> whole) {
  for (const SurfaceKind& kind : kinds)
    if (kind.name == name) return kind.make(std::move(whole));
  throw std::invalid_argument(fmt::format("there is no surface '{}'; there are: {}", name,
                                          fmt::join(surface_names(), ", ")));
}

}  // namespace ensonify::engine
