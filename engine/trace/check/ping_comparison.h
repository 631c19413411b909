#pragma once

#include <cstddef>
#include <span>

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/face_source.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The first of the bed's faces that a vertical ray meets. Faces with the number `bed_faces` or a
/// higher one are not the bed's: the ray passes them. The reference must answer lists of rays.
Hit bed_below(Ray ray, std::size_t bed_faces, const Intersector& reference);

/// Compares a height (m, NaN for none) with the bed's hit below, and counts one ray.
void judge_height(const Judge& judge, const Ray& ray, const Hit& bed, double height_m,
                  AgreementCounts& counts);

/// The mesh that one ping is checked against: a progressive mesh's points, faces and face numbers.
struct CheckedMesh {
  refine::Triangles triangles;
  refine::Bounds bounds;
  std::size_t bed_faces;  ///< faces with lower numbers are the bed's
};

/// Compares one ping of a face source with the reference. The reference is built only over the
/// faces that the fans can touch, so no tree of the whole mesh is needed.
AgreementCounts compare_ping(FaceSource& surface, const CheckedMesh& mesh,
                             std::span<const RayFan> fans, Precision precision);
/// Compares the height of the bed at (x, y) in the same way; counts one ray.
AgreementCounts compare_height(const CheckedMesh& mesh, double x_m, double y_m, double height_m);

}  // namespace ensonify::engine
