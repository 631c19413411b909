#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// Original faces that include all that a fan can touch. Corners are leaves of the progressive
/// mesh, in the source mesh's corner order.
struct ExactFaces {
  std::span<const Eigen::Vector3f> points;      ///< by leaf
  std::span<const Face> faces;                  ///< leaves
  std::span<const std::uint32_t> source_faces;  ///< a face's number in the source mesh
};

/// Finds the faces inside fan volumes (of one ping or of several) by a walk from the roots: it
/// descends where a node's sphere meets a volume, and collects the faces whose three leaves were
/// reached.
class Footprint {
 public:
  /// The progressive mesh must outlive this.
  explicit Footprint(const ProgressiveMesh& mesh);
  explicit Footprint(ProgressiveMesh&&) = delete;

  /// Valid until the next call; allocates nothing in a steady state. Throws DamagedFile if the part
  /// of the progressive mesh's file that it needs is damaged (another query may succeed), and
  /// std::invalid_argument as ViewTest does.
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
  std::vector<std::uint32_t> split_;    // the inner nodes that meet a volume
  std::vector<Branch> pending_;
  std::vector<Face> faces_;  // the found faces; may be longer
  std::vector<std::uint32_t> source_faces_;
};

}  // namespace ensonify::refine
