#include <ensonify/engine/seafloor/objects/object_surface.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

}  // namespace

FlatPartBlock::FlatPartBlock(std::span<const FlatPart> flat_parts, const CurvedFacets& curved,
                             std::size_t its_first, std::size_t its_count)
    : first(its_first), count(its_count) {
  constexpr double rounding = 1e-5;  // more than that of the normals and axes
  const std::span<const FlatPart> own = flat_parts.subspan(first, count);
  for (const FlatPart& flat_part : own) {
    middle += flat_part.middle / static_cast<double>(count);
    axis += flat_part.normal.cast<double>();
  }
  axis = axis.norm() > 0.0 ? axis.normalized() : Vector3d::UnitZ();
  double bulge_m = 0.0;  // of the surface beyond its facets, at most
  const auto turn_rad = [&](const Eigen::Vector3f& normal) {
    const double cosine = axis.dot(normal.cast<double>().normalized());
    return std::acos(std::clamp(cosine, -1.0, 1.0)) + rounding;
  };
  for (const FlatPart& flat_part : own) {
    const double half_diagonal_m =
        0.5 * std::hypot(double(flat_part.length_m), double(flat_part.width_m));
    radius_m =
        std::max(radius_m, (flat_part.middle - middle).norm() + half_diagonal_m * (1.0 + rounding));
    cone_rad = std::max(cone_rad, turn_rad(flat_part.normal));
    if (flat_part.facets == 0)
      shortest_straight_m =
          std::min({shortest_straight_m, double(flat_part.length_m), double(flat_part.width_m)});
    for (const CurvedFacet& facet : curved.of(flat_part)) {
      double reach_m = 0.0, turn = 0.0;
      for (const std::uint32_t number : facet.corners) {
        const FacetCorner& corner = curved.corners[number];
        const Vector3d place = corner.place.cast<double>();
        radius_m = std::max(radius_m, (place - middle).norm());
        cone_rad = std::max(cone_rad, turn_rad(corner.normal));
        reach_m = std::max(reach_m, (place - flat_part.middle).norm());
        turn = std::max(turn, double((corner.normal - flat_part.normal).norm()));
      }
      bulge_m = std::max(bulge_m, reach_m * turn);
      if (facet.strip)
        for (const std::size_t side : {0, 2})
          shortest_straight_m =
              std::min(shortest_straight_m, double((curved.corners[facet.corners[side + 1]].place -
                                                    curved.corners[facet.corners[side]].place)
                                                       .norm()));
    }
  }
  radius_m += bulge_m;
}

bool FlatPartBlock::may_face(const Vector3d& from, double reach, bool two_sided) const {
  const Vector3d way = from - middle;
  const double distance_m = way.norm();
  if (distance_m <= radius_m || reach >= 1.0) return true;
  // Bounds without a transcendental function: asin x <= x + (pi / 2 - 1) x^3 for 0 <= x <= 1, and
  // cos x >= 1 - x^2 / 2.
  const auto max_asin = [](double x) { return x + (0.5 * pi - 1.0) * x * x * x; };
  const double angle_rad = cone_rad + max_asin(radius_m / distance_m) + max_asin(reach);
  const double facing_m = two_sided ? std::abs(axis.dot(way)) : axis.dot(way);
  return facing_m >= distance_m * (1.0 - 0.5 * angle_rad * angle_rad);
}

ObjectSurface::ObjectSurface(refine::Triangles triangles, std::uint16_t its_label,
                             const std::function<void()>& stop_check)
    : label(its_label) {
  FlatParts found = flat_parts_of(triangles, stop_check);
  corners = right_corners(found.whole, stop_check);  // a piece shows less of an edge than the whole
  curved = std::move(found.curved);
  flat_parts = std::move(found).in_pieces();
  const refine::Bounds box = refine::bounds(triangles);
  middle = 0.5 * (box.lowest + box.highest).cast<double>();
  radius_m = 0.5 * double((box.highest - box.lowest).norm());
  constexpr std::size_t per_block = 16;
  for (std::size_t first = 0; first < flat_parts.size(); first += per_block)
    blocks.emplace_back(flat_parts, curved, first, std::min(per_block, flat_parts.size() - first));
}

void ObjectSurface::place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const {
  there = *this;
  const Eigen::Matrix3f turn = place.linear().cast<float>();
  there.middle = place * middle;
  for (FlatPart& flat_part : there.flat_parts) {
    flat_part.middle = place * flat_part.middle;
    for (Eigen::Vector3f* axis : {&flat_part.normal, &flat_part.along, &flat_part.across})
      *axis = turn * *axis;
  }
  for (FacetCorner& corner : there.curved.corners) {
    corner.place = (place * corner.place.cast<double>()).cast<float>();
    corner.normal = turn * corner.normal;
  }
  for (FlatPartBlock& block : there.blocks) {
    block.middle = place * block.middle;
    block.axis = place.linear() * block.axis;
  }
  for (RightCorner& corner : there.corners) {
    corner.middle = place * corner.middle;
    for (Eigen::Vector3f* axis : {&corner.edge, &corner.one, &corner.other}) *axis = turn * *axis;
  }
}

double nearest_flat_part_m(std::span<const ObjectSurface> objects, const Vector3d& from,
                           double farthest_m) {
  double nearest_m = farthest_m;
  const auto is_nearer = [&](const Vector3d& middle, double radius_m) {
    return (from - middle).norm() - radius_m < nearest_m;
  };
  for (const ObjectSurface& object : objects) {
    if (!is_nearer(object.middle, object.radius_m)) continue;
    for (const FlatPartBlock& block : object.blocks) {
      if (!is_nearer(block.middle, block.radius_m)) continue;
      for (const FlatPart& flat_part :
           std::span(object.flat_parts).subspan(block.first, block.count)) {
        const Vector3d off = from - flat_part.middle;
        const auto beyond_m = [&](const Eigen::Vector3f& axis, float length_m) {
          return std::max(std::abs(off.dot(axis.cast<double>())) - 0.5 * double(length_m), 0.0);
        };
        const Vector3d nearest(beyond_m(flat_part.along, flat_part.length_m),
                               beyond_m(flat_part.across, flat_part.width_m),
                               off.dot(flat_part.normal.cast<double>()));
        nearest_m = std::min(nearest_m, nearest.norm());
      }
    }
  }
  return nearest_m;
}

std::vector<ObjectSurface> object_surfaces(const Seafloor& seafloor, int threads,
                                           const std::function<void()>& stop_check) {
  const std::size_t count = seafloor.objects.size();
  if (count == 0 || seafloor.one_label()) return {};
  struct Part {
    std::uint32_t face;  // the number
    refine::Face corners;
  };
  std::vector<std::vector<Part>> parts(seafloor.labels.size());
  const auto take = [&](std::uint32_t face, const auto& corners_of) {
    const std::uint16_t label = seafloor.label_of(face);
    const std::size_t number = std::size_t{seafloor.labels[label].instance} - 1;
    if (number >= count) return;
    parts[label].push_back({face, corners_of()});
  };
  std::span<const Eigen::Vector3f> positions = seafloor.mesh.positions;
  if (const refine::ProgressiveMesh* mesh = seafloor.progressive.get()) {
    positions = mesh->points;
    for (std::size_t slot = 0; slot < mesh->faces.size(); ++slot) {
      const std::uint32_t face = mesh->source_face[slot];
      if (face < seafloor.bed_faces || face >= seafloor.faces) continue;
      take(face, [&] {
        if (slot / 2 < mesh->mid.size()) mesh->verify_node(static_cast<std::uint32_t>(slot / 2));
        const refine::Face corners = mesh->faces[slot];
        for (const std::uint32_t leaf : corners) mesh->verify_leaf(leaf);
        return corners;
      });
    }
  } else {
    const std::uint32_t first = seafloor.first_in_mesh();
    for (std::size_t i = seafloor.bed_faces - first; i < seafloor.mesh.faces.size(); ++i)
      take(first + static_cast<std::uint32_t>(i), [&] { return seafloor.mesh.faces[i]; });
  }
  std::vector<std::uint16_t> labels;  // of objects
  for (std::size_t label = 0; label < parts.size(); ++label)
    if (!parts[label].empty()) labels.push_back(static_cast<std::uint16_t>(label));
  std::vector<std::optional<ObjectSurface>> made(labels.size());
  refine::parallel_for(labels.size(), threads, [&](std::size_t i, int) {
    if (stop_check) stop_check();
    std::vector<Part>& of_object = parts[labels[i]];
    std::ranges::sort(of_object, {}, &Part::face);
    refine::TriangleMesh own;
    for (const Part& part : of_object) {
      const auto first = static_cast<std::uint32_t>(own.positions.size());
      for (const std::uint32_t corner : part.corners) own.positions.push_back(positions[corner]);
      own.faces.push_back({first, first + 1, first + 2});
    }
    made[i].emplace(own, labels[i], stop_check);
  });
  std::vector<ObjectSurface> objects;
  for (std::optional<ObjectSurface>& surface : made) objects.push_back(std::move(*surface));
  return objects;
}

}  // namespace ensonify::engine
