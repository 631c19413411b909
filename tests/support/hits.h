#pragma once

#include <vector>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::tests {

inline std::vector<engine::Hit> hits_of(const engine::Intersector& tracer,
                                        const engine::RayFan& fan) {
  std::vector<engine::Hit> hits(fan.grid->rays());
  tracer.intersect(fan, hits);
  return hits;
}

inline engine::Hit hit_of(const engine::Intersector& tracer, const engine::Ray& ray) {
  engine::Hit hit;
  tracer.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

}  // namespace ensonify::tests
