#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Rays aimed at the places of a mesh where intersectors go wrong, the same for the same seed.
///
/// Each ray has a target: a vertex, the middle or any point of an edge, or the inside of a face,
/// the mesh's thinnest faces preferred. And it comes from somewhere: above, below, along a line of
/// the grid, nearly in the face's plane, along an edge, from 1 to 1000 km away, or off the target
/// itself. Some begin or end at the target.
class AdversarialRays {
 public:
  /// The triangles must outlive this. Throws std::invalid_argument without a face.
  AdversarialRays(refine::Triangles triangles, std::uint64_t seed);

  /// Fills the list of that number.
  void aim(std::uint64_t list, std::span<Ray> rays) const;

  /// The fan of that number, whose planes go through vertices and whose elevations go through
  /// vertices and through the edges that its planes cross; half of them in the planes of the grid.
  /// Most are as narrow as beams, and the beam ends at the outermost ray. What lies before it is
  /// asked of the reference. Some 400 to 1500 rays.
  RayFan aim(std::uint64_t fan, const Intersector& reference) const;

  /// Fills the list of that number with rays straight down from above the mesh: at targets, and
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
  double size_m_;                    // its diagonal
  std::vector<std::uint32_t> thin_;  // the thinnest hundredth of its faces
};

}  // namespace ensonify::engine
