#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/objects/solids.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// Sizes of a common link / thickness of its rod (ISO 1704: 6 long, 3.6 wide outside).
constexpr double link_pitch = 4.0, link_half_width = 1.3;

constexpr double rounding = 3e-8;  // relative, as for other shapes, which are made in floats

/// Adds one link with its length along `way`: a rod with two straight sides and two half circles.
void add_link(Solids& solids, const Vector3d& middle, const Vector3d& way, const Vector3d& across,
              double rod_m) {
  constexpr int arc_points = 6;
  const double half_side_m = (0.5 * (link_pitch + 1.0) - link_half_width) * rod_m;
  const double radius_m = link_half_width * rod_m;
  std::vector<Vector3d> loop;
  for (const double end : {1.0, -1.0})
    for (int k = 0; k <= arc_points; ++k) {
      const double angle = pi * (static_cast<double>(k) / arc_points - 0.5);
      loop.emplace_back(middle + end * ((half_side_m + radius_m * std::cos(angle)) * way +
                                        radius_m * std::sin(angle) * across));
    }
  solids.sweep(loop, circle(0.5 * rod_m, 8), way.cross(across), true);
}

void add_chain(Solids& solids, std::span<const Vector3d> points, double rod_m) {
  const double pitch_m = link_pitch * rod_m;
  double along_m = 0.5 * pitch_m;  // place of the next link, from the start of this piece
  bool leans_left = false;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double piece_m = (points[i + 1] - points[i]).norm();
    const Vector3d way = (points[i + 1] - points[i]) / piece_m;
    const Vector3d right = way.cross(Vector3d::UnitZ()).normalized();
    const Vector3d up = right.cross(way);
    for (; along_m < piece_m; along_m += pitch_m, leans_left = !leans_left)
      add_link(solids, points[i] + along_m * way, way,
               (up + (leans_left ? -1.0 : 1.0) * right).normalized(), rod_m);
    along_m -= piece_m;
  }
}

}  // namespace

double line_diameter_m(const ShapeKind& kind, const ShapeSize& size) {
  if (kind.name != "chain") return kind.size_m(size, &ShapeSize::diameter_m);
  // The links of a chain are tilted by 45 degrees, alternately to the left and to the right.
  return (std::sqrt(2.0) * link_half_width + 1.0) * kind.size_m(size, &ShapeSize::rod_m);
}

ObjectMesh make_line(const ShapeKind& kind, const ShapeSize& size,
                     std::span<const Vector3d> points) {
  if (!kind.along_path || points.size() < 2)
    throw std::invalid_argument(
        fmt::format("a {} cannot be laid along {} points", kind.name, points.size()));
  std::vector<Vector3d> own;
  for (const Vector3d& point : points) own.emplace_back(point - points.front());
  const double diameter_m = line_diameter_m(kind, size);
  Solids solids;
  if (kind.name == "chain") {
    add_chain(solids, own, kind.size_m(size, &ShapeSize::rod_m));
  } else {
    const double usual_m =
        std::min(diameter_m / 8.0, 0.5 * diameter_m * size.facet_rad.value_or(pi));
    const double facet_m = size.facet_m.value_or(usual_m);
    solids.sweep(own,
                 circle(0.5 * diameter_m, static_cast<int>(std::clamp(
                                              std::ceil(pi * diameter_m / facet_m), 8.0, 256.0))));
  }
  ObjectMesh line;
  line.positions = std::move(solids.exact);
  line.faces = std::move(solids.mesh.faces);
  line.place = points.front();
  line.rounding_m = rounding * diameter_m;
  return line;
}

}  // namespace ensonify::engine
