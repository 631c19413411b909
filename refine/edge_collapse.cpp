#include <ensonify/refine/edge_collapse.h>

#include <algorithm>
#include <array>
#include <compare>
#include <queue>
#include <string_view>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
// After the header above, which it needs.
#include <OpenMesh/Core/Geometry/QuadricT.hh>
#include <fmt/format.h>

#include <ensonify/refine/vertex_hierarchy.h>

namespace ensonify::refine {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;
using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;
using Quadric = OpenMesh::Geometry::Quadricd;

// The quadric of a vertex is the sum for the planes of its faces, and a term for its own place,
// with this share of their weight. On a level bed all planes are equal, and only this term keeps
// collapses short, and trees compact and balanced.
constexpr double weight_of_place = 1e-2;

VertexHandle vertex(std::uint32_t number) { return VertexHandle(static_cast<int>(number)); }
std::uint32_t number(VertexHandle v) { return static_cast<std::uint32_t>(v.idx()); }
std::uint32_t number(FaceHandle f) {
  return f.is_valid() ? static_cast<std::uint32_t>(f.idx()) : ProgressiveMesh::none;
}

/// Throws unless each edge has one face, or two in opposite directions, and the faces of each
/// vertex are one fan. Half-edge 3f + k leads from corner k of face f to the next corner.
void check_manifold(const TriangleMesh& mesh) {
  const auto fail = [](std::size_t half_edge, std::string_view what) {
    throw MeshError(
        fmt::format("face {} of the mesh {}; repair the mesh first", half_edge / 3, what));
  };
  struct Edge {
    std::uint64_t ends;  // lower vertex in the high half, higher vertex in the low half
    std::uint32_t half_edge;
    auto operator<=>(const Edge&) const = default;
  };
  const std::size_t half_edges = 3 * mesh.faces.size();
  const auto start = [&](std::size_t h) { return mesh.faces[h / 3][h % 3]; };
  const auto next = [](std::size_t h) { return h % 3 == 2 ? h - 2 : h + 1; };
  std::vector<Edge> edges;
  edges.reserve(half_edges);
  for (std::size_t h = 0; h < half_edges; ++h) {
    const std::uint64_t a = start(h), b = start(next(h));
    if (a >= mesh.positions.size())
      fail(h, fmt::format("names vertex {}, which does not exist", a));
    if (a == b) fail(h, fmt::format("has vertex {} twice", a));
    edges.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<std::uint32_t>(h)});
  }
  std::ranges::sort(edges);
  std::vector<std::uint32_t> opposite(half_edges, ProgressiveMesh::none);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (edges[i].ends != edges[i - 1].ends) continue;
    const std::uint32_t h = edges[i].half_edge, other = edges[i - 1].half_edge;
    if (start(h) == start(other) || opposite[other] != ProgressiveMesh::none)
      fail(h,
           fmt::format("shares the edge of vertices {} and {} with face {} and with others, or has "
                       "the opposite orientation",
                       start(h), start(next(h)), other / 3));
    opposite[h] = other;
    opposite[other] = h;
  }
  // Counts the faces of each vertex's fan, from its first half-edge (at the border if it is open).
  std::vector<std::uint32_t> leaving(mesh.positions.size(), 0), first(mesh.positions.size());
  for (std::uint32_t h = 0; h < half_edges; ++h)
    if (leaving[start(h)]++ == 0 || opposite[h] == ProgressiveMesh::none) first[start(h)] = h;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (leaving[v] == 0) continue;
    std::uint32_t walked = 1;
    for (std::size_t h = opposite[next(next(first[v]))];
         h != ProgressiveMesh::none && h != first[v]; h = opposite[next(next(h))])
      ++walked;
    if (walked != leaving[v])
      fail(first[v], fmt::format("meets others at vertex {} that share no edge with its fan", v));
  }
}

/// Makes OpenMesh's mesh, whose handles equal the numbers in `mesh`. Faults are found before,
/// because OpenMesh would print them.
HalfEdgeMesh half_edge_mesh(const TriangleMesh& mesh) {
  check_manifold(mesh);
  HalfEdgeMesh out;
  out.reserve(mesh.positions.size(), 3 * mesh.faces.size() / 2, mesh.faces.size());
  for (const Eigen::Vector3f& p : mesh.positions) out.add_vertex({p.x(), p.y(), p.z()});
  for (const auto& [a, b, c] : mesh.faces) out.add_face(vertex(a), vertex(b), vertex(c));
  return out;
}

class Collapser {
 public:
  explicit Collapser(const TriangleMesh& mesh)
      : mesh_(half_edge_mesh(mesh)),
        quadrics_(mesh_.n_vertices()),
        version_(mesh_.n_edges(), 0),
        blocked_(mesh_.n_edges(), false) {
    mesh_.request_vertex_status();
    mesh_.request_edge_status();
    mesh_.request_face_status();
    for (const FaceHandle f : mesh_.faces()) add_quadric(f);
  }

  std::vector<Collapse> run() {
    for (const EdgeHandle e : mesh_.edges()) offer(e);
    while (!offers_.empty()) {
      const Offer best = offers_.top();
      offers_.pop();
      const HalfedgeHandle half_edge(best.half_edge);
      const EdgeHandle edge = mesh_.edge_handle(half_edge);
      if (best.version != version_[index(edge)] || mesh_.status(edge).deleted()) continue;
      if (allowed(half_edge))
        collapse(half_edge);
      else
        blocked_[index(edge)] = true;
    }
    return std::move(collapses_);
  }

 private:
  /// A possible collapse. In a tie the lower half-edge comes first.
  struct Offer {
    double cost;
    int half_edge;  // from the removed to the kept vertex
    std::uint32_t version;

    bool operator<(const Offer& other) const {  // for the queue: whether this offer is worse
      return cost != other.cost ? cost > other.cost : half_edge > other.half_edge;
    }
  };

  static std::size_t index(OpenMesh::BaseHandle handle) {
    return static_cast<std::size_t>(handle.idx());
  }

  void add_quadric(FaceHandle f) {
    std::array<VertexHandle, 3> corners;
    std::ranges::copy(mesh_.fv_range(f), corners.begin());
    const OpenMesh::Vec3d a = mesh_.point(corners[0]);
    OpenMesh::Vec3d normal = (mesh_.point(corners[1]) - a).cross(mesh_.point(corners[2]) - a);
    const double twice_area = normal.norm();
    if (twice_area > 0.0) normal /= twice_area;
    const Quadric plane = Quadric(normal, a) * twice_area;
    for (const VertexHandle v : corners)
      quadrics_[index(v)] += plane + Quadric(mesh_.point(v)) * (weight_of_place * twice_area);
  }

  void offer(EdgeHandle edge) {
    const HalfedgeHandle to = mesh_.halfedge_handle(edge, 0), back = mesh_.halfedge_handle(edge, 1);
    const VertexHandle a = mesh_.from_vertex_handle(to), b = mesh_.to_vertex_handle(to);
    const Quadric both = quadrics_[index(a)] + quadrics_[index(b)];
    const double at_a = both(mesh_.point(a)), at_b = both(mesh_.point(b));
    blocked_[index(edge)] = false;
    offers_.push(
        {std::min(at_a, at_b), at_a < at_b ? back.idx() : to.idx(), ++version_[index(edge)]});
  }

  /// OpenMesh's test, and one more: a tetrahedron must not become two coincident faces.
  bool allowed(HalfedgeHandle half_edge) {
    const auto peak = [&](VertexHandle v) {
      return !mesh_.is_boundary(v) && mesh_.valence(v) == 3;
    };
    return mesh_.is_collapse_ok(half_edge) &&
           !(peak(mesh_.from_vertex_handle(half_edge)) && peak(mesh_.to_vertex_handle(half_edge)));
  }

  void collapse(HalfedgeHandle half_edge) {
    const VertexHandle removed = mesh_.from_vertex_handle(half_edge);
    const VertexHandle kept = mesh_.to_vertex_handle(half_edge);
    collapses_.push_back(
        {.kept = number(kept),
         .removed = number(removed),
         .left_face = number(mesh_.face_handle(half_edge)),
         .right_face = number(mesh_.face_handle(mesh_.opposite_halfedge_handle(half_edge)))});
    mesh_.collapse(half_edge);
    quadrics_[index(kept)] += quadrics_[index(removed)];
    // Costs have changed only at the kept vertex. Blocked edges can become free only at its
    // neighbours, because only their neighbours have changed.
    for (const EdgeHandle edge : mesh_.ve_range(kept)) offer(edge);
    for (const VertexHandle v : mesh_.vv_range(kept))
      for (const EdgeHandle edge : mesh_.ve_range(v))
        if (blocked_[index(edge)]) offer(edge);
  }

  HalfEdgeMesh mesh_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> version_;  // by edge: its latest offer's version
  std::vector<bool> blocked_;           // by edge: not allowed when last tried
  std::priority_queue<Offer> offers_;
  std::vector<Collapse> collapses_;
};

}  // namespace

ProgressiveMeshArrays build_by_edge_collapse(const TriangleMesh& mesh) {
  return lay_out(mesh, Collapser(mesh).run());
}

}  // namespace ensonify::refine
