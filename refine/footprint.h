#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// Original faces, all that a fan can touch among them. Corners are leaves of the progressive mesh,
/// in the source mesh's corner order.
struct ExactFaces {
  std::span<const Eigen::Vector3f> points;      ///< by leaf
  std::span<const Face> faces;                  ///< leaves
  std::span<const std::uint32_t> source_faces;  ///< a face's number in the source mesh
};

/// The faces inside view volumes by a walk from the roots: down where a node's sphere meets a
/// volume, collecting the faces whose three leaves were reached. One volume, or several pings' at
/// once.
class Footprint {
 public:
  /// The progressive mesh must outlive this.
  explicit Footprint(const ProgressiveMesh& mesh);
  explicit Footprint(ProgressiveMesh&&) = delete;

  /// Good until the next call; nothing is allocated in a steady state. Throws DamagedFile where the
  /// progressive mesh's file is damaged (another query may find what it wants elsewhere), and
  /// std::invalid_argument as ViewTest does.
  ExactFaces query(std::span<const FanVolume> volumes);

 private:
  /// A node, or where lo + 1 = hi a leaf.
  struct Branch {
    std::uint32_t node, lo, hi;
  };

  void descend(Branch branch);
  std::size_t collect();
  std::uint64_t reached(std::uint32_t leaf) const { return reached_[leaf / 64] >> leaf % 64 & 1; }

  const ProgressiveMesh* mesh_;
  ViewTest view_;
  std::vector<std::uint64_t> reached_;  // a bit a leaf
  std::vector<std::uint32_t> leaves_;   // those set
  std::vector<std::uint32_t> split_;    // the inner nodes that meet a volume
  std::vector<Branch> pending_;
  std::vector<Face> faces_;  // found, and room behind them
  std::vector<std::uint32_t> source_faces_;
};

}  // namespace ensonify::refine
