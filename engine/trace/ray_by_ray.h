#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Base of back-ends that trace a fan's rays one by one. It uses only the option `stop_check`.
class RayByRay : public Intersector {
 public:
  explicit RayByRay(const IntersectorOptions& options = {}) : stop_check_(options.stop_check) {}

  void intersect(const RayFan& fan, std::span<Hit> hits) const final {
    check_fan(fan, hits);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
        const std::size_t number = plane * fan.elevations() + elevation;
        stop_now_and_then(number);
        hits[number] =
            fan.grid->within_beam(plane, elevation) ? nearest(fan.ray(plane, elevation)) : Hit{};
      }
  }
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const final {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      stop_now_and_then(i);
      hits[i] = nearest(rays[i]);
    }
  }

 protected:
  const std::function<void()>& stop_check() const { return stop_check_; }

 private:
  /// The nearest hit by the contract, or a miss. It checks the ray (check_ray()), because rays of
  /// lists are not checked before.
  virtual Hit nearest(const Ray& ray) const = 0;

  void stop_now_and_then(std::size_t ray) const {
    constexpr std::size_t rays_between = 16;  // a ray may meet millions of faces
    if (stop_check_ && ray % rays_between == 0) stop_check_();
  }

  std::function<void()> stop_check_;
};

}  // namespace ensonify::engine
