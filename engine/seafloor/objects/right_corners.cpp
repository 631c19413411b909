#include <ensonify/engine/seafloor/objects/right_corners.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/base/work_control.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

/// The ends of a flat part along `axis`, relative to `from`, from the part's second moments.
struct Reach {
  double low_m, high_m;
  Reach(const FlatPart& flat_part, const Vector3d& from, const Vector3d& axis) {
    const double half_m =
        0.5 * std::hypot(double(flat_part.length_m) * axis.dot(flat_part.along.cast<double>()),
                         double(flat_part.width_m) * axis.dot(flat_part.across.cast<double>()));
    const double middle_m = axis.dot(flat_part.middle - from);
    low_m = middle_m - half_m;
    high_m = middle_m + half_m;
  }
};

bool are_square(const FlatPart& a, const FlatPart& b) {
  return std::abs(a.normal.cast<double>().dot(b.normal.cast<double>())) <= std::sin(degree);
}

/// Adds the corners of two perpendicular flat parts: in front of both, behind both, and in front of
/// one and behind the other.
void add_corners(const FlatPart& a, const FlatPart& b, std::vector<RightCorner>& corners) {
  // Shares of a flat part's length: greatest gap between edge and part, and least length beyond the
  // edge. The rectangle of a right triangle's moments extends 6 % beyond the triangle's sides.
  constexpr double gap = 0.02, beyond = 0.07;
  const Vector3d m = a.normal.cast<double>(), n = b.normal.cast<double>();
  const Vector3d edge = m.cross(n).normalized();
  const Vector3d in_a = edge.cross(m), in_b = n.cross(edge);  // nearly n and m
  // The point of the edge that is nearest to the middle of `a`.
  const Vector3d on_edge = a.middle + in_a * (n.dot(b.middle - a.middle) / n.dot(in_a));
  const Reach along_a(a, on_edge, edge), along_b(b, on_edge, edge);
  const double from_m = std::max(along_a.low_m, along_b.low_m);
  const double until_m = std::min(along_a.high_m, along_b.high_m);
  if (!(until_m > from_m)) return;
  // Length of the flat part from the edge; 0 if the part does not begin at the edge.
  const auto reach_m = [&](const FlatPart& flat_part, const Vector3d& way) {
    const Reach reach(flat_part, on_edge, way);
    const double length_m = reach.high_m - reach.low_m;
    return reach.low_m < gap * length_m && reach.high_m > beyond * length_m ? reach.high_m : 0.0;
  };
  for (const double front : {1.0, -1.0})
    for (const double other_front : {1.0, -1.0}) {
      const Vector3d one = other_front * in_a, other = front * in_b;
      const double one_m = reach_m(a, one), other_m = reach_m(b, other);
      if (!(one_m > 0.0 && other_m > 0.0)) continue;
      corners.push_back({.middle = on_edge + 0.5 * (from_m + until_m) * edge,
                         .edge = edge.cast<float>(),
                         .one = one.cast<float>(),
                         .other = other.cast<float>(),
                         .length_m = static_cast<float>(until_m - from_m),
                         .one_m = static_cast<float>(one_m),
                         .other_m = static_cast<float>(other_m),
                         .excess_rad = static_cast<float>(-std::asin(one.dot(other))),
                         .open = front > 0.0 && other_front > 0.0,
                         .surface = 0});
    }
}

/// A flat part that is not curved, with the radius of a ball around the part's rectangle and the
/// gap that add_corners() allows.
struct EdgedPart {
  const FlatPart* flat_part;
  double radius_m;
  bool touches(const EdgedPart& other) const {
    const double apart_m = radius_m + other.radius_m;
    return (other.flat_part->middle - flat_part->middle).squaredNorm() <= apart_m * apart_m;
  }
};

using PartPair = std::pair<std::uint32_t, std::uint32_t>;

/// The pairs of flat parts that touch and are perpendicular, in order. They are found by a sweep
/// along the axis on which the middles of the parts are farthest apart.
std::vector<PartPair> square_pairs(std::span<const EdgedPart> planes,
                                   const std::function<void()>& stop_check) {
  std::vector<PartPair> pairs;
  if (planes.empty()) return pairs;
  Eigen::AlignedBox3d middles;
  for (const EdgedPart& plane : planes) middles.extend(plane.flat_part->middle);
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const auto low_m = [&](std::uint32_t i) {
    return planes[i].flat_part->middle[axis] - planes[i].radius_m;
  };
  std::vector<std::uint32_t> order(planes.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::ranges::sort(order, {}, low_m);
  RareStopCheck check_stop(stop_check);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const EdgedPart& one = planes[order[i]];
    const double high_m = one.flat_part->middle[axis] + one.radius_m;
    for (std::size_t k = i + 1; k < order.size() && low_m(order[k]) <= high_m; ++k) {
      check_stop();
      const EdgedPart& other = planes[order[k]];
      if (one.touches(other) && are_square(*one.flat_part, *other.flat_part))
        pairs.emplace_back(std::minmax(order[i], order[k]));
    }
  }
  std::ranges::sort(pairs);
  return pairs;
}

}  // namespace

std::vector<RightCorner> right_corners(std::span<const FlatPart> flat_parts,
                                       const std::function<void()>& stop_check) {
  std::vector<EdgedPart> planes;
  std::uint32_t surface = 0;
  for (const FlatPart& flat_part : flat_parts) {
    surface = std::max(surface, flat_part.surface);
    if (flat_part.facets == 0)
      planes.push_back(
          {&flat_part, 0.525 * std::hypot(double(flat_part.length_m), double(flat_part.width_m))});
  }
  std::vector<RightCorner> corners;
  for (const auto& [one, other] : square_pairs(planes, stop_check))
    add_corners(*planes[one].flat_part, *planes[other].flat_part, corners);
  for (RightCorner& corner : corners) corner.surface = ++surface;
  return corners;
}

}  // namespace ensonify::engine
