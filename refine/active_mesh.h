#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// What one refinement did.
struct RefineStatistics {
  std::size_t splits = 0;
  std::size_t forced_splits = 0;      ///< of the splits: to separate two cut vertices that were one
  std::size_t unblocking_splits = 0;  ///< of the splits: to allow a collapse that was blocked
  std::size_t collapses = 0;
  std::size_t blocked_collapses = 0;  ///< wanted, but still blocked
};

/// One worker's selectively refined mesh over a progressive mesh, for all its sonars (Kim & Lee,
/// "Truly selective refinement of progressive meshes", 2001): split where a node's sphere can touch
/// a fan volume, and coarse elsewhere. Each active face is an original face whose three corners
/// have distinct active ancestors. If all three ancestors are leaves, the active face equals the
/// original face: it is exact. The exact faces include all that the volumes can touch.
class ActiveMesh {
 public:
  static constexpr std::uint32_t none = ProgressiveMesh::none;

  /// An active vertex, or a split node above active vertices. It covers the leaves [lo, hi).
  /// Siblings are adjacent, the left one first. Unused elements are neither active nor split.
  struct Node {
    std::uint32_t lo = 0, hi = 0;
    std::uint32_t number = none;  ///< of an inner node in the progressive mesh
    std::uint32_t parent = none;  ///< index in nodes()
    std::uint32_t left = none;    ///< index of its left child in nodes(), once it is split
    /// A half-edge that starts at this active vertex; at a border, the first one of its fan.
    std::uint32_t half_edge = none;

    bool is_leaf() const { return hi - lo == 1; }
    bool is_active() const { return (hi != 0) & (left == none); }
    bool covers(std::uint32_t leaf) const { return leaf - lo < hi - lo; }
  };

  /// An active face; unused if `slot` is none. Half-edge 4f + k leads from corner k of face f to
  /// the next corner, with the face on its left.
  struct ActiveFace {
    std::array<std::uint32_t, 3> vertices;   ///< indices in nodes(), by corner
    std::array<std::uint32_t, 3> opposites;  ///< opposite half-edges; none at a border
    std::uint32_t slot = none;               ///< the original face's index in the progressive mesh
    std::uint32_t source = none;             ///< the original face's number in the source mesh
  };

  /// Starts as the base mesh. The progressive mesh must outlive this object. Every function that
  /// reads a further part of the progressive mesh throws DamagedFile if its file is damaged or
  /// contradicts itself. After that, only reset() and the destructor may be called.
  explicit ActiveMesh(const ProgressiveMesh& mesh);
  explicit ActiveMesh(ProgressiveMesh&&) = delete;

  /// Returns to the base mesh; keeps the memory.
  void reset();

  /// Splits all nodes that the volumes touch and collapses those that no volume touches. Allocates
  /// no memory in a steady state. Throws std::invalid_argument as ViewTest does.
  RefineStatistics refine(std::span<const FanVolume> volumes);

  /// The faces that are exact now, ascending in source_faces; valid until the second change from
  /// now.
  ExactFaces exact_faces() const;

  /// Splits one active vertex. If its two cut vertices are still one vertex, first splits that
  /// vertex. Throws std::invalid_argument if nodes()[vertex] is not an active inner node.
  void vsplit(std::uint32_t vertex);

  /// Merges the two active children of a split node into one vertex again. First splits nodes that
  /// block this and were collapsed later in the progressive mesh. If other nodes block it, changes
  /// nothing and returns false. Throws std::invalid_argument if nodes()[node] has no two active
  /// children.
  bool ecol(std::uint32_t node);

  std::size_t vertex_count() const { return vertex_count_; }
  std::size_t face_count() const { return faces_.size() - free_faces_.size(); }

  std::span<const Node> nodes() const { return nodes_; }
  std::span<const ActiveFace> faces() const { return faces_; }
  const ProgressiveMesh& progressive_mesh() const { return *mesh_; }
  /// An active vertex's position, local metres: the position of the leaf that its collapses kept.
  const Eigen::Vector3f& position(std::uint32_t vertex) const {
    mesh_->verify_leaf(nodes_[vertex].hi - 1);
    return mesh_->points[nodes_[vertex].hi - 1];
  }

 private:
  /// half_edges: those that start at a vertex, counter-clockwise. ring: the vertices at their ends,
  /// then the last face's third corner, which is the first of them again if the fan is closed.
  struct Fan {
    std::vector<std::uint32_t> half_edges, ring;
    bool open = false;
  };
  /// One of the two faces that a split makes and a collapse removes. Its corners are both children
  /// and the cut vertex. `in` and `out` are half-edges of the faces beside it, from the cut vertex
  /// to a child and from a child to the cut vertex. They are opposite while this face does not
  /// exist.
  struct Fundamental {
    std::uint32_t face = none;  // none: there is no such face, at a border
    std::uint32_t cut = none;
    std::uint32_t in = none, out = none;
  };

  /// Makes a Node, after verifying its number, unless it is a leaf.
  Node node_over(std::uint32_t number, std::uint32_t lo, std::uint32_t hi,
                 std::uint32_t parent) const;
  void check_base() const;
  std::uint32_t from(std::uint32_t half_edge) const {
    return faces_[half_edge / 4].vertices[half_edge % 4];
  }
  std::uint32_t& opposite(std::uint32_t half_edge) {
    return faces_[half_edge / 4].opposites[half_edge % 4];
  }
  void join(std::uint32_t a, std::uint32_t b);
  void walk(std::uint32_t vertex, Fan& fan) const;
  bool all_leaves(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return nodes_[a].is_leaf() && nodes_[b].is_leaf() && nodes_[c].is_leaf();
  }

  void split(std::uint32_t vertex);
  std::uint32_t try_split(std::uint32_t vertex);
  std::uint32_t make_children(std::uint32_t vertex);
  std::uint32_t make_face(std::uint32_t slot);

  bool collapse(std::uint32_t node);
  bool is_free(std::uint32_t node);
  void check_collapse(std::uint32_t node) const;
  void merge_children(std::uint32_t node);

  bool touches(const Node& node) const { return view_.touches(mesh_->spheres[node.number]); }
  bool has_two_active(std::uint32_t node) const {
    const std::uint32_t left = nodes_[node].left;
    return left != none && nodes_[left].is_active() && nodes_[left + 1].is_active();
  }
  void find_fronts();
  void split_touched();
  void collapse_offered();
  void offer(std::uint32_t node);
  void settle_exact();

  const ProgressiveMesh* mesh_;
  std::vector<Node> nodes_, base_nodes_;
  std::vector<ActiveFace> faces_, base_faces_;
  std::vector<std::uint32_t> free_children_, free_faces_;
  std::size_t vertex_count_ = 0;

  std::vector<Face> exact_faces_, next_exact_faces_;
  std::vector<std::uint32_t> exact_sources_, next_exact_sources_;
  // Changes of the exact faces, packed: source face, and slot, or `none` for a removed face.
  std::vector<std::uint64_t> changes_, spare_changes_;

  // Buffers that are used within one change.
  ViewTest view_;
  RefineStatistics statistics_;
  std::array<Fan, 2> fans_;
  std::array<Fundamental, 2> doomed_;
  std::vector<std::uint32_t> marks_;  // by vertex: number of the last collapse with it in a ring
  std::uint32_t mark_ = 0;
  std::vector<std::uint32_t> forcing_, blockers_, touched_, opened_, offers_, waiting_, twins_,
      inner_;
};

}  // namespace ensonify::refine
