#pragma once

#include <memory>

#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The faces that the fans can touch, unchanged, and no others: every ray of theirs hits what it
/// would hit on the whole mesh. Their tree is built anew at each ping, or does until the fans leave
/// what it was built for.
std::unique_ptr<FaceSource> make_refined_faces(const FaceSourceParts& parts);
std::unique_ptr<FaceSource> make_footprint_faces(const FaceSourceParts& parts);

/// The progressive mesh over a seafloor's mesh, made manifold where it is not (that parts vertices,
/// and costs a ray nothing); faces keep their numbers. The same on any number of threads. Throws
/// what the builder throws.
std::shared_ptr<const refine::ProgressiveMesh> make_progressive_mesh(
    const refine::TriangleMesh& mesh, int threads = 1);

/// The volume that holds all rays of a fan.
refine::FanVolume view_volume(const RayFan& fan);

}  // namespace ensonify::engine
