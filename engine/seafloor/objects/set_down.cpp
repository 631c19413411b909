#include <ensonify/engine/seafloor/objects/set_down.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/seafloor/objects/laid_line.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

using Eigen::AngleAxisd, Eigen::Vector2d, Eigen::Vector3d, Eigen::Vector3f;

constexpr double max_pieces = 5e5;   // of one line
constexpr double cover_m = 1e-3;     // thickness of the bed over an object with a burial of 1
constexpr double edge_step_m = 0.1;  // shorter than the cells of most beds
constexpr double most_steps = 1e4;   // greatest number of steps along an edge

refine::MeshError no_bed(const std::string& what, double east_m, double north_m) {
  return refine::MeshError(
      fmt::format("{}: there is no bed below this object at {:.1f} m east, {:.1f} m north; move it "
                  "over the seafloor (east_m, north_m, path or area)",
                  what, east_m, north_m));
}

/// z = height + slope . (place - middle): the least-squares fit to the bed in a rectangle.
struct Plane {
  double height_m = 0.0;
  Vector2d slope = Vector2d::Zero();
  Vector2d middle = Vector2d::Zero();
};
Plane plane_below(const refine::Bounds& box, const BedGrid& bed) {
  constexpr int samples = 8;  // per side
  const Vector2d low = box.lowest.head<2>().cast<double>();
  const Vector2d size = box.highest.head<2>().cast<double>() - low;
  const Vector2d of_box = low + 0.5 * size;
  std::vector<Vector3d> ground;  // x and y relative to the middle of the box
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i < samples; ++i)
    for (int j = 0; j < samples; ++j) {
      const Vector2d from = size.cwiseProduct(Vector2d(i + 0.5, j + 0.5) / samples) - 0.5 * size;
      const Vector2d place = of_box + from;
      const double z = bed.height_m(place.x(), place.y());
      if (std::isnan(z)) continue;
      ground.emplace_back(from.x(), from.y(), z);
      middle += ground.back();
    }
  if (ground.empty()) return {std::numeric_limits<double>::quiet_NaN()};
  middle /= static_cast<double>(ground.size());
  double xx = 0.0, xy = 0.0, yy = 0.0, xz = 0.0, yz = 0.0;
  for (const Vector3d& p : ground) {
    const Vector3d d = p - middle;
    xx += d.x() * d.x(), xy += d.x() * d.y(), yy += d.y() * d.y();
    xz += d.x() * d.z(), yz += d.y() * d.z();
  }
  // Places on one line do not define the slope across the line. This small addition makes it zero.
  const double little = 1e-9 * (xx + yy);
  xx += little, yy += little;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0.0)) return {.height_m = middle.z(), .middle = of_box};  // one place
  const Vector2d slope = Vector2d(yy * xz - xy * yz, xx * yz - xy * xz) / determinant;
  return {middle.z() - slope.dot(middle.head<2>()), slope, of_box};
}

/// Distances by which an object can be lowered; negative if it must be raised.
struct Drops {
  /// Until the object touches the bed.
  double touching_m = std::numeric_limits<double>::infinity();
  /// Until the bed covers the whole object; complete only if `to_hidden`.
  double hidden_m = -std::numeric_limits<double>::infinity();
};

/// Calls with(point) for points on the edges of a closed mesh, without the ends of the edges. The
/// points are at most step_m apart, except on edges longer than most_steps steps.
template <class With>
void between_vertices(refine::Triangles mesh, double step_m, With&& with) {
  for (const refine::Face& face : mesh.faces)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t first = face[corner], last = face[(corner + 1) % 3];
      if (first > last) continue;  // the neighbouring face has the reversed edge
      const Vector3d from = mesh.positions[first].cast<double>();
      const Vector3d edge = mesh.positions[last].cast<double>() - from;
      const int steps = static_cast<int>(std::ceil(std::min(edge.norm() / step_m, most_steps)));
      for (int i = 1; i < steps; ++i) with(from + edge * i / steps);
    }
}

/// Calls with(height of face over vertex) for each face and vertex of the bed on one vertical line.
template <class With>
void over_bed_vertices(refine::Triangles object, const BedGrid& bed, With&& with) {
  constexpr double slack = 1e-9;  // so that no vertex is missed between two faces
  for (const refine::Face& face : object.faces) {
    const std::array<Vector3f, 3> corners{object.positions[face[0]], object.positions[face[1]],
                                          object.positions[face[2]]};
    const Vector3d a = corners[0].cast<double>();
    const Vector3d ab = corners[1].cast<double>() - a, ac = corners[2].cast<double>() - a;
    const double area = ab.x() * ac.y() - ab.y() * ac.x();
    if (area == 0.0) continue;  // upright; other faces have the same edges
    const refine::Bounds box{corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
                             corners[0].cwiseMax(corners[1]).cwiseMax(corners[2])};
    for (const Vector3f& vertex : bed.vertices_within(box)) {
      const Vector3d way = vertex.cast<double>() - a;
      const double to_b = (way.x() * ac.y() - way.y() * ac.x()) / area;
      const double to_c = (ab.x() * way.y() - ab.y() * way.x()) / area;
      if (std::min({to_b, to_c, 1.0 - to_b - to_c}) < -slack) continue;
      with(to_b * ab.z() + to_c * ac.z() - way.z());
    }
  }
}

Drops drops_of(refine::Triangles object, const BedGrid& bed, bool to_hidden) {
  Drops drops;
  const auto meet = [&](double over_bed_m) {
    drops.touching_m = std::min(drops.touching_m, over_bed_m);
    drops.hidden_m = std::max(drops.hidden_m, over_bed_m);
  };
  for (const Vector3f& p : object.positions)
    if (const double z = bed.height_m(p.x(), p.y()); !std::isnan(z)) meet(p.z() - z);
  over_bed_vertices(object, bed, meet);
  if (to_hidden)
    between_vertices(object, edge_step_m, [&](const Vector3d& p) {
      if (const double z = bed.height_m(p.x(), p.y()); !std::isnan(z))
        drops.hidden_m = std::max(drops.hidden_m, p.z() - z);
    });
  return drops;
}

/// The share of an object's height, measured from a plane, that is under the plane.
double buried_share(refine::Triangles object, const Plane& plane) {
  float lowest_m = std::numeric_limits<float>::infinity(), highest_m = -lowest_m;
  for (const Vector3f& p : object.positions) {
    const Vector2d from_middle = p.head<2>().cast<double>() - plane.middle;
    const auto height_m = static_cast<float>(p.z() - plane.slope.dot(from_middle));
    lowest_m = std::min(lowest_m, height_m);
    highest_m = std::max(highest_m, height_m);
  }
  const double shape_height_m = highest_m - lowest_m;
  return shape_height_m > 0.0 ? std::clamp((plane.height_m - lowest_m) / shape_height_m, 0.0, 1.0)
                              : 0.0;
}

/// Typical values if sag_radius_m is unset: a stiff pipe spans gaps, a chain follows the ground.
double usual_sag_radius_m(const std::string& shape) {
  if (shape == "pipeline") return 1000.0;
  return shape == "cable" ? 50.0 : 3.0;
}

/// Sinks a line into the bed by its burial times `covered_m`. The burial changes along the line as
/// a normal process whose correlation over a distance s is exp(-s^2 / (2 scale^2)): a sum of waves
/// with random phases and with normal wavenumbers of the standard deviation 1 / scale.
void sink(std::vector<Vector3d>& line, const ObjectOptions& object, double covered_m,
          const RandomStream& stream) {
  constexpr std::size_t waves = 64;
  std::array<double, waves> wavenumber{}, phase{};
  if (object.burial_spread > 0.0) {
    stream.normal(wavenumber);
    stream.uniform(phase, waves);
  }
  const double mean = object.burial.value_or(0.0);
  double along_m = 0.0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) along_m += (line[i] - line[i - 1]).head<2>().norm();
    double change = 0.0;
    if (object.burial_spread > 0.0)
      for (std::size_t k = 0; k < waves; ++k)
        change += std::cos(wavenumber[k] * along_m / object.burial_scale_m +
                           2.0 * std::numbers::pi * phase[k]);
    change *= object.burial_spread * std::sqrt(2.0 / waves);
    line[i].z() -= std::max(mean + change, 0.0) * covered_m;
  }
}

}  // namespace

Eigen::Matrix3d attitude(const ObjectOptions& object, double heading_rad) {
  return (AngleAxisd(-heading_rad, Vector3d::UnitZ()) *
          AngleAxisd(object.pitch_rad, Vector3d::UnitX()) *
          AngleAxisd(object.roll_rad, Vector3d::UnitY()))
      .toRotationMatrix();
}

SetDown set_down(const refine::TriangleMesh& mesh, const ObjectOptions& object, const Spot& spot,
                 const BedGrid& bed, const std::string& what, double sunk_m) {
  SetDown placed{.mesh = mesh};
  placed.mesh.rounding_m *= spot.scale;
  placed.mesh.place = {spot.east_m, spot.north_m, 0.0};
  const Vector3d middle = refine::bounds(mesh).middle();
  refine::TriangleMesh in_floats;  // in floats, like the bed
  const auto put = [&](const Eigen::Matrix3d& turn, double z_m) {
    placed.mesh.place.z() = z_m;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      placed.mesh.positions[i] = spot.scale * (turn * (mesh.positions[i].cast<double>() - middle));
    in_floats = placed.mesh.in_floats();
  };
  Eigen::Matrix3d turn = attitude(object, spot.heading_rad);
  put(turn, 0.0);
  if (object.follow_slope) {
    const Plane plane = plane_below(refine::bounds(in_floats), bed);
    if (std::isnan(plane.height_m)) throw no_bed(what, spot.east_m, spot.north_m);
    const Vector3d normal(-plane.slope.x(), -plane.slope.y(), 1.0);
    turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal).toRotationMatrix() * turn;
    put(turn, 0.0);
  }
  const double burial = object.burial.value_or(0.0);
  const Drops drops = drops_of(in_floats, bed, burial > 0.0);
  if (!std::isfinite(drops.touching_m)) throw no_bed(what, spot.east_m, spot.north_m);
  double lowered_m = drops.touching_m + spot.scale * sunk_m;
  if (burial > 0.0) lowered_m += burial * (drops.hidden_m + cover_m - drops.touching_m);
  put(turn, object.height_m.value_or(0.0) - lowered_m);
  Plane below = plane_below(refine::bounds(in_floats), bed);
  if (!object.follow_slope) below.slope.setZero();
  placed.buried = buried_share(in_floats, below);
  return placed;
}

SetDown lay_down(const ObjectOptions& object, const Spot& spot, const BedGrid& bed,
                 const std::string& what, const RandomStream& burial) {
  const ShapeKind& kind = shape_named(object.shape);
  ShapeSize size = object.size;
  for (const Dimension& dimension : kind.dimensions)
    size.*dimension.size = spot.scale * kind.size_m(object.size, dimension.size);
  const double diameter_m = line_diameter_m(kind, size);
  const Eigen::Rotation2Dd turn(-spot.heading_rad);
  std::vector<Vector2d> path;  // relative to the spot
  for (const Vector2d& place : object.path) path.emplace_back(spot.scale * (turn * place));
  const auto ground_m = [&](const Vector2d& place) {
    const double x = spot.east_m + place.x(), y = spot.north_m + place.y();
    const double z = bed.height_m(x, y);
    if (std::isnan(z)) throw no_bed(what, x, y);
    return z;
  };
  const double step_m = object.size.facet_m.value_or(std::clamp(diameter_m, 0.05, 1.0));
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) length_m += (path[i + 1] - path[i]).norm();
  if (length_m > max_pieces * std::min(step_m, diameter_m))
    throw refine::MeshError(fmt::format(
        "{}: its {:.0f} m make more than {:.0e} pieces; make it shorter or thicker, or its facet_m "
        "larger",
        what, length_m, max_pieces));
  std::vector<Vector3d> line = laid_line(
      path, diameter_m, step_m, object.sag_radius_m.value_or(usual_sag_radius_m(object.shape)),
      object.height_m.value_or(0.0), ground_m);
  sink(line, object, diameter_m + cover_m, burial);
  SetDown placed{.mesh = make_line(kind, size, line)};
  placed.mesh.place += Vector3d(spot.east_m, spot.north_m, 0.0);
  if (placed.mesh.faces.empty())
    throw refine::MeshError(fmt::format(
        "{}: its {:.3g} m are too short for a link; make it longer or its rod_m smaller", what,
        length_m));
  double buried = 0.0;  // sum over the points of the line
  for (const Vector3d& p : line)
    buried += std::clamp((ground_m(p.head<2>()) - p.z()) / diameter_m + 0.5, 0.0, 1.0);
  placed.buried = buried / static_cast<double>(line.size());
  return placed;
}

}  // namespace ensonify::engine
