#include <ensonify/engine/seafloor/objects/object_surface.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {

using Eigen::Vector3d;
using std::numbers::pi;

FlatPartBlock::FlatPartBlock(std::span<const FlatPart> flat_parts, const CurvedFacets& curved,
                             std::size_t its_first, std::size_t its_count)
    : first(its_first), count(its_count) {
  constexpr double rounding = 1e-5;  // more than the rounding of normals and axes
  const std::span<const FlatPart> own = flat_parts.subspan(first, count);
  for (const FlatPart& flat_part : own) {
    middle += flat_part.middle / static_cast<double>(count);
    axis += flat_part.normal.cast<double>();
  }
  axis = axis.norm() > 0.0 ? axis.normalized() : Vector3d::UnitZ();
  double bulge_m = 0.0;  // greatest distance of the curved surface beyond its facets
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
        radius_m = std::max(radius_m, (corner.place - middle).norm());
        cone_rad = std::max(cone_rad, turn_rad(corner.normal));
        reach_m = std::max(reach_m, (corner.place - flat_part.middle).norm());
        turn = std::max(turn, double((corner.normal - flat_part.normal).norm()));
      }
      bulge_m = std::max(bulge_m, reach_m * turn);
      if (facet.strip)
        for (const std::size_t side : {0, 2})
          shortest_straight_m =
              std::min(shortest_straight_m, (curved.corners[facet.corners[side + 1]].place -
                                             curved.corners[facet.corners[side]].place)
                                                .norm());
    }
  }
  radius_m += bulge_m;
}

bool FlatPartBlock::may_face(const Vector3d& from, double reach, bool two_sided) const {
  const Vector3d way = from - middle;
  const double distance_m = way.norm();
  if (distance_m <= radius_m || reach >= 1.0) return true;
  // The bounds need no transcendental function: asin x <= x + (pi / 2 - 1) x^3 for 0 <= x <= 1, and
  // cos x >= 1 - x^2 / 2.
  const auto max_asin = [](double x) { return x + (0.5 * pi - 1.0) * x * x * x; };
  const double angle_rad = cone_rad + max_asin(radius_m / distance_m) + max_asin(reach);
  const double facing_m = two_sided ? std::abs(axis.dot(way)) : axis.dot(way);
  return facing_m >= distance_m * (1.0 - 0.5 * angle_rad * angle_rad);
}

ObjectSurface::ObjectSurface(const ObjectMesh& mesh, std::uint16_t its_label,
                             const std::function<void()>& stop_check)
    : label(its_label) {
  FlatParts found = flat_parts_of(mesh, stop_check);
  corners = right_corners(found.whole, stop_check);  // a piece has only a part of an edge
  curved = std::move(found.curved);
  flat_parts = std::move(found).in_pieces();
  const Eigen::AlignedBox3d box = mesh.box();
  middle = box.center();
  radius_m = 0.5 * box.diagonal().norm();
  constexpr std::size_t per_block = 16;
  for (std::size_t first = 0; first < flat_parts.size(); first += per_block)
    blocks.emplace_back(flat_parts, curved, first, std::min(per_block, flat_parts.size() - first));
  move(Eigen::Isometry3d(Eigen::Translation3d(mesh.place)));
}

void ObjectSurface::place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const {
  there = *this;
  there.move(place);
}

void ObjectSurface::move(const Eigen::Isometry3d& motion) {
  const Eigen::Matrix3f turn = motion.linear().cast<float>();
  middle = motion * middle;
  for (FlatPart& flat_part : flat_parts) {
    flat_part.middle = motion * flat_part.middle;
    for (Eigen::Vector3f* axis : {&flat_part.normal, &flat_part.along, &flat_part.across})
      *axis = turn * *axis;
  }
  for (FacetCorner& corner : curved.corners) {
    corner.place = motion * corner.place;
    corner.normal = turn * corner.normal;
  }
  for (FlatPartBlock& block : blocks) {
    block.middle = motion * block.middle;
    block.axis = motion.linear() * block.axis;
  }
  for (RightCorner& corner : corners) {
    corner.middle = motion * corner.middle;
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
  struct Part {  // the faces of an object that have one label
    const ObjectMesh* mesh = nullptr;
    std::vector<refine::Face> faces;
  };
  std::vector<Part> parts(seafloor.labels.size());
  auto number = static_cast<std::uint32_t>(seafloor.bed_faces);  // number of a face
  for (const ObjectMesh& mesh : seafloor.object_meshes)
    for (const refine::Face& face : mesh.faces) {
      Part& part = parts[seafloor.label_of(number++)];
      part.mesh = &mesh;
      part.faces.push_back(face);
    }
  std::vector<std::uint16_t> labels;  // of objects
  for (std::size_t label = 0; label < parts.size(); ++label)
    if (parts[label].mesh) labels.push_back(static_cast<std::uint16_t>(label));
  std::vector<ObjectSurface> objects(labels.size());
  refine::parallel_for(labels.size(), threads, [&](std::size_t i, int) {
    if (stop_check) stop_check();
    Part& part = parts[labels[i]];
    ObjectMesh own = *part.mesh;
    own.faces = std::move(part.faces);
    objects[i] = ObjectSurface(own, labels[i], stop_check);
  });
  return objects;
}

}  // namespace ensonify::engine
