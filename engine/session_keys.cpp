#include <ensonify/engine/session_keys.h>

#include <algorithm>
#include <stdexcept>

#include <ensonify/engine/seafloor/objects/objects.h>

namespace ensonify::engine {

std::vector<std::size_t> changed_sonars(const Scene& scene,
                                        std::span<const std::string> overrides) {
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < scene.sonars.size(); ++i) {
    const std::string prefix = "sonar." + scene.sonars[i].name + ".";
    if (std::ranges::any_of(overrides, [&](const auto& key) { return key.starts_with(prefix); }))
      changed.push_back(i);
  }
  return changed;
}

MovingObject single_object(const Scene& scene) {
  if (scene.objects.size() != 1) throw std::invalid_argument("expected the keys of one object");
  const ObjectOptions& table = scene.objects.front();
  return {.mesh = mesh_of(table, scene.seed, scene.materials),
          .material = table.material,
          .class_name = table.class_name};
}

}  // namespace ensonify::engine
