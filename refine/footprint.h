#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// Original faces that include all faces that a fan can touch. Corners are leaves of the
/// progressive mesh, in the source mesh's corner order.
struct ExactFaces {
  std::span<const Eigen::Vector3f> points;      ///< one per leaf
  std::span<const Face> faces;                  ///< three leaves each
  std::span<const std::uint32_t> source_faces;  ///< numbers of the faces in the source mesh
};

/// Finds the faces inside fan volumes (of one ping or of several) by descending from the roots of a
/// progressive mesh: to a node's children if the node's sphere can touch a volume. Collects the
/// faces whose three leaves were reached.
class Footprint {
 public:
  /// The progressive mesh must outlive this.
  explicit Footprint(const ProgressiveMesh& mesh);
  explicit Footprint(ProgressiveMesh&&) = delete;

  /// The result is valid until the next call. Allocates no memory in a steady state. Throws
  /// DamagedFile if the needed part of the progressive mesh's file is damaged (another query may
  /// succeed), and std::invalid_argument as ViewTest does.
  ExactFaces query(std::span<const FanVolume> volumes);

 private:
  /// A node, or a leaf if lo + 1 = hi.
  struct Branch {
    std::uint32_t node, lo, hi;
  };

  void descend(Branch branch);
  std::size_t collect();
  std::uint64_t reached(std::uint32_t leaf) const { return reached_[leaf / 64] >> leaf % 64 & 1; }

  const ProgressiveMesh* mesh_;
  ViewTest view_;
  std::vector<std::uint64_t> reached_;  // one bit per leaf
  std::vector<std::uint32_t> leaves_;   // the leaves whose bit is set
  std::vector<std::uint32_t> split_;    // the inner nodes whose spheres can touch a volume
  std::vector<Branch> pending_;
  std::vector<Face> faces_;  // the found faces; the array may be longer
  std::vector<std::uint32_t> source_faces_;
};

}  // namespace ensonify::refine
