#pragma once

#include <string_view>

#include <ensonify/engine/seafloor/objects/object_body.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::tests {

/// The mesh of a shape.
inline refine::TriangleMesh body(std::string_view shape, const engine::ShapeSize& size = {}) {
  return make_body(engine::shape_named(shape), size, engine::RandomStream(1, engine::Purpose::test))
      .mesh;
}

}  // namespace ensonify::tests
