#include <ensonify/refine/tile_collapse.h>

#include <algorithm>
#include <atomic>
#include <queue>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/refine/index.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/vertex_hierarchy.h>

namespace ensonify::refine {
namespace {

// The data of so few vertices stay in a core's own cache. The vertices at a tile's border, which
// must wait for the next stage, are only a small part of so many.
constexpr std::size_t vertices_per_tile = 2048;

Index next(Index half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }
Index previous(Index half_edge) { return half_edge % 3 == 0 ? half_edge + 2 : half_edge - 1; }

/// The mesh while it is collapsed. Half-edge 3f + k leads from face f's corner k to the next.
struct HalfEdges {
  struct Vertex {
    Eigen::AlignedBox3f box;  ///< around the closed stars of all vertices that it stands for
    /// A half-edge that starts at the vertex (at a border, the first of its fan); none: it was
    /// removed.
    Index half_edge = none;
    Index mark = 0;
  };
  std::vector<Vertex> vertices;
  std::vector<Index> start;     ///< by half-edge; none in a removed face
  std::vector<Index> opposite;  ///< by half-edge; none at a border

  Index from(Index half_edge) const { return start[half_edge]; }
  Index to(Index half_edge) const { return start[next(half_edge)]; }

  /// Calls visit(half_edge) for those that start at a vertex, counter-clockwise. If the fan is
  /// open, returns the last face's half-edge that ends at the vertex, otherwise none.
  template <class Visit>
  Index walk(Index vertex, Visit visit) const {
    const Index first = vertices[vertex].half_edge;
    for (Index h = first;;) {
      visit(h);
      const Index last = previous(h);
      h = opposite[last];
      if (h == none) return last;
      if (h == first) return none;
    }
  }
  /// Calls visit(neighbour) for a vertex's neighbours; returns whether the vertex is at a border.
  template <class Visit>
  bool walk_ring(Index vertex, Visit visit) const {
    const Index last = walk(vertex, [&](Index h) { visit(to(h)); });
    if (last != none) visit(from(last));
    return last != none;
  }
};

[[noreturn]] void refuse_mesh(Index half_edge, std::string_view what) {
  throw MeshError(
      fmt::format("face {} of the mesh {}; repair the mesh first", half_edge / 3, what));
}

/// Joins opposite half-edges whose lower vertex is in [begin, end). Sorts them by their lower
/// vertex, then by their higher vertex.
void find_opposites(HalfEdges& mesh, Index begin, Index end) {
  std::vector<Index> bucket(end - begin + 2, 0), half_edges;
  const auto for_each = [&](auto visit) {
    for (Index h = 0; h < mesh.start.size(); ++h)
      if (const Index v = std::min(mesh.from(h), mesh.to(h)) - begin; v < end - begin) visit(v, h);
  };
  for_each([&](Index v, Index) { ++bucket[v + 2]; });
  for (std::size_t v = 1; v < bucket.size(); ++v) bucket[v] += bucket[v - 1];
  half_edges.resize(bucket.back());
  for_each([&](Index v, Index h) { half_edges[bucket[v + 1]++] = h; });
  std::vector<std::pair<Index, Index>> edges;  // at one vertex: higher end, half-edge
  for (Index v = 0; v < end - begin; ++v) {
    edges.clear();
    for (Index i = bucket[v]; i < bucket[v + 1]; ++i)
      edges.emplace_back(std::max(mesh.from(half_edges[i]), mesh.to(half_edges[i])), half_edges[i]);
    std::ranges::sort(edges);
    for (std::size_t i = 1; i < edges.size(); ++i) {
      if (edges[i].first != edges[i - 1].first) continue;
      const Index h = edges[i].second, other = edges[i - 1].second;
      if (mesh.from(h) == mesh.from(other) || mesh.opposite[other] != none)
        refuse_mesh(
            h, fmt::format(
                   "shares the edge of vertices {} and {} with face {} and with others, or has "
                   "the opposite orientation",
                   mesh.from(h), mesh.to(h), other / 3));
      mesh.opposite[h] = other;
      mesh.opposite[other] = h;
    }
  }
}

/// Throws MeshError unless the faces of each vertex are one fan.
void check_fans(const HalfEdges& mesh, int threads) {
  std::atomic<std::size_t> walked = 0;
  for_parts(mesh.vertices.size(), threads, [&](Index begin, Index end) {
    std::size_t count = 0;
    for (Index v = begin; v < end; ++v)
      if (mesh.vertices[v].half_edge != none) mesh.walk(v, [&](Index) { ++count; });
    walked += count;
  });
  if (walked == mesh.start.size()) return;
  std::vector<bool> seen(mesh.start.size(), false);
  for (Index v = 0; v < mesh.vertices.size(); ++v)
    if (mesh.vertices[v].half_edge != none) mesh.walk(v, [&](Index h) { seen[h] = true; });
  const auto h = static_cast<Index>(std::ranges::find(seen, false) - seen.begin());
  refuse_mesh(
      h, fmt::format("meets others at vertex {} that share no edge with its fan", mesh.from(h)));
}

HalfEdges half_edges(const TriangleMesh& in, int threads) {
  if (in.faces.size() > none / 3)
    throw MeshError("the mesh has more faces than 32 bits can number half-edges; split it");
  HalfEdges mesh;
  mesh.vertices.resize(in.positions.size());
  mesh.start.resize(3 * in.faces.size());
  mesh.opposite.resize(3 * in.faces.size(), none);
  for_parts(in.faces.size(), threads, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f)
      for (Index k = 0; k < 3; ++k) {
        const Index v = in.faces[f][k];
        if (v >= in.positions.size())
          refuse_mesh(3 * f, fmt::format("names vertex {}, which does not exist", v));
        if (!in.positions[v].allFinite())
          refuse_mesh(3 * f, fmt::format("names vertex {}, whose position is not finite", v));
        if (v == in.faces[f][(k + 1) % 3])
          refuse_mesh(3 * f, fmt::format("has vertex {} twice", v));
        mesh.start[3 * f + k] = v;
      }
  });
  for_parts(in.positions.size(), threads,
            [&](Index begin, Index end) { find_opposites(mesh, begin, end); });
  for (Index h = 0; h < mesh.start.size(); ++h)
    if (Index& first = mesh.vertices[mesh.start[h]].half_edge;
        first == none || mesh.opposite[h] == none)
      first = h;
  check_fans(mesh, threads);
  return mesh;
}

/// A part of the mesh in one stage.
struct CollapseTile {
  std::vector<Index> vertices;  ///< the remaining vertices
  std::size_t leaves = 0;       ///< how many vertices it had at first
  Index mark = 0;               ///< the highest mark used in it
};

/// Divides the vertices that faces use into 4^n tiles of equal size, by repeatedly halving them
/// across the longest side. Tiles 4i to 4i + 3 are the quarters of tile i of the stage before.
std::vector<CollapseTile> partition(const TriangleMesh& in, const HalfEdges& mesh, int threads) {
  struct Place {
    Eigen::Vector3f position;
    Index vertex;
  };
  std::vector<Place> places;
  places.reserve(in.positions.size());
  for (Index v = 0; v < in.positions.size(); ++v)
    if (mesh.vertices[v].half_edge != none) places.push_back({in.positions[v], v});
  int depth = 0;
  while (places.size() >> depth > vertices_per_tile) depth += 2;
  const auto bound = [&](std::size_t tile, int level) {
    return places.begin() + static_cast<std::ptrdiff_t>(places.size() * tile >> level);
  };
  for (int level = 0; level < depth; ++level)
    parallel_for(std::size_t{1} << level, threads, [&](std::size_t tile, int) {
      const auto begin = bound(tile, level), end = bound(tile + 1, level);
      Eigen::AlignedBox3f box;
      for (auto place = begin; place != end; ++place) box.extend(place->position);
      Eigen::Index side = 0;
      box.sizes().maxCoeff(&side);
      std::nth_element(
          begin, bound(2 * tile + 1, level + 1), end, [side](const Place& a, const Place& b) {
            return a.position[side] != b.position[side] ? a.position[side] < b.position[side]
                                                        : a.vertex < b.vertex;
          });
    });
  std::vector<CollapseTile> tiles(std::size_t{1} << depth);
  parallel_for(tiles.size(), threads, [&](std::size_t tile, int) {
    for (auto place = bound(tile, depth); place != bound(tile + 1, depth); ++place)
      tiles[tile].vertices.push_back(place->vertex);
    std::ranges::sort(tiles[tile].vertices);
    tiles[tile].leaves = tiles[tile].vertices.size();
  });
  return tiles;
}

/// Collapses edges inside one tile. Vertices that have a neighbour in another tile are locked: they
/// are not touched, so tiles cannot affect each other.
class TileCollapser {
 public:
  TileCollapser(const TriangleMesh& in, HalfEdges& mesh, std::vector<std::uint8_t>& locked,
                CollapseTile& tile)
      : in_(in), mesh_(mesh), locked_(locked), tile_(tile) {
    for (const Index v : tile.vertices) left_ += !locked[v];
  }

  /// Collapses until at most `target` unlocked vertices are left, or no edge can be collapsed.
  std::vector<Collapse> run(std::size_t target) {
    // Collapses that were not allowed are tried again after all others, which may free them.
    for (std::size_t before = left_ + 1; left_ < before && left_ > target;) {
      before = left_;
      offer_all();
      while (!offers_.empty() && left_ > target) take_best();
    }
    std::erase_if(tile_.vertices, [&](Index v) { return mesh_.vertices[v].half_edge == none; });
    return std::move(collapses_);
  }

 private:
  /// A possible collapse. Costs only grow, so the cost in an offer is at most the present cost.
  struct Offer {
    float cost;
    Index half_edge;
    bool operator<(const Offer& other) const {  // for the queue: whether this offer is worse
      return cost != other.cost ? cost > other.cost : half_edge > other.half_edge;
    }
  };

  Eigen::AlignedBox3f merged_box(Index half_edge) const {
    return mesh_.vertices[mesh_.from(half_edge)].box.merged(
        mesh_.vertices[mesh_.to(half_edge)].box);
  }
  float cost(Index half_edge) const { return merged_box(half_edge).sizes().squaredNorm(); }

  /// If the first vertex is locked, the second may be in another tile, and is not read.
  bool may_touch(Index half_edge) const {
    return !locked_[mesh_.from(half_edge)] && !locked_[mesh_.to(half_edge)];
  }
  void offer(Index half_edge) {
    if (may_touch(half_edge)) offers_.push({cost(half_edge), half_edge});
  }
  void offer_all() {
    std::vector<Offer> offers;
    for (const Index v : tile_.vertices) {
      if (mesh_.vertices[v].half_edge == none) continue;
      mesh_.walk(v, [&](Index h) {
        if ((v < mesh_.to(h) || mesh_.opposite[h] == none) && may_touch(h))
          offers.push_back({cost(h), h});
      });
    }
    offers_ = std::priority_queue<Offer>({}, std::move(offers));
  }

  void take_best() {
    const auto [cost_then, half_edge] = offers_.top();
    offers_.pop();
    if (mesh_.from(half_edge) == none) return;
    if (cost(half_edge) > cost_then)
      offer(half_edge);
    else if (is_allowed(half_edge))
      collapse(half_edge);
  }

  /// OpenMesh's is_collapse_ok, and: a tetrahedron must not become two coincident faces.
  bool is_allowed(Index half_edge) {
    const Index a = mesh_.from(half_edge), b = mesh_.to(half_edge);
    const Index back = mesh_.opposite[half_edge];
    const auto hangs = [&](Index h) {
      return mesh_.opposite[next(h)] == none && mesh_.opposite[previous(h)] == none;
    };
    if (hangs(half_edge) || (back != none && hangs(back))) return false;
    const Index mark = ++tile_.mark;
    int at_a = 0, at_b = 0, common = 0;
    const bool a_at_border = mesh_.walk_ring(a, [&](Index v) {
      mesh_.vertices[v].mark = mark;
      ++at_a;
    });
    const bool b_at_border = mesh_.walk_ring(b, [&](Index v) {
      common += mesh_.vertices[v].mark == mark;
      ++at_b;
    });
    if (common != (back == none ? 1 : 2)) return false;
    if (back != none && a_at_border && b_at_border) return false;
    return a_at_border || b_at_border || at_a > 3 || at_b > 3;
  }

  void join(Index a, Index b) {
    if (a != none) mesh_.opposite[a] = b;
    if (b != none) mesh_.opposite[b] = a;
  }

  /// Whether the half-edge's start is kept. If only one end is at the mesh's border, this end is
  /// kept, otherwise the end that is nearer to the middle of the merged box.
  bool keeps_start(Index half_edge) const {
    const Index a = mesh_.from(half_edge), b = mesh_.to(half_edge);
    const auto at_border = [&](Index v) {
      return mesh_.opposite[mesh_.vertices[v].half_edge] == none;
    };
    if (at_border(a) != at_border(b)) return at_border(a);
    const Eigen::Vector3f middle = merged_box(half_edge).center();
    return (in_.positions[a] - middle).squaredNorm() < (in_.positions[b] - middle).squaredNorm();
  }

  void collapse(Index half_edge) {
    const Index back = mesh_.opposite[half_edge];
    const auto face_of = [](Index h) { return h == none ? none : h / 3; };
    Collapse found = {.kept = mesh_.to(half_edge),
                      .removed = mesh_.from(half_edge),
                      .left_face = face_of(half_edge),
                      .right_face = face_of(back)};
    if (keeps_start(half_edge)) {
      std::swap(found.kept, found.removed);
      std::swap(found.left_face, found.right_face);
    }
    const auto [kept, removed, left_face, right_face] = collapses_.emplace_back(found);

    // The merged fan begins where an open one of the two fans began, or after a vanishing face.
    Index first = mesh_.opposite[previous(half_edge)];
    for (const Index v : {kept, removed}) {
      const Index h = mesh_.vertices[v].half_edge;
      if (mesh_.opposite[h] != none || h == half_edge) continue;
      first = back != none && h / 3 == back / 3 ? mesh_.opposite[previous(back)]
              : h / 3 == half_edge / 3          ? mesh_.opposite[previous(half_edge)]
                                                : h;
    }
    leaving_.clear();
    mesh_.walk(removed, [&](Index h) { leaving_.push_back(h); });
    for (const Index h : leaving_) mesh_.start[h] = kept;
    mesh_.vertices[kept].half_edge = first;
    mesh_.vertices[kept].box.extend(mesh_.vertices[removed].box);
    mesh_.vertices[removed].half_edge = none;
    --left_;
    for (const Index across : {half_edge, back}) {
      if (across == none) continue;
      const Index cut = mesh_.from(previous(across));
      const Index in = mesh_.opposite[next(across)], out = mesh_.opposite[previous(across)];
      join(in, out);
      if (mesh_.vertices[cut].half_edge / 3 == across / 3) mesh_.vertices[cut].half_edge = in;
      std::fill_n(mesh_.start.begin() + across / 3 * 3, 3, none);
      offer(in != none ? in : out);  // two edges became one, whose only offer may be gone
    }
  }

  const TriangleMesh& in_;
  HalfEdges& mesh_;
  std::vector<std::uint8_t>& locked_;
  CollapseTile& tile_;
  std::size_t left_ = 0;  // how many of the tile's vertices are not locked
  std::priority_queue<Offer> offers_;
  std::vector<Index> leaving_;
  std::vector<Collapse> collapses_;
};

}  // namespace

ProgressiveMeshArrays build_by_tiles(const TriangleMesh& in, int threads, Borders borders,
                                     const std::function<void()>& stop_check) {
  const auto check_stop = [&] {
    if (stop_check) stop_check();
  };
  HalfEdges mesh = half_edges(in, threads);
  check_stop();
  std::vector<CollapseTile> tiles = partition(in, mesh, threads);

  std::vector<Index> tile_of(in.positions.size(), none);
  std::vector<std::uint8_t> locked(in.positions.size());
  parallel_for(tiles.size(), threads, [&](std::size_t tile, int) {
    for (const Index v : tiles[tile].vertices) {
      tile_of[v] = static_cast<Index>(tile);
      Eigen::AlignedBox3f& box = mesh.vertices[v].box;
      box.extend(in.positions[v]);
      mesh.walk_ring(v, [&](Index other) { box.extend(in.positions[other]); });
    }
  });
  std::vector<Collapse> collapses;
  collapses.reserve(in.positions.size());
  for (int stage = 0;; ++stage) {
    std::vector<std::vector<Collapse>> found(tiles.size());
    parallel_for(tiles.size(), threads, [&](std::size_t tile, int) {
      check_stop();
      for (const Index v : tiles[tile].vertices) {
        locked[v] = 0;
        const bool at_border = mesh.walk_ring(
            v, [&](Index other) { locked[v] |= tile_of[other] >> 2 * stage != tile; });
        locked[v] |= at_border && borders == Borders::stay;
      }
      // Each tile is reduced to a quarter. So four merged tiles are as large as one tile before,
      // except for vertices at borders.
      const std::size_t target = tiles.size() == 1 ? 0 : tiles[tile].leaves >> 2 * (stage + 1);
      found[tile] = TileCollapser(in, mesh, locked, tiles[tile]).run(target);
    });
    for (const auto& f : found) collapses.insert(collapses.end(), f.begin(), f.end());
    if (tiles.size() == 1) break;
    std::vector<CollapseTile> merged(tiles.size() / 4);
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
      CollapseTile& into = merged[tile / 4];
      into.vertices.insert(into.vertices.end(), tiles[tile].vertices.begin(),
                           tiles[tile].vertices.end());
      into.leaves += tiles[tile].leaves;
      into.mark = std::max(into.mark, tiles[tile].mark);
    }
    tiles = std::move(merged);
  }
  mesh = {};
  check_stop();
  return lay_out(in, collapses, threads);
}

ProgressiveMeshArrays build_of_any_mesh(const TriangleMesh& in, int threads, Borders borders,
                                        const std::function<void()>& stop_check) {
  try {
    return build_by_tiles(in, threads, borders, stop_check);
  } catch (const MeshError&) {
    // The mesh is not manifold. Only then it is repaired, because this takes as long as the build.
    // Heightfields need no repair.
    const RepairedMesh manifold = repair(in, -1.0);
    ProgressiveMeshArrays built = build_by_tiles(manifold.mesh, threads, borders, stop_check);
    for (Index& face : built.source_face)
      if (face != none) face = manifold.source_face[face];
    return built;
  }
}

}  // namespace ensonify::refine
