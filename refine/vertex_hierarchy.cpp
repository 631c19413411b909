#include <ensonify/refine/vertex_hierarchy.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/refine/index.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::refine {
namespace {

// A child's number is the number of a collapse, or, with this bit, the number of a vertex.
constexpr Index leaf_bit = Index{1} << 31;

/// The trees that the collapses make. A node has the number of its collapse.
struct Forest {
  struct Node {
    Index left, right;
    Index leaves;  // how many are below the node
  };
  std::vector<Node> nodes;
  std::vector<Index> tops;  // the top node or the only leaf of each tree

  Index leaves_of(Index child) const { return child & leaf_bit ? 1 : nodes[child].leaves; }
};

Forest grow(std::size_t vertices, std::span<const Collapse> collapses) {
  const auto fail = [](std::size_t c, Index vertex) {
    throw std::invalid_argument(fmt::format(
        "lay_out: collapse {} names vertex {}, which does not exist (any more)", c, vertex));
  };
  if (vertices >= leaf_bit)
    throw std::invalid_argument("lay_out: 2^31 vertices or more; split the mesh");
  Forest forest;
  forest.nodes.reserve(collapses.size());
  std::vector<Index> top(vertices);  // the node that stands for a vertex so far
  for (Index v = 0; v < vertices; ++v) top[v] = v | leaf_bit;
  for (std::size_t c = 0; c < collapses.size(); ++c) {
    const auto [kept, removed, left_face, right_face] = collapses[c];
    for (const Index v : {kept, removed})
      if (v >= vertices || top[v] == none) fail(c, v);
    if (kept == removed) fail(c, removed);
    const Index left = std::exchange(top[removed], none), right = top[kept];
    forest.nodes.push_back({left, right, forest.leaves_of(left) + forest.leaves_of(right)});
    top[kept] = static_cast<Index>(c);
  }
  for (const Index t : top)
    if (t != none) forest.tops.push_back(t);
  return forest;
}

/// The leaves [lo, hi) of an inner node, by its preorder number.
struct LeafRange {
  Index lo, hi;
};

/// What lay_out() needs in addition to the result.
struct Numbering {
  std::vector<Index> leaf_of;  // by vertex
  std::vector<LeafRange> ranges;
};

/// Numbers leaves depth-first and inner nodes in preorder; fills points, mid, order, roots, and the
/// two source faces of each inner node.
Numbering number_nodes(const TriangleMesh& in, std::span<const Collapse> collapses,
                       const Forest& forest, ProgressiveMeshArrays& out) {
  const std::size_t inner = forest.nodes.size();
  Numbering layout{std::vector<Index>(in.positions.size()), std::vector<LeafRange>(inner)};
  out.points.resize(in.positions.size());
  out.mid.resize(inner);
  out.order.resize(inner);
  out.source_face.assign(2 * inner, none);

  std::vector<Index> first_leaf(inner), number(inner);  // by collapse; set by the parent
  const auto place = [&](Index child, Index lo, Index node) {
    if (child & leaf_bit) {
      layout.leaf_of[child ^ leaf_bit] = lo;
      out.points[lo] = in.positions[child ^ leaf_bit];
    } else {
      first_leaf[child] = lo;
      number[child] = node;
    }
  };
  Index leaf = 0;
  for (const Index top : forest.tops) {
    place(top, leaf, leaf - static_cast<Index>(out.roots.size()));
    out.roots.push_back(leaf);
    leaf += forest.leaves_of(top);
  }
  for (std::size_t c = inner; c-- > 0;) {
    const auto [left, right, leaves] = forest.nodes[c];
    const Index lo = first_leaf[c], node = number[c], mid = lo + forest.leaves_of(left);
    layout.ranges[node] = {lo, lo + leaves};
    out.mid[node] = mid;
    out.order[node] = static_cast<Index>(c);
    out.source_face[2 * std::size_t{node}] = collapses[c].left_face;
    out.source_face[2 * std::size_t{node} + 1] = collapses[c].right_face;
    place(left, lo, node + 1);
    place(right, mid, node + (mid - lo));
  }
  return layout;
}

/// Appends the base mesh's faces to source_face, and fills `faces`, with leaves as corners.
void place_faces(const TriangleMesh& in, const Numbering& layout, int threads,
                 ProgressiveMeshArrays& out) {
  std::vector<bool> seen(in.faces.size(), false);
  for (const Index f : out.source_face) {
    if (f == none) continue;
    if (f >= in.faces.size() || seen[f])
      throw std::invalid_argument(
          fmt::format("lay_out: a collapse removes face {}, which does not exist (any more)", f));
    seen[f] = true;
  }
  for (Index f = 0; f < in.faces.size(); ++f)
    if (!seen[f]) out.source_face.push_back(f);
  out.faces.resize(out.source_face.size());
  for_parts(out.faces.size(), threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const Index f = out.source_face[slot];
      Face& face = out.faces[slot] = {none, none, none};
      for (std::size_t k = 0; f != none && k < 3; ++k) {
        const Index vertex = in.faces[f][k];
        if (vertex >= layout.leaf_of.size())
          throw std::invalid_argument(
              fmt::format("lay_out: face {} names vertex {}, which does not exist", f, vertex));
        face[k] = layout.leaf_of[vertex];
      }
    }
  });
}

/// Computes the nodes' spheres from the leaves up. A centre is the middle of the box around the
/// closed stars of the node's leaves. A radius is the distance of the farthest corner. To find it,
/// only those children are searched whose spheres reach farther than the farthest corner so far.
class SphereMaker {
 public:
  SphereMaker(const ProgressiveMeshArrays& mesh, const std::vector<LeafRange>& ranges, int threads)
      : mesh_(mesh),
        ranges_(ranges),
        threads_(threads),
        star_begin_(mesh.points.size() + 2, 0),
        star_radius_(mesh.points.size()),
        spheres_(ranges.size()) {
    find_stars();
  }

  /// Makes all spheres. Threads do subtrees; after that, the nodes above the subtrees are done.
  std::vector<Sphere> make() {
    std::vector<Index> subtrees, above;  // in preorder
    for (Index node = 0; node < ranges_.size();) {
      const Index leaves = ranges_[node].hi - ranges_[node].lo;
      (leaves <= leaves_at_once ? subtrees : above).push_back(node);
      node += leaves <= leaves_at_once ? leaves - 1 : 1;
    }
    std::vector<Box> boxes(subtrees.size());
    parallel_for(subtrees.size(), threads_, [&](std::size_t i, int) {
      Sweep sweep;
      const LeafRange range = ranges_[subtrees[i]];
      for (Index node = subtrees[i] + (range.hi - range.lo - 1); node-- > subtrees[i];)
        place(node, sweep);
      boxes[i] = sweep.boxes.back();
    });
    Sweep sweep;
    for (std::size_t a = above.size(), i = subtrees.size(); a > 0 || i > 0;)
      if (i > 0 && (a == 0 || subtrees[i - 1] > above[a - 1]))
        sweep.boxes.push_back(boxes[--i]);
      else
        place(above[--a], sweep);
    return std::move(spheres_);
  }

 private:
  using Box = Eigen::AlignedBox3f;
  /// The state while nodes are placed in descending order of numbers. The last box is that of a
  /// node's left child, unless this is a leaf; the box before it is that of the right child.
  struct Sweep {
    std::vector<Box> boxes;  // of the placed nodes whose parents are not placed yet
    std::vector<Index> pending;
  };

  static constexpr Index leaves_at_once = 4096;
  // A sphere may be 1 % larger than necessary, because this avoids searches. After longest_way
  // nodes the search takes the children's reach, as in a tree that is only a chain.
  static constexpr double tolerance = 1.01;
  static constexpr int longest_way = 256;

  static float inflated(double radius) {
    return std::nextafter(static_cast<float>(radius), std::numeric_limits<float>::infinity());
  }

  void place(Index node, Sweep& sweep) {
    const auto [lo, hi] = ranges_[node];
    const auto take = [&](Index first, Index end) {
      if (end - first == 1) return star_box(first);
      const Box box = sweep.boxes.back();
      sweep.boxes.pop_back();
      return box;
    };
    const Box left = take(lo, mesh_.mid[node]), right = take(mesh_.mid[node], hi);
    const Box box = left.merged(right);
    const Eigen::Vector3f centre = 0.5f * (box.min() + box.max());
    spheres_[node] = {centre, inflated(farthest(node, centre.cast<double>(), sweep.pending))};
    sweep.boxes.push_back(box);
  }

  /// Lists for each leaf the other corners of its faces. Most of them are in the list twice.
  void find_stars() {
    const std::size_t leaves = mesh_.points.size();
    const auto for_each_corner = [&](std::size_t begin, std::size_t end, const auto& visit) {
      for (const Face& face : mesh_.faces)
        for (std::size_t k = 0; k < 3; ++k)
          if (face[k] - begin < end - begin) visit(face, k);
    };
    for_parts(leaves, threads_, [&](std::size_t begin, std::size_t end) {
      for_each_corner(begin, end,
                      [&](const Face& face, std::size_t k) { star_begin_[face[k] + 2] += 2; });
    });
    for (std::size_t l = 0; l < leaves; ++l) star_begin_[l + 2] += star_begin_[l + 1];
    star_.resize(star_begin_.back());
    // During filling, a star's present end is stored in the place for the next star's start.
    for_parts(leaves, threads_, [&](std::size_t begin, std::size_t end) {
      for_each_corner(begin, end, [&](const Face& face, std::size_t k) {
        star_[star_begin_[face[k] + 1]++] = face[(k + 1) % 3];
        star_[star_begin_[face[k] + 1]++] = face[(k + 2) % 3];
      });
    });
    for_parts(leaves, threads_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t l = begin; l < end; ++l)
        star_radius_[l] =
            inflated(star_distance(static_cast<Index>(l), mesh_.points[l].cast<double>()));
    });
  }
  std::span<const Index> star(Index leaf) const {
    return std::span(star_).subspan(star_begin_[leaf], star_begin_[leaf + 1] - star_begin_[leaf]);
  }
  Box star_box(Index leaf) const {
    Box box(mesh_.points[leaf]);
    for (const Index other : star(leaf)) box.extend(mesh_.points[other]);
    return box;
  }
  double star_distance(Index leaf, const Eigen::Vector3d& from) const {
    double farthest2 = (mesh_.points[leaf].cast<double>() - from).squaredNorm();
    for (const Index other : star(leaf))
      farthest2 = std::max(farthest2, (mesh_.points[other].cast<double>() - from).squaredNorm());
    return std::sqrt(farthest2);
  }

  /// A distance from `from` that no corner below a node exceeds. Its children must be placed
  /// already.
  double farthest(Index top, const Eigen::Vector3d& from, std::vector<Index>& pending) const {
    double found = 0.0, passed = 0.0;
    pending.assign({top});
    for (int visited = 0; !pending.empty(); ++visited) {
      const Index node = pending.back();
      pending.pop_back();
      const auto [lo, hi] = ranges_[node];
      const Index mid = mesh_.mid[node];
      const auto visit = [&](Index child, Index first, Index end) {
        const bool is_leaf = end - first == 1;
        const double bound =
            is_leaf
                ? (mesh_.points[first].cast<double>() - from).norm() + star_radius_[first]
                : (spheres_[child].centre.cast<double>() - from).norm() + spheres_[child].radius;
        if (bound <= tolerance * found || visited >= longest_way)
          passed = std::max(passed, bound);
        else if (is_leaf)
          found = std::max(found, star_distance(first, from));
        else
          pending.push_back(child);
      };
      visit(node + 1, lo, mid);
      visit(node + (mid - lo), mid, hi);
    }
    return std::max(found, passed);
  }

  const ProgressiveMeshArrays& mesh_;
  const std::vector<LeafRange>& ranges_;
  const int threads_;
  std::vector<std::uint64_t> star_begin_;
  std::vector<Index> star_;
  std::vector<float> star_radius_;
  std::vector<Sphere> spheres_;
};

}  // namespace

ProgressiveMeshArrays lay_out(const TriangleMesh& mesh, std::span<const Collapse> collapses,
                              int threads) {
  ProgressiveMeshArrays out{.world_origin = mesh.world_origin};
  Numbering layout = number_nodes(mesh, collapses, grow(mesh.positions.size(), collapses), out);
  place_faces(mesh, layout, threads, out);
  layout.leaf_of = {};
  out.spheres = SphereMaker(out, layout.ranges, threads).make();
  return out;
}

}  // namespace ensonify::refine
