#pragma once

#include <memory>

#include <ensonify/engine/trace/face_source.h>

namespace ensonify::engine {

/// All faces of the seafloor; their intersector is built once.
std::unique_ptr<FaceSource> make_static_faces(const FaceSourceParts& parts);

}  // namespace ensonify::engine
