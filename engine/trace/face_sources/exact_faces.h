#pragma once

#include <functional>
#include <memory>

#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A source of the faces that the fans can touch, unchanged, and of no others. So every ray hits
/// what it would hit on the whole mesh. The tree over these faces is rebuilt for each ping, or kept
/// until the fans leave the volume for which it was built.
std::unique_ptr<FaceSource> make_refined_faces(const FaceSourceParts& parts);
std::unique_ptr<FaceSource> make_footprint_faces(const FaceSourceParts& parts);
/// A source of the faces of the objects on a bed of heights, without the bed.
std::unique_ptr<FaceSource> make_object_faces(const FaceSourceParts& parts);
/// A bed of heights with objects on it. GridScan finds the runs of the bed, and fan_scan the runs
/// of the objects. If the bed does not allow this, or if hits are needed, `exact` answers instead,
/// with the same bits.
std::unique_ptr<FaceSource> make_scanned_grid(const FaceSourceParts& parts,
                                              std::unique_ptr<FaceSource> exact);

/// The progressive mesh of a seafloor's mesh. Where the mesh is not manifold, vertices are split;
/// this changes no hit. Faces keep their numbers; a face that is oriented against its neighbours is
/// turned over (refine::build_of_any_mesh()). The result does not depend on `threads`. Throws what
/// the builder throws. `stop_check` as in refine::build_by_tiles().
std::shared_ptr<const refine::ProgressiveMesh> make_progressive_mesh(
    const refine::TriangleMesh& mesh, int threads = 1,
    const std::function<void()>& stop_check = {});

/// The volume that holds all rays of a fan.
refine::FanVolume fan_volume_of(const RayFan& fan);

}  // namespace ensonify::engine
