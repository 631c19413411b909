#pragma once

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Base of back-ends that trace a fan's rays one by one.
class RayByRay : public Intersector {
 public:
  void intersect(const RayFan& fan, std::span<Hit> hits) const final {
    check_fan(fan, hits);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation)
        hits[plane * fan.elevations() + elevation] =
            fan.grid->within_beam(plane, elevation) ? nearest(fan.ray(plane, elevation)) : Hit{};
  }
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const final {
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = nearest(rays[i]);
  }

 private:
  /// The nearest hit by the contract, or a miss. It checks the ray (check_ray()), because those of
  /// lists are not checked before.
  virtual Hit nearest(const Ray& ray) const = 0;
};

}  // namespace ensonify::engine
