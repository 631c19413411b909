#include <ensonify/refine/active_mesh.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <ensonify/refine/index.h>

namespace ensonify::refine {
namespace {

Index next_edge(Index half_edge) { return half_edge % 4 == 2 ? half_edge - 2 : half_edge + 1; }
Index previous_edge(Index half_edge) { return half_edge % 4 == 0 ? half_edge + 2 : half_edge - 1; }

Index high(std::uint64_t packed) { return static_cast<Index>(packed >> 32); }
Index low(std::uint64_t packed) { return static_cast<Index>(packed); }

/// A stable radix sort: microseconds for a thousand numbers.
void sort_by_high(std::vector<std::uint64_t>& numbers, std::vector<std::uint64_t>& spare) {
  std::uint64_t all = 0;
  for (const std::uint64_t n : numbers) all |= n;
  spare.resize(numbers.size());
  for (int shift = 32; shift < 64 && all >> shift != 0; shift += 11) {
    std::array<Index, 1 << 11> place{};
    const auto digit = [&](std::uint64_t n) { return n >> shift & (place.size() - 1); };
    for (const std::uint64_t n : numbers) ++place[digit(n)];
    std::exclusive_scan(place.begin(), place.end(), place.begin(), Index{0});
    for (const std::uint64_t n : numbers) spare[place[digit(n)]++] = n;
    numbers.swap(spare);
  }
}

}  // namespace

ActiveMesh::ActiveMesh(const ProgressiveMesh& mesh) : mesh_(&mesh) {
  const std::span<const Index> roots = mesh.roots;
  for (Index r = 0; r < roots.size(); ++r)
    nodes_.push_back(node_over(roots[r] - r, roots[r], mesh.end_of(r), none));
  if (nodes_.size() % 2) nodes_.emplace_back();

  struct Edge {
    Index lower, higher, half_edge;
    auto operator<=>(const Edge&) const = default;
  };
  std::vector<Edge> edges;
  for (Index slot = 2 * static_cast<Index>(mesh.mid.size()); slot < mesh.faces.size(); ++slot) {
    const Index f = make_face(slot);
    auto& corners = faces_[f].vertices;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = static_cast<Index>(std::ranges::upper_bound(roots, mesh.faces[slot][k]) -
                                      roots.begin() - 1);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
      mesh.contradicts("a base face has two corners in one tree, one at root", corners[0]);
    for (Index k = 0; k < 3; ++k) {
      const auto [lower, higher] = std::minmax(corners[k], corners[(k + 1) % 3]);
      edges.push_back({lower, higher, 4 * f + k});
    }
  }
  std::ranges::sort(edges);
  for (std::size_t e = 1; e < edges.size(); ++e)
    if (edges[e].lower == edges[e - 1].lower && edges[e].higher == edges[e - 1].higher) {
      if (opposite(edges[e - 1].half_edge) != none ||
          from(edges[e].half_edge) == from(edges[e - 1].half_edge))
        mesh.contradicts("the base mesh is not manifold at root", edges[e].lower);
      join(edges[e].half_edge, edges[e - 1].half_edge);
    }
  for (const Edge& edge : edges)
    if (Index& first = nodes_[from(edge.half_edge)].half_edge;
        first == none || opposite(edge.half_edge) == none)
      first = edge.half_edge;

  check_base();
  base_nodes_ = nodes_;
  base_faces_ = faces_;
  reset();
}

/// Throws unless the faces of each vertex are one fan: then the fans include every corner.
void ActiveMesh::check_base() const {
  Fan fan;
  std::size_t corners = 0;
  for (Index v = 0; v < nodes_.size(); ++v) {
    if (nodes_[v].half_edge == none) continue;
    walk(v, fan);
    corners += fan.half_edges.size();
  }
  if (corners != 3 * faces_.size())
    mesh_->contradicts("a base vertex has two fans; base faces:",
                       static_cast<Index>(faces_.size()));
}

void ActiveMesh::reset() {
  nodes_ = base_nodes_;
  faces_ = base_faces_;
  free_children_.clear();
  free_faces_.clear();
  vertex_count_ = mesh_->roots.size();
  marks_.assign(nodes_.size(), 0);
  mark_ = 0;
  touched_.clear();
  opened_.clear();
  changes_.clear();
  exact_faces_.clear();
  exact_sources_.clear();
  for (const ActiveFace& face : faces_)
    if (all_leaves(face.vertices[0], face.vertices[1], face.vertices[2]))
      changes_.push_back(pack(face.source, face.slot));
  settle_exact();
}

RefineStatistics ActiveMesh::refine(std::span<const FanVolume> volumes) {
  view_.look_at(volumes);
  statistics_ = {};
  offers_.clear();
  find_fronts();
  for (const Index vertex : inner_)
    if (touches(nodes_[vertex])) touched_.push_back(vertex);
  for (const Index left : twins_)
    if (!touches(nodes_[nodes_[left].parent])) offers_.push_back(nodes_[left].parent);
  split_touched();
  // Forced splits cannot be collapsed yet, because of the splits that forced them.
  opened_.clear();
  collapse_offered();
  settle_exact();
  return statistics_;
}

/// Lists what refinement has to test: active inner vertices, and the left vertices of pairs of
/// active siblings. The loop has no `if`, because the processor would often mispredict it.
void ActiveMesh::find_fronts() {
  inner_.resize(nodes_.size() + 1);
  twins_.resize(nodes_.size());
  std::size_t inner = 0, twins = 0;
  // NOLINTBEGIN(clang-diagnostic-bitwise-instead-of-logical): without an `if`
  for (Index left = 0; left < nodes_.size(); left += 2) {
    const Node &a = nodes_[left], &b = nodes_[left + 1];
    inner_[inner] = left;
    inner += a.is_active() & !a.is_leaf();
    inner_[inner] = left + 1;
    inner += b.is_active() & !b.is_leaf();
    twins_[twins] = left;
    twins += a.is_active() & b.is_active() & (a.parent != none);
  }
  // NOLINTEND(clang-diagnostic-bitwise-instead-of-logical)
  inner_.resize(inner);
  twins_.resize(twins);
}

/// Splits touched vertices, also those that appear meanwhile: children of splits and forced splits.
void ActiveMesh::split_touched() {
  // NOLINTNEXTLINE(modernize-loop-convert): the list grows
  for (std::size_t i = 0; i < touched_.size(); ++i)
    if (nodes_[touched_[i]].is_active()) split(touched_[i]);
  touched_.clear();
}

/// Collapses offered nodes until no more can be collapsed. This ends, because a collapse only
/// causes splits of nodes that were collapsed later in the progressive mesh. So the list of split
/// nodes, with the finest first, decreases. It ends soon for the meshes that builders make.
void ActiveMesh::collapse_offered() {
  const std::size_t max_collapses = 16 * (mesh_->mid.size() + 1);
  for (std::size_t collapses = none; collapses != statistics_.collapses;) {
    collapses = statistics_.collapses;
    statistics_.blocked_collapses = 0;
    waiting_.clear();
    // NOLINTNEXTLINE(modernize-loop-convert): the list grows
    for (std::size_t i = 0; i < offers_.size(); ++i) {
      const Index node = offers_[i];
      // Both are tested again, because they may have changed since the offer.
      const bool is_wanted = has_two_active(node) && !touches(nodes_[node]);
      if (!is_wanted || !collapse(node)) {
        statistics_.blocked_collapses += is_wanted;
        waiting_.push_back(node);
        continue;
      }
      if (statistics_.collapses > max_collapses) [[unlikely]]
        mesh_->contradicts("collapses do not end; the last was node", nodes_[node].number);
      split_touched();
      for (const Index opened : opened_) offer(opened);
      opened_.clear();
      offer(nodes_[node].parent);
    }
    offers_.swap(waiting_);
  }
}

void ActiveMesh::offer(Index node) {
  if (node != none && has_two_active(node) && !touches(nodes_[node])) offers_.push_back(node);
}

void ActiveMesh::vsplit(Index vertex) {
  if (vertex >= nodes_.size() || !nodes_[vertex].is_active() || nodes_[vertex].is_leaf())
    throw std::invalid_argument("ActiveMesh::vsplit: not an active inner node; see nodes()");
  split(vertex);
  touched_.clear();
  opened_.clear();
  settle_exact();
}

bool ActiveMesh::ecol(Index node) {
  if (node >= nodes_.size() || !has_two_active(node))
    throw std::invalid_argument(
        "ActiveMesh::ecol: not a node with two active children; see nodes()");
  const bool done = collapse(node);
  touched_.clear();
  opened_.clear();
  settle_exact();
  return done;
}

ExactFaces ActiveMesh::exact_faces() const { return {mesh_->points, exact_faces_, exact_sources_}; }

/// Merges changes into the list of exact faces. A face may have come and gone several times.
void ActiveMesh::settle_exact() {
  if (changes_.empty()) return;
  sort_by_high(changes_, spare_changes_);
  next_exact_faces_.clear();
  next_exact_sources_.clear();
  std::size_t old = 0;
  for (auto change = changes_.begin(); old < exact_sources_.size() || change != changes_.end();) {
    const Index source = change != changes_.end() ? high(*change) : none;
    for (; old < exact_sources_.size() && exact_sources_[old] < source; ++old) {
      next_exact_faces_.push_back(exact_faces_[old]);
      next_exact_sources_.push_back(exact_sources_[old]);
    }
    if (source == none) break;
    int count = 0;  // how many faces have this number now
    Face face{};
    if (old < exact_sources_.size() && exact_sources_[old] == source) {
      ++count;
      face = exact_faces_[old++];
    }
    for (; change != changes_.end() && high(*change) == source; ++change) {
      count += low(*change) == none ? -1 : 1;
      if (low(*change) != none) face = mesh_->faces[low(*change)];
    }
    if (count == 0) continue;
    if (count != 1) mesh_->contradicts("two faces have the number", source);
    for (const Index leaf : face) mesh_->verify_leaf(leaf);
    next_exact_faces_.push_back(face);
    next_exact_sources_.push_back(source);
  }
  exact_faces_.swap(next_exact_faces_);
  exact_sources_.swap(next_exact_sources_);
  changes_.clear();
}

ActiveMesh::Node ActiveMesh::node_over(Index number, Index lo, Index hi, Index parent) const {
  Node node{.lo = lo, .hi = hi, .parent = parent};
  if (!node.is_leaf()) {
    mesh_->verify_node(number);
    node.number = number;
  }
  return node;
}

void ActiveMesh::join(Index a, Index b) {
  if (a != none) opposite(a) = b;
  if (b != none) opposite(b) = a;
}

void ActiveMesh::walk(Index vertex, Fan& fan) const {
  fan.half_edges.clear();
  fan.ring.clear();
  const Index first = nodes_[vertex].half_edge;
  Index h = first, last = none;
  do {
    fan.half_edges.push_back(h);
    fan.ring.push_back(from(next_edge(h)));
    last = previous_edge(h);
    h = faces_[last / 4].opposites[last % 4];
  } while (h != none && h != first);
  fan.ring.push_back(from(last));
  fan.open = h == none;
}

Index ActiveMesh::make_face(Index slot) {
  Index f = static_cast<Index>(faces_.size());
  if (free_faces_.empty()) {
    faces_.emplace_back();
  } else {
    f = free_faces_.back();
    free_faces_.pop_back();
  }
  faces_[f] = {.vertices = {none, none, none},
               .opposites = {none, none, none},
               .slot = slot,
               .source = mesh_->source_face[slot]};
  return f;
}

/// Adds both children of an active inner vertex, which becomes a split node.
Index ActiveMesh::make_children(Index vertex) {
  Index left = static_cast<Index>(nodes_.size());
  if (free_children_.empty()) {
    nodes_.resize(nodes_.size() + 2);
    marks_.resize(nodes_.size(), 0);
  } else {
    left = free_children_.back();
    free_children_.pop_back();
  }
  Node& node = nodes_[vertex];
  const Index mid = mesh_->mid_of(node.number, node.lo, node.hi);
  nodes_[left] = node_over(node.number + 1, node.lo, mid, vertex);
  nodes_[left + 1] = node_over(node.number + (mid - node.lo), mid, node.hi, vertex);
  node.left = left;
  ++vertex_count_;
  return left;
}

void ActiveMesh::split(Index vertex) {
  forcing_.assign(1, vertex);
  while (!forcing_.empty()) {
    const Index in_the_way = try_split(forcing_.back());
    if (in_the_way == none) {
      forcing_.pop_back();
    } else {
      forcing_.push_back(in_the_way);
      ++statistics_.forced_splits;
    }
  }
}

/// Splits a vertex, or returns another one that must be split before. Imagine the children one
/// above the other, the left child below. The first fundamental face comes between them on the left
/// side, the second on the right side. So, counter-clockwise round the vertex, the faces from the
/// cut vertex of the first fundamental face to the cut vertex of the second get the left child, and
/// the others get the right child. If a fundamental face does not exist, the border takes the place
/// of its cut vertex.
Index ActiveMesh::try_split(Index vertex) {
  const Index number = nodes_[vertex].number;
  const auto expect = [&](bool holds, const char* what) {
    if (!holds) [[unlikely]]
      mesh_->contradicts(what, number);
  };
  expect(nodes_[vertex].half_edge != none, "there are no faces around node");
  Fan& fan = fans_[0];
  walk(vertex, fan);
  const Index count = static_cast<Index>(fan.half_edges.size());
  const Index first_slot = 2 * number;
  std::array<Index, 2> cut_corner = {0, 0}, cut_leaf = {none, none};
  for (Index s = 0; s < 2; ++s) {
    const Face& face = mesh_->faces[first_slot + s];
    if (face[0] == none) continue;
    while (cut_corner[s] < 2 && nodes_[vertex].covers(face[cut_corner[s]])) ++cut_corner[s];
    cut_leaf[s] = face[cut_corner[s]];
  }
  std::array<Index, 2> at = {0, count};  // the places of the cut vertices in the ring
  for (Index j = count + 1; j-- > 0;)
    for (Index s = 0; s < 2; ++s) at[s] = nodes_[fan.ring[j]].covers(cut_leaf[s]) ? j : at[s];
  for (Index s = 0; s < 2; ++s)
    expect(cut_leaf[s] == none ? fan.open : nodes_[fan.ring[at[s]]].covers(cut_leaf[s]),
           "a fundamental face has no place around node");
  const bool two = cut_leaf[0] != none && cut_leaf[1] != none;
  expect(two || cut_leaf[0] != cut_leaf[1], "there are no fundamental faces of node");
  if (two && fan.ring[at[0]] == fan.ring[at[1]]) {
    const Node& cut = nodes_[fan.ring[at[0]]];
    expect(!cut.is_leaf() && mesh_->order[cut.number] > mesh_->order[number],
           "a node that must be split first was collapsed earlier than node");
    return fan.ring[at[0]];
  }

  const Index left = make_children(vertex);
  const std::array<bool, 2> is_leaf = {nodes_[left].is_leaf(), nodes_[left + 1].is_leaf()};
  for (Index j = 0; j < count; ++j) {
    const bool is_left = at[0] <= at[1] ? at[0] <= j && j < at[1] : !(at[1] <= j && j < at[0]);
    const Index h = fan.half_edges[j];
    faces_[h / 4].vertices[h % 4] = is_left ? left : left + 1;
    if (is_leaf[is_left ? 0 : 1] && nodes_[fan.ring[j]].is_leaf() &&
        nodes_[fan.ring[j + 1]].is_leaf())
      changes_.push_back(pack(faces_[h / 4].source, faces_[h / 4].slot));
  }

  std::array<Index, 2> across = {none, none};  // from a child to the other
  std::array<Index, 2> to_cut = {none, none};  // from the other child
  for (Index s = 0; s < 2; ++s) {
    if (cut_leaf[s] == none) continue;
    const Index f = make_face(first_slot + s), cut = fan.ring[at[s]];
    const Index from_cut = 4 * f + cut_corner[s];
    across[s] = next_edge(from_cut);
    to_cut[s] = next_edge(across[s]);
    faces_[f].vertices[cut_corner[s]] = cut;
    faces_[f].vertices[across[s] % 4] = left + s;
    faces_[f].vertices[to_cut[s] % 4] = left + 1 - s;
    const bool has_in = at[s] > 0 || !fan.open, has_out = at[s] < count;
    join(to_cut[s], has_in ? previous_edge(fan.half_edges[(at[s] + count - 1) % count]) : none);
    join(from_cut, has_out ? fan.half_edges[at[s]] : none);
    if (!has_out) nodes_[cut].half_edge = from_cut;
    if (all_leaves(left, left + 1, cut)) changes_.push_back(pack(faces_[f].source, faces_[f].slot));
  }
  join(across[0], across[1]);
  for (Index s = 0; s < 2; ++s) {
    // Whether the fan is open at this child.
    const bool has_gap = fan.open && (cut_leaf[s] == none || (two && at[s] > at[1 - s]));
    nodes_[left + s].half_edge = !has_gap        ? across[s]
                                 : at[1 - s] > 0 ? fan.half_edges[0]
                                                 : to_cut[1 - s];
    if (!is_leaf[s] && touches(nodes_[left + s])) touched_.push_back(left + s);
  }
  opened_.push_back(vertex);
  ++statistics_.splits;
  return none;
}

/// Collapses a node. Splits blockers that were collapsed later; returns false for other blockers.
bool ActiveMesh::collapse(Index node) {
  while (!is_free(node)) {
    for (const Index blocker : blockers_)
      if (nodes_[blocker].is_leaf() ||
          mesh_->order[nodes_[blocker].number] <= mesh_->order[nodes_[node].number])
        return false;
    for (const Index blocker : blockers_)
      if (nodes_[blocker].is_active()) {
        split(blocker);
        ++statistics_.unblocking_splits;
      }
    if (!has_two_active(node))
      mesh_->contradicts("a child was collapsed after node", nodes_[node].number);
  }
  check_collapse(node);
  merge_children(node);
  return true;
}

/// Whether two active children may collapse: their only common neighbours are the cut vertices.
/// Finds both fans, the faces that will vanish, and the blockers.
bool ActiveMesh::is_free(Index node) {
  const Index left = nodes_[node].left;
  blockers_.clear();
  doomed_ = {};
  for (Index s = 0; s < 2; ++s) {
    walk(left + s, fans_[s]);
    for (std::size_t j = 0; j < fans_[s].half_edges.size(); ++j)
      if (fans_[s].ring[j] == left + 1 - s) {
        const Index across = fans_[s].half_edges[j];
        doomed_[s] = {.face = across / 4,
                      .cut = from(previous_edge(across)),
                      .in = opposite(next_edge(across)),
                      .out = opposite(previous_edge(across))};
      }
  }
  if (++mark_ == 0) {
    std::ranges::fill(marks_, 0);
    mark_ = 1;
  }
  for (const Index v : fans_[0].ring) marks_[v] = mark_;
  for (const Index v : fans_[1].ring)
    if (std::exchange(marks_[v], 0) == mark_ && v != doomed_[0].cut && v != doomed_[1].cut)
      blockers_.push_back(v);
  return blockers_.empty();
}

/// Checks the other conditions of a collapse, at borders and in a tetrahedron. They held when the
/// progressive mesh was built and still hold, because a vertex with neighbours beyond one edge at
/// any resolution also has such neighbours at finer resolutions. Only a wrong file can violate
/// them.
void ActiveMesh::check_collapse(Index node) const {
  const auto has_neighbours = [](const Fundamental& f) {
    return f.face == none || f.in != none || f.out != none;
  };
  const bool inside = doomed_[0].face != none && doomed_[1].face != none;
  const bool has_edge = doomed_[0].face != none || doomed_[1].face != none;
  const bool is_peak = !fans_[0].open && !fans_[1].open && fans_[0].half_edges.size() == 3 &&
                       fans_[1].half_edges.size() == 3;
  if (!has_edge || !has_neighbours(doomed_[0]) || !has_neighbours(doomed_[1]) ||
      (inside && fans_[0].open && fans_[1].open) || is_peak)
    mesh_->contradicts("no edge can have been collapsed into node", nodes_[node].number);
}

void ActiveMesh::merge_children(Index node) {
  const Index left = nodes_[node].left;
  for (Index s = 0; s < 2; ++s) {
    const auto& [half_edges, ring, open] = fans_[s];
    for (std::size_t j = 0; j < half_edges.size(); ++j) {
      ActiveFace& face = faces_[half_edges[j] / 4];
      const bool first_seen =
          s == 0 || (half_edges[j] / 4 != doomed_[0].face && half_edges[j] / 4 != doomed_[1].face);
      if (first_seen && all_leaves(left + s, ring[j], ring[j + 1]))
        changes_.push_back(pack(face.source, none));
      face.vertices[half_edges[j] % 4] = node;
    }
  }
  Index first = doomed_[0].out;
  for (Index s = 0; s < 2; ++s) {
    if (!fans_[s].open) continue;
    const Index h = nodes_[left + s].half_edge;
    if (h / 4 == doomed_[1 - s].face)
      first = doomed_[1 - s].out;  // h led along the border to the cut vertex
    else if (h / 4 != doomed_[s].face)
      first = h;
  }
  nodes_[node].half_edge = first;
  for (const Fundamental& f : doomed_) {
    if (f.face == none) continue;
    join(f.in, f.out);
    if (nodes_[f.cut].half_edge / 4 == f.face) nodes_[f.cut].half_edge = f.in;
    faces_[f.face].slot = none;
    free_faces_.push_back(f.face);
  }
  nodes_[node].left = none;
  nodes_[left] = nodes_[left + 1] = {};
  free_children_.push_back(left);
  --vertex_count_;
  ++statistics_.collapses;
}

}  // namespace ensonify::refine
