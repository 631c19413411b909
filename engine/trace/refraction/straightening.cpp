#include <ensonify/engine/trace/refraction/straightening.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace ensonify::engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using scatter::SoundSpeedLayer;
using scatter::SoundSpeedProfile;

constexpr double clearance_m = 0.1;     // all faces lie at least so far below the source
constexpr double min_spreading = 0.01;  // as a share of the path squared, as in SoundRay

/// The fastest speed between two depths.
double fastest_mps(const SoundSpeedProfile& profile, double from_m, double to_m) {
  double fastest = std::max(profile.speed_mps(from_m), profile.speed_mps(to_m));
  for (const SoundSpeedLayer& layer : profile.layers())
    if (layer.top_m > from_m && layer.top_m < to_m) fastest = std::max(fastest, layer.top_mps);
  return fastest;
}

/// Where the point of a piece in straightened space is in the sea, if the map is linear over it.
Vector3d place_in_sea(const Straightening::Piece& piece, const Vector3d& straightened) {
  const auto& [a, b, c] = piece.straightened;
  const Vector3d first = a.cast<double>(), ab = b.cast<double>() - first,
                 ac = c.cast<double>() - first, way = straightened - first;
  const Vector3d normal = ab.cross(ac);
  const double per_area = 1.0 / normal.squaredNorm();
  const double to_b = way.cross(ac).dot(normal) * per_area,
               to_c = ab.cross(way).dot(normal) * per_area;
  return piece.in_sea[0] + to_b * (piece.in_sea[1] - piece.in_sea[0]) +
         to_c * (piece.in_sea[2] - piece.in_sea[0]);
}

}  // namespace

Straightening::Straightening(const SoundSpeedProfile& profile, double shallowest_m,
                             double deepest_m, double reference_mps)
    : profile_(&profile),
      shallowest_m_(shallowest_m),
      reference_mps_(reference_mps),
      eigenrays_(profile, shallowest_m, deepest_m) {}

void Straightening::start(const RayFan& fan) {
  fan_ = &fan;
  const double source_m = -fan.origin.z();
  source_mps_ = profile_->speed_mps(source_m);
  eigenrays_.start_at(source_m);
  fastest_above_mps_ = fastest_mps(*profile_, std::min(0.0, source_m), source_m);
  highest_face_m_ = std::max(shallowest_m_, source_m + clearance_m);
  // The range at which the flattest known ray reaches that depth. Flatter rays that go down reach
  // it farther out, if none of them turns first.
  const bool none_turns = fastest_mps(*profile_, source_m, highest_face_m_) <= source_mps_;
  min_range_m_ = none_turns ? eigenrays_.rays().farthest_m(highest_face_m_) : 0.0;
  longest_m_ = way_down_m(flattest());
  slowest_above_mps_ = source_mps_;
  steepest_above_ = 0.0;
  for (const SoundSpeedLayer& layer : profile_->layers())
    if (layer.top_m < source_m) {
      slowest_above_mps_ = std::min({slowest_above_mps_, layer.top_mps, layer.bottom_mps});
      steepest_above_ = std::max(steepest_above_, -layer.gradient_per_s);
    }
}

bool Straightening::move(const Vector3d& point, RayToPoint& ray, Vector3f& to) {
  to.setZero();
  const Vector2d out = (point - fan_->origin).head<2>();
  const double range_m = out.norm(), below_m = fan_->origin.z() - point.z();
  if (!(below_m > clearance_m)) return false;
  scatter::DirectRays::Eigenray way;
  if (!eigenrays_.find(range_m, -point.z(), way)) {
    ray = {};
    return true;
  }
  const double sine = 1.0 / std::sqrt(1.0 + way.cotangent * way.cotangent);
  const double t = reference_mps_ * way.time_s;
  const double level = range_m > 0.0 ? t * way.cotangent * sine / range_m : 0.0;
  to = Vector3d(level * out.x(), level * out.y(), -t * sine).cast<float>();
  ray.cotangent = way.cotangent;
  const double cosine = way.cotangent * sine;
  const double along = cosine * way.sound_speed_mps / source_mps_;  // Snell
  const double down = std::sqrt(1.0 - along * along);
  const double spread_m = way.range_per_cotangent_m / (sine * sine) * down;
  // A step along the ray changes its time, a step across it its launch direction. So they become
  // steps along and across the launch direction, with these factors.
  const double forwards = reference_mps_ / way.sound_speed_mps, across = t / spread_m;
  const double out_by_out = forwards * cosine * along + across * sine * down;
  const double out_by_down = forwards * cosine * down - across * sine * along;
  const double down_by_out = forwards * sine * along - across * cosine * down;
  const double down_by_down = forwards * sine * down + across * cosine * along;
  const bool aside = cosine > 1e-6;  // else straight below
  const double sideways = aside ? level : t / way.range_per_cotangent_m;
  const double x = aside ? out.x() / range_m : 1.0, y = aside ? out.y() / range_m : 0.0;
  const double aslant = (out_by_out - sideways) * x * y;
  Matrix3d jacobian;
  jacobian << out_by_out * x * x + sideways * y * y, aslant, -out_by_down * x,  //
      aslant, out_by_out * y * y + sideways * x * x, -out_by_down * y,          //
      -down_by_out * x, -down_by_out * y, down_by_down;
  ray.jacobian.topRows<3>() = jacobian.cast<float>();
  return true;
}

bool Straightening::move(std::span<const float> x_m, double y_m, std::span<const float> z_m,
                         const MovedPointRows& to) {
  using Grid = scatter::EigenrayGrid;
  const Vector3d& source = fan_->origin;
  const auto cell_of = [&](std::size_t i) {
    const Vector2d out(double{x_m[i]} - source.x(), y_m - source.y());
    return eigenrays_.cell_of(out.norm(), -double{z_m[i]});
  };
  std::optional<Grid::CellNumber> cell = cell_of(0);
  for (std::size_t first = 0, end; first < x_m.size(); first = end) {
    std::optional<Grid::CellNumber> next;
    for (end = first + 1; end < x_m.size() && (next = cell_of(end)) == cell;) ++end;
    const std::optional<Grid::Patch> patch =
        cell ? eigenrays_.patch_of(*cell) : std::optional<Grid::Patch>();
    const MovedPointRows here{to.positions + 4 * first, to.jacobians + first, to.jacobian_room};
    if (patch)
      straighten_points({.count = end - first,
                         .x_m = &x_m[first],
                         .z_m = &z_m[first],
                         .y_m = y_m,
                         .source_m = {source.x(), source.y(), source.z()},
                         .source_mps = source_mps_,
                         .reference_mps = reference_mps_,
                         .top_m = patch->top_m,
                         .per_m = patch->per_m,
                         .top_mps = patch->top_mps,
                         .gradient_per_s = patch->gradient_per_s,
                         .column = patch->column,
                         .columns = double{Grid::columns},
                         .slope_scale = Grid::slope_scale,
                         .straight_over_launch = patch->straight_over_launch,
                         .time_s_per_m = patch->time_s_per_m},
                        here);
    else
      for (std::size_t i = first; i < end; ++i) {
        RayToPoint ray;
        Vector3f moved;
        if (!move({double{x_m[i]}, y_m, double{z_m[i]}}, ray, moved) ||
            ray.cotangent == std::numeric_limits<double>::infinity())
          return false;
        Eigen::Map<Eigen::Vector4f>(to.positions + 4 * i) << moved, 0.0f;
        for (std::size_t k = 0; k < 9; ++k)
          to.jacobians[k * to.jacobian_room + i] =
              ray.jacobian(static_cast<Eigen::Index>(k % 3), static_cast<Eigen::Index>(k / 3));
      }
    cell = next;
  }
  return true;
}

// A curve of constant second derivative is off by an eighth of the difference of its tangents at
// the ends. The Jacobians turn with the direction to the point. So an edge across the rays is bent,
// too, although rays of equal length lead to its ends.
float Straightening::bow8_m2(const RayToPoint& a, const RayToPoint& b, const Vector3f& edge) {
  return ((b.jacobian - a.jacobian) * edge).squaredNorm();
}

// If the middles of three edges are off by one bow, the middle of the face is off by 4/3 of it.
float Straightening::most_bow8_m2(double tolerance_m) {
  return static_cast<float>(std::pow(8.0 * 0.75 * tolerance_m, 2));
}

double Straightening::way_down_m(double cotangent) const {
  scatter::DirectRays::Eigenray way;
  eigenrays_.rays().follow(cotangent, highest_face_m_, way);
  return reference_mps_ * way.time_s;
}

/// The least way of a ray that first climbs to the water that is fast enough to turn it, and comes
/// back.
double Straightening::way_back_m(double level) const {
  const double height_m = (source_mps_ / level - source_mps_) / steepest_above_;
  const double slow = level * slowest_above_mps_ / source_mps_;
  return 2.0 * height_m * reference_mps_ / (fastest_above_mps_ * std::sqrt(1.0 - slow * slow));
}

// Whether the ray can be at the depth of the highest face within range. Of two rays, upwards or
// downwards, the flatter one has the smaller sine at each depth, so that it takes longer from the
// source's depth down.
bool Straightening::may_hit(double level, double down) const {
  const double range_m = fan_->range_m;
  const double above_m = down < 0.0 && steepest_above_ > 0.0 ? way_back_m(level) : 0.0;
  if (!(above_m <= range_m)) return false;
  const bool known = level < flattest() * std::abs(down);
  if (above_m + (known ? way_down_m(level / std::abs(down)) : longest_m_) > range_m) return false;
  // An upward ray returns only if faster water above turns it (Snell). After that, like a downward
  // ray, it lies beyond the flattest known ray at every depth, unless it is steeper.
  if (down <= 0.0 && fastest_above_mps_ * level <= source_mps_) return false;
  return std::abs(down) * flattest() > level || min_range_m_ <= range_m * fan_->bend.lengthening;
}

// One ray is known: the ray to the place where the hit would be if the piece were flat in
// straightened space. The fan's ray is next to the known ray, at a distance far below their radius
// of curvature. At one depth the fan's ray is farther out, by the difference of their cotangents
// (times range_per_cotangent_m), and later, by Snell's constant times this distance. From there it
// goes straight on to the plane of the face.
RayIncidence Straightening::incidence(std::size_t number, const Piece& piece, Hit& hit) {
  const RayFan& fan = *fan_;
  const Vector3d direction =
      fan.direction(fan.plane_direction(number / fan.elevations()), number % fan.elevations());
  const auto& [a, b, c] = piece.in_sea;
  const Vector3d normal = (b - a).cross(c - a);
  Vector3d point = place_in_sea(piece, hit.t * direction);
  const double level = direction.head<2>().norm(), sine = -direction.z();
  const double cotangent = level / sine, snell = level / source_mps_;
  const Vector2d outwards = level > 1e-6 ? Vector2d(direction.head<2>() / level) : Vector2d::Zero();
  double range_m = (point - fan.origin).head<2>().norm();
  scatter::DirectRays::Eigenray way;
  if (!eigenrays_.find(range_m, -point.z(), way))  // beyond the last by rounding
    way = {cotangent,
           hit.t / reference_mps_,
           hit.t,
           range_m / cotangent,
           profile_->speed_mps(-point.z()),
           hit.t * profile_->mean_absorption_db_per_m(-fan.origin.z(), -point.z())};
  const double along = snell * way.sound_speed_mps;
  const double down = std::sqrt(std::max(0.0, 1.0 - along * along));
  const Vector3d travel(along * outwards.x(), along * outwards.y(), -down);
  Vector3d near = point;
  double farther_m = 0.0;
  if (level > 1e-6) {
    farther_m = (cotangent - way.cotangent) * way.range_per_cotangent_m;
    near.head<2>() = fan.origin.head<2>() + (range_m + farther_m) * outwards;
  }
  const double step_m = normal.dot(a - near) / normal.dot(travel);
  if (std::abs(step_m) < longest_edge_m) {  // else seen edge on
    point = near + step_m * travel;
    range_m += farther_m + step_m * along;
    hit.t = reference_mps_ * (way.time_s + snell * farther_m + step_m / way.sound_speed_mps);
  }
  const double spread_m = way.range_per_cotangent_m * (1.0 + cotangent * cotangent) * down;
  const double sideways_m = level > 1e-6 ? range_m / level : way.range_per_cotangent_m;
  const double per_t = 1.0 / hit.t, speeds = source_mps_ / way.sound_speed_mps;
  // At one depth cos(angle) / c is Snell's constant, which gives the turn from ray to ray.
  const double curvature_per_m =
      snell * profile_->layers()[profile_->layer_index(-point.z())].gradient_per_s;
  const double onwards = way.sound_speed_mps / reference_mps_;
  return {.place = point,
          .direction = travel,
          .spreading_m2 = speeds * speeds *
                          std::max(spread_m * sideways_m, min_spreading * way.path_m * way.path_m),
          .absorption_db = way.absorption_db,
          .along = onwards,
          .upwards = std::max(spread_m * per_t, 0.01),
          .sideways = sideways_m * per_t,
          .turn_along = curvature_per_m * onwards,
          .turn_upwards =
              (sine / speeds - curvature_per_m * spread_m * along) / std::max(down, 1e-6) * per_t,
          .turn_sideways = per_t / speeds};
}

}  // namespace ensonify::engine
