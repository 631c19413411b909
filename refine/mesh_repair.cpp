#include <ensonify/refine/mesh_repair.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/refine/index.h>

namespace ensonify::refine {
namespace {

// An Index is the number of a vertex, a face or a corner. Corner k of face f has the number 3f + k.
// The half-edge with the same number leads from this corner to the face's next corner.

Index next_corner(Index corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

/// Calls visit(items) once for all items with the same key, in ascending order of keys and of
/// items. The key of an item is the pair vertex(item), number(item).
template <class Vertex, class Number, class Visit>
void for_each_group(std::size_t items, std::size_t vertices, Vertex vertex, Number number,
                    Visit visit) {
  std::vector<Index> begins(vertices + 1, 0), sorted(items);
  for (Index i = 0; i < items; ++i) ++begins[vertex(i) + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<Index> ends(begins.begin(), begins.end() - 1);
  for (Index i = 0; i < items; ++i) sorted[ends[vertex(i)]++] = i;
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::span<Index> bucket(sorted.begin() + begins[v], sorted.begin() + ends[v]);
    std::ranges::sort(bucket, {}, [&](Index i) { return std::pair(number(i), i); });
    for (std::size_t begin = 0, end = 0; begin < bucket.size(); begin = end) {
      while (end < bucket.size() && number(bucket[end]) == number(bucket[begin])) ++end;
      visit(bucket.subspan(begin, end - begin));
    }
  }
}

class Repairer {
 public:
  Repairer(const TriangleMesh& mesh, double weld_tolerance_m)
      : mesh_(mesh), place_(weld(mesh.positions, weld_tolerance_m)) {}

  RepairedMesh repair() {
    drop_faces();
    pair_edges();
    orient();
    separate_fans();
    number_vertices();
    turn_components();
    return std::move(repaired_);
  }

 private:
  // Replaces vertices by those whose place they take. From here on, only kept faces are numbered.
  void drop_faces() {
    std::vector<Face> faces(mesh_.faces);
    std::vector<char> dropped(faces.size(), 0);
    std::vector<Face> keys(faces.size());  // a face's vertices, ascending
    for (std::size_t f = 0; f < faces.size(); ++f) {
      for (Index& vertex : faces[f]) vertex = place_[vertex];
      keys[f] = faces[f];
      std::ranges::sort(keys[f]);
      dropped[f] = flat(faces[f]);
      report_.degenerate_faces += static_cast<std::size_t>(dropped[f]);
    }
    for_each_group(
        faces.size(), place_.size(), [&](Index f) { return keys[f][0]; },
        [&](Index f) { return pack(keys[f][1], keys[f][2]); },
        [&](std::span<const Index> same) {
          if (dropped[same.front()]) return;  // then all of them are dropped
          report_.duplicate_faces += same.size() - 1;
          for (const Index f : same.subspan(1)) dropped[f] = 1;
        });
    for (Index f = 0; f < faces.size(); ++f)
      if (!dropped[f]) {
        faces_.push_back(faces[f]);
        repaired_.source_face.push_back(f);
      }
  }

  void pair_edges() {
    mate_.assign(3 * faces_.size(), none);
    for_each_group(
        mate_.size(), place_.size(), [&](Index h) { return std::min(tail(h), head(h)); },
        [&](Index h) { return std::max(tail(h), head(h)); },
        [&](std::span<const Index> edge) {
          if (edge.size() == 2) {
            mate_[edge[0]] = edge[1];
            mate_[edge[1]] = edge[0];
          } else if (edge.size() > 2) {
            crowded_.push_back(edge.front());
          }
        });
  }

  // Nothing here may depend on the faces' orientation or on vertex numbers. Otherwise the cuts
  // would be different when the output is welded and repaired again.
  void orient() {
    turned_.assign(faces_.size(), 0);
    component_.assign(faces_.size(), none);
    std::vector<Index> queue;
    queue.reserve(faces_.size());
    for (Index root = 0; root < faces_.size(); ++root) {
      if (component_[root] != none) continue;
      component_[root] = components_;
      queue.push_back(root);
      for (std::size_t next = queue.size() - 1; next < queue.size(); ++next) {
        const Index f = queue[next];
        std::array<Index, 3> edges = {3 * f, 3 * f + 1, 3 * f + 2};
        std::ranges::sort(edges, {},
                          [&](Index h) { return mate_[h]; });  // in order of the other face
        for (const Index h : edges) {
          const Index other = mate_[h];
          if (other == none) break;
          const Index g = other / 3;
          const char turned = static_cast<char>(turned_[f] ^ (tail(h) == tail(other)));
          if (component_[g] == none) {
            component_[g] = components_;
            turned_[g] = turned;
            queue.push_back(g);
          } else if (turned_[g] != turned) {
            mate_[h] = mate_[other] = none;
            cut_.push_back(h);
          }
        }
      }
      ++components_;
    }
  }

  // A fan is a set of corners at one place; its number is that of its first corner. Two paired
  // faces share a fan at both ends of their edge. The face of an unpaired edge is at the end of a
  // fan. The two end faces of a fan are oriented the same way, so only two faces in opposite
  // directions can later share the edge again.
  void separate_fans() {
    fan_.resize(3 * faces_.size());
    std::iota(fan_.begin(), fan_.end(), Index{0});
    const auto find = [&](Index corner) {
      while (fan_[corner] != corner) corner = fan_[corner] = fan_[fan_[corner]];
      return corner;
    };
    const auto join = [&](Index a, Index b) {
      a = find(a);
      b = find(b);
      fan_[std::max(a, b)] = std::min(a, b);
    };
    for (Index h = 0; h < mate_.size(); ++h) {
      const Index other = mate_[h];
      if (other == none || other < h) continue;
      const bool opposite = tail(h) != tail(other);
      join(h, opposite ? next_corner(other) : other);
      join(next_corner(h), opposite ? other : next_corner(other));
    }
    for (Index& fan : fan_) fan = fan_[fan];  // a parent comes first and is already resolved
  }

  // Gives each fan a vertex: the first of its source vertices, or a new one if another fan has
  // taken that vertex. Only differences between fans and source vertices are counted, so vertices
  // that were already split in the source are not reported.
  void number_vertices() {
    const std::size_t vertices = mesh_.positions.size();
    std::vector<Index> first_vertex(fan_.size(), none), fan_of(vertices, none),
        taken_by(vertices, none);
    for (Index c = 0; c < fan_.size(); ++c)
      first_vertex[fan_[c]] = std::min(first_vertex[fan_[c]], given(c));
    std::vector<char> changed(vertices, 0);  // by place
    std::vector<std::uint64_t> joined;       // fan and vertex, except a fan's first vertex
    std::vector<Index> appended;             // fans
    std::size_t fans = 0, used = 0;
    for (Index c = 0; c < fan_.size(); ++c) {
      const Index vertex = given(c), fan = fan_[c];
      if (c == fan) {
        ++fans;
        Index& taker = taken_by[first_vertex[fan]];
        if (taker == none)
          taker = fan;
        else
          appended.push_back(fan);
      }
      if (fan_of[vertex] == none) {
        ++used;
        fan_of[vertex] = fan;
      }
      if (vertex != first_vertex[fan]) joined.push_back(pack(fan, vertex));
      if (vertex != first_vertex[fan] || fan != fan_of[vertex]) changed[place_[vertex]] = 1;
    }
    std::ranges::sort(joined);
    joined.erase(std::unique(joined.begin(), joined.end()), joined.end());

    std::vector<Eigen::Vector3f>& positions = repaired_.mesh.positions;
    new_vertex_.assign(fan_.size(), none);
    positions.reserve(fans);
    for (Index v = 0; v < vertices; ++v) {
      if (taken_by[v] == none) continue;
      new_vertex_[taken_by[v]] = static_cast<Index>(positions.size());
      const bool moved = mesh_.positions[v] != mesh_.positions[place_[v]];
      positions.push_back(mesh_.positions[moved ? place_[v] : v]);  // otherwise 0 might become -0
      report_.welded_vertices += moved;
      changed[place_[v]] |= static_cast<char>(moved);
    }
    for (const Index fan : appended) {
      new_vertex_[fan] = static_cast<Index>(positions.size());
      positions.push_back(mesh_.positions[place_[first_vertex[fan]]]);
    }
    report_.welded_vertices += joined.size();
    report_.split_vertices = fans + joined.size() - used;
    report_.unreferenced_vertices = vertices - used;
    const auto edge_changed = [&](Index h) { return changed[tail(h)] || changed[head(h)]; };
    report_.non_manifold_edges =
        static_cast<std::size_t>(std::ranges::count_if(crowded_, edge_changed));
    report_.unorientable_edges =
        static_cast<std::size_t>(std::ranges::count_if(cut_, edge_changed));
  }

  struct Component {
    std::size_t faces = 0, turned = 0;
    Eigen::AlignedBox3f box;
    double volume = 0.0;  // six times the signed volume, with the new orientation
    double size = 0.0;    // the sum of the absolute values of the volume's terms
    bool open = false;
    bool flip = false;
  };

  void turn_components() {
    std::vector<Component> components(components_);
    for (Index f = 0; f < faces_.size(); ++f) {
      Component& component = components[component_[f]];
      ++component.faces;
      component.turned += static_cast<std::size_t>(turned_[f]);
      for (const Index v : faces_[f]) component.box.extend(mesh_.positions[v]);
    }
    mark_open(components);
    for (Index f = 0; f < faces_.size(); ++f) {
      Component& component = components[component_[f]];
      const Eigen::Vector3d middle =
          0.5 * (component.box.min().cast<double>() + component.box.max().cast<double>());
      const auto [a, b, c] = faces_[f];
      // The cross product of edges, instead of corners, stays precise in wide flat bodies.
      const Eigen::Vector3d normal = (position(b) - position(a)).cross(position(c) - position(a));
      const Eigen::Vector3d arm = position(a) - middle;
      component.volume += turned_[f] ? -arm.dot(normal) : arm.dot(normal);
      component.size += arm.norm() * normal.norm();
    }
    for (Component& component : components) {
      const bool solid = !component.open && std::abs(component.volume) > 1e-12 * component.size;
      component.flip =
          solid ? component.volume < 0.0 : component.turned > component.faces - component.turned;
    }
    repaired_.mesh.world_origin = mesh_.world_origin;
    repaired_.mesh.faces.reserve(faces_.size());
    for (Index f = 0; f < faces_.size(); ++f) {
      Face face;
      for (Index k = 0; k < 3; ++k) face[k] = new_vertex_[fan_[3 * f + k]];
      if (components[component_[f]].flip != static_cast<bool>(turned_[f])) {
        std::swap(face[1], face[2]);
        ++report_.flipped_faces;
      }
      repaired_.mesh.faces.push_back(face);
    }
  }

  // Marks the components with a border. An unpaired half-edge is a border, unless another unpaired
  // half-edge joins the same two fans.
  void mark_open(std::vector<Component>& components) const {
    std::vector<std::pair<std::uint64_t, Index>> unpaired;
    for (Index h = 0; h < mate_.size(); ++h)
      if (mate_[h] == none) {
        const auto [low, high] = std::minmax(fan_[h], fan_[next_corner(h)]);
        unpaired.emplace_back(pack(low, high), h);
      }
    std::ranges::sort(unpaired);
    for (std::size_t i = 0; i < unpaired.size(); ++i) {
      const std::uint64_t fans = unpaired[i].first;
      if ((i == 0 || unpaired[i - 1].first != fans) &&
          (i + 1 == unpaired.size() || unpaired[i + 1].first != fans))
        components[component_[unpaired[i].second / 3]].open = true;
    }
  }

  // Whether a face has no area; tested from each corner, so that the order of corners does not
  // matter.
  bool flat(const Face& face) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d origin = position(face[k]);
      if ((position(face[(k + 1) % 3]) - origin).cross(position(face[(k + 2) % 3]) - origin) ==
          Eigen::Vector3d::Zero())
        return true;
    }
    return false;
  }

  Eigen::Vector3d position(Index vertex) const { return mesh_.positions[vertex].cast<double>(); }
  Index tail(Index h) const { return faces_[h / 3][h % 3]; }
  Index head(Index h) const { return tail(next_corner(h)); }
  Index given(Index corner) const {
    return mesh_.faces[repaired_.source_face[corner / 3]][corner % 3];
  }

  const TriangleMesh& mesh_;
  const std::vector<Index> place_;  // by vertex: the number of the vertex whose place it takes
  std::vector<Face> faces_;         // the kept faces; corners are numbers in place_
  std::vector<Index> mate_;         // by half-edge: the opposite one, if the edge has two
  std::vector<Index> crowded_;      // a half-edge of each edge of three or more
  std::vector<Index> cut_;          // a half-edge of each edge where orientations contradict
  std::vector<char> turned_;        // by face: orientation opposite to the component's first face
  std::vector<Index> component_;    // by face
  Index components_ = 0;
  std::vector<Index> fan_;         // by corner
  std::vector<Index> new_vertex_;  // by fan
  RepairedMesh repaired_;
  RepairReport& report_ = repaired_.report;
};

}  // namespace

std::vector<Index> weld(std::span<const Eigen::Vector3f> positions, double weld_tolerance_m) {
  std::vector<Index> place(positions.size());
  std::iota(place.begin(), place.end(), Index{0});
  if (weld_tolerance_m < 0.0) return place;
  // A hash grid of the vertices that keep their place. A cell's width is twice the tolerance, and
  // slightly more because of rounding. So the vertices within the tolerance are in one of two cells
  // per axis. The smallest width separates all floats.
  const double cell_m = std::max(2.001 * weld_tolerance_m, 1e-60);
  const std::size_t mask = std::bit_ceil(2 * positions.size()) - 1;
  std::vector<Index> first(mask + 1, none), following(positions.size(), none);
  const auto slot = [&](const std::array<double, 3>& cell) {
    std::uint64_t hash = 0;
    for (const double c : cell) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(c + 0.0)) * 0x9e3779b97f4a7c15u;  // no -0
      hash ^= hash >> 32;
    }
    return hash & mask;
  };
  for (Index v = 0; v < positions.size(); ++v) {
    const Eigen::Vector3d here = positions[v].cast<double>();
    std::array<double, 3> own, low, high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double q = here[static_cast<Eigen::Index>(axis)] / cell_m;
      own[axis] = std::floor(q);
      // Beyond 2^52 a double has no halves, and only equal places are in reach.
      const double half = std::abs(q) < 0x1p52 ? 0.5 : 0.0;
      low[axis] = std::floor(q - half);
      high[axis] = std::floor(q + half);
    }
    for (unsigned which = 0; which < 8; ++which) {
      std::array<double, 3> cell = low;
      bool again = false;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (which >> axis & 1) {
          again |= low[axis] == high[axis];
          cell[axis] = high[axis];
        }
      if (again) continue;
      for (Index u = first[slot(cell)]; u != none; u = following[u])
        if (u < place[v] && (positions[u].cast<double>() - here).squaredNorm() <=
                                weld_tolerance_m * weld_tolerance_m)
          place[v] = u;
    }
    if (place[v] == v) following[v] = std::exchange(first[slot(own)], v);
  }
  return place;
}

RepairedMesh repair(const TriangleMesh& mesh, double weld_tolerance_m) {
  if (!std::isfinite(weld_tolerance_m))
    throw std::invalid_argument(
        fmt::format("repair: weld_tolerance_m is {}, not a finite length", weld_tolerance_m));
  if (mesh.positions.size() >= none || mesh.faces.size() >= none / 3)
    throw std::invalid_argument(fmt::format("repair: {} vertices and {} faces are too many",
                                            mesh.positions.size(), mesh.faces.size()));
  for (const Face& face : mesh.faces)
    for (const Index vertex : face)
      if (vertex >= mesh.positions.size())
        throw std::invalid_argument(fmt::format("repair: a face names vertex {}, but there are {}",
                                                vertex, mesh.positions.size()));
  return Repairer(mesh, weld_tolerance_m).repair();
}

RepairedMesh repair_file(const TriangleMesh& mesh, double weld_tolerance_m,
                         const std::filesystem::path& file) {
  RepairedMesh repaired = repair(mesh, weld_tolerance_m);
  if (repaired.mesh.faces.empty())
    throw MeshError(
        fmt::format("{}: no face is left after the repair: all {} have no area; check the units of "
                    "its vertices, and how it was written",
                    file.string(), mesh.faces.size()));
  return repaired;
}

}  // namespace ensonify::refine
