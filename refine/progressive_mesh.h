#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// A progressive mesh file that was changed after writing, or a hierarchy that contradicts itself.
struct DamagedFile : MeshError {
  using MeshError::MeshError;
};

/// The arrays that a builder fills and a ProgressiveMesh then owns. The class explains their names.
struct ProgressiveMeshArrays {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> mid;
  std::vector<Sphere> spheres;
  std::vector<std::uint32_t> order;
  std::vector<Face> faces;
  std::vector<std::uint32_t> source_face;
  std::vector<std::uint32_t> roots;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
};

/// A mesh at many resolutions: the base mesh M0 and the forest of collapses that leads from it to
/// every original vertex and face. Immutable; shared by all threads; copies share the memory.
///
/// Leaves are the original vertices, in depth-first order. Inner nodes are numbered in preorder. A
/// node that covers the leaves [lo, hi) stands for all of them while it is not split. Its children
/// cover [lo, mid) and [mid, hi). The children of inner node i are i + 1 and i + (mid - lo); but if
/// a range has only one leaf, this leaf is the child. lo and hi are known on the way down from the
/// root, so only mid is stored. "This node is above leaf l" means lo <= l < hi.
///
/// Faces are original faces. Faces 2i and 2i + 1 are the two that collapse i removes. In the face's
/// orientation, the first has the corners left child, right child, cut vertex, and the second right
/// child, left child, cut vertex. At a border one of the two is empty. The base mesh's faces
/// follow. The corners of a face are leaves, in the corner order of the source mesh, so that a
/// tracer computes with the same bits as from the source.
///
/// The data are in a builder's arrays or in a mapped file (progressive_mesh_file.h). Of a file,
/// only the parts in use are read. So callers must verify nodes and leaves before they use them
/// (verify_node(), verify_leaf()); the function that returns a tag verifies it. A whole group is
/// verified at once. Roots and the base mesh's faces are always verified.
class ProgressiveMesh {
 public:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  /// How many nodes, leaves or tags are verified at once.
  static constexpr std::uint32_t group = 1024;

  ProgressiveMesh() = default;
  /// Takes arrays that fit together, as a builder makes them. They are not checked.
  ProgressiveMesh(ProgressiveMeshArrays arrays);

  // One element per leaf.
  std::span<const Eigen::Vector3f> points;  ///< local metres
  // One element per inner node.
  std::span<const std::uint32_t> mid;
  std::span<const Sphere> spheres;       ///< around all original faces with a corner in the node
  std::span<const std::uint32_t> order;  ///< the collapse's number: 0 is the first, the finest
  // One element per face: two per inner node, then those of the base mesh.
  std::span<const Face> faces;  ///< three leaves; an empty place has `none` three times
  /// The face's number in the source mesh; `none` for an empty place.
  std::span<const std::uint32_t> source_face;
  // One element per vertex of the base mesh.
  std::span<const std::uint32_t> roots;  ///< the vertex's first leaf; ascending, from 0

  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  Bounds bounds;  ///< of the vertices that faces use

  std::uint32_t leaves() const { return static_cast<std::uint32_t>(points.size()); }
  std::span<const Face> base_faces() const { return faces.subspan(2 * mid.size()); }
  /// Base vertex `root` has the leaves [roots[root], end_of(root)) and the node roots[root] - root.
  std::uint32_t end_of(std::size_t root) const {
    return root + 1 < roots.size() ? roots[root + 1] : leaves();
  }

  /// These were saved in the file (ProgressiveMeshExtras); empty if the mesh is not from a file.
  std::string_view key() const { return key_; }
  std::string_view about() const { return about_; }
  std::size_t tag_count() const { return tags_.size(); }
  /// The tag of a source face below tag_count(). Throws DamagedFile as verify_node does.
  std::uint16_t tag(std::uint32_t source_face_number) const {
    verify(Kind::tag, source_face_number);
    return tags_[source_face_number];
  }

  /// Verifies an inner node and its faces before they are read. Throws DamagedFile, naming the
  /// bytes, if the file was changed after writing or holds what no hierarchy can.
  void verify_node(std::uint32_t node) const { verify(Kind::node, node); }
  /// Verifies a leaf's point.
  void verify_leaf(std::uint32_t leaf) const { verify(Kind::leaf, leaf); }
  /// Verifies everything, for which it reads the whole file.
  void verify_all() const;

  /// Throws DamagedFile for a hierarchy that no builder can have made. The message states that
  /// `what` is wrong at the node or face `number`.
  [[noreturn]] void contradicts(std::string_view what, std::uint32_t number) const;
  /// The leaf at which the right child of a node with the range [lo, hi) begins. The node must have
  /// been verified. Throws DamagedFile unless both children have a leaf.
  std::uint32_t mid_of(std::uint32_t node, std::uint32_t lo, std::uint32_t hi) const {
    const std::uint32_t at = mid[node];
    if (at - lo - 1 >= hi - lo - 1) [[unlikely]]
      contradicts("both children must have leaves, unlike those of node", node);
    return at;
  }

 private:
  class File;  // a mapped file, in progressive_mesh_file.cpp
  friend ProgressiveMesh map_progressive_mesh(const std::filesystem::path& file);
  enum class Kind { node, leaf, tag };
  using Flag = std::atomic<std::uint8_t>;

  explicit ProgressiveMesh(std::shared_ptr<const File> file);

  void make_flags(bool verified);
  void verify(Kind kind, std::uint32_t number) const {
    if (!flags_[static_cast<std::size_t>(kind)][number / group].load(std::memory_order_acquire))
        [[unlikely]]
      verify_group(kind, number / group);
  }
  void verify_group(Kind kind, std::size_t which) const;

  std::shared_ptr<const ProgressiveMeshArrays> arrays_;
  std::shared_ptr<const File> file_;
  std::array<std::shared_ptr<Flag[]>, 3>
      flags_;  // by kind: a flag per group, whether it is verified
  std::span<const std::uint16_t> tags_;
  std::string_view key_, about_;
};

}  // namespace ensonify::refine
