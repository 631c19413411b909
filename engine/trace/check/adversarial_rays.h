#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Rays aimed at the places of a mesh where intersectors go wrong. The same seed gives the same
/// rays.
///
/// Each ray has a target: a vertex, the middle or any point of an edge, or the inside of a face,
/// with a preference for the thinnest faces. Its origin is above, below, along a grid line, nearly
/// in the face's plane, along an edge, 1 to 1000 km away, or near the target. Some rays begin or
/// end at the target.
class AdversarialRays {
 public:
  /// The triangles must outlive this. Throws std::invalid_argument for a mesh without faces.
  AdversarialRays(refine::Triangles triangles, std::uint64_t seed);

  /// Fills list number `list`.
  void aim(std::uint64_t list, std::span<Ray> rays) const;

  /// Fan number `number`. Its planes go through vertices; its elevations go through vertices and
  /// through the edges that its planes cross; half of the fans lie in the planes of the grid. Most
  /// are as narrow as beams, and the beam ends at the outermost ray. `reference` finds the faces
  /// in view. About 400 to 1500 rays.
  RayFan aim(std::uint64_t number, const Intersector& reference) const;

  /// Fills list number `list` with rays straight down from above the mesh: most at targets, some
  /// anywhere.
  void aim_down(std::uint64_t list, std::span<Ray> rays) const;

 private:
  class Dice;
  std::uint32_t draw_face(Dice& dice) const;
  Eigen::Vector3d draw_target(Dice& dice, std::uint32_t face, int corner) const;
  Ray draw_ray(Dice& dice) const;
  RayFan draw_frame(Dice& dice) const;

  refine::Triangles triangles_;
  std::uint64_t seed_;
  refine::Bounds box_;
  double size_m_;                    // the box's diagonal
  std::vector<std::uint32_t> thin_;  // the thinnest hundredth of the faces
};

}  // namespace ensonify::engine
