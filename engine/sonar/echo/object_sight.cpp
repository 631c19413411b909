#include <ensonify/engine/sonar/echo/object_sight.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// Sets how much rays show of cells, by seen_of(column, row). A cell that no ray shows gets the
/// mean of the others. None if no ray shows any cell.
template <class SeenOf>
std::optional<SeenCells> shown(SeenCells cells, const SeenOf& seen_of) {
  constexpr double not_shown = -1.0;
  double count = 0.0, sum = 0.0;
  cells.least = 1.0;
  for (std::size_t column = 0; column < cells.level.count; ++column)
    for (std::size_t row = 0; row < cells.up.count; ++row) {
      const std::optional<double> seen = seen_of(column, row);
      cells.seen[column][row] = seen.value_or(not_shown);
      if (!seen) continue;
      count += 1.0, sum += *seen;
      cells.least = std::min(cells.least, *seen);
      cells.most = std::max(cells.most, *seen);
    }
  if (!(count > 0.0)) return std::nullopt;
  for (std::size_t column = 0; column < cells.level.count; ++column)
    for (std::size_t row = 0; row < cells.up.count; ++row)
      if (cells.seen[column][row] == not_shown) cells.seen[column][row] = sum / count;
  return cells;
}

}  // namespace

ObjectSight::ObjectSight(const Medium& medium, double wavelength_m, double bin_m,
                         std::function<double(double x_m, double y_m)> bed_height_m)
    : medium_(medium),
      wavelength_m_(wavelength_m),
      tolerance_m_(0.5 * bin_m),
      bed_height_m_(std::move(bed_height_m)) {}

void ObjectSight::look(const SectorView& view, const FanHits& first) {
  view_ = &view;
  first_ = first;
}

/// The ray to a place; none in a shadow zone of bent rays.
std::optional<RayToPlace> ObjectSight::ray_to(const Eigen::Vector3d& away) const {
  if (first_.incidences) return first_.incidences->ray_to(fan().origin, away);
  const double range_m = away.norm(), from_m = -fan().origin.z();
  const double db_per_m = medium_.profile
                              ? medium_.profile->mean_absorption_db_per_m(from_m, from_m - away.z())
                              : medium_.absorption_db_per_m;
  return RayToPlace{.launch = away / range_m,
                    .apparent = away,
                    .range_m = range_m,
                    .absorption_db = db_per_m * range_m};
}

/// The direction of a ray in the fan, if it is within the fan.
std::optional<ObjectSight::FanPlace> ObjectSight::place_in_fan(const RayToPlace& ray) const {
  const RayFan& fan = *view_->fan;
  const double side = ray.launch.dot(fan.array_axis), ahead = ray.launch.dot(fan.middle);
  const double sin_elevation = ray.launch.dot(fan.pole);
  if (!(ahead > 0.0) || std::abs(side) > fan.grid->sin_truncation ||
      sin_elevation < fan.grid->sin_elevation.front() ||
      sin_elevation > fan.grid->sin_elevation.back())
    return std::nullopt;
  const double cos_elevation = std::hypot(side, ahead);
  return FanPlace{side / cos_elevation, sin_elevation, cos_elevation};
}

/// Sets the line of a ray to its place; false if the place is not within the fan and its beam.
/// with_arrays: the energy contains the arrays' beam, not only the vertical pattern.
bool ObjectSight::see(const RayToPlace& ray, Line& line, bool with_arrays) const {
  const std::optional<FanPlace> in_fan = place_in_fan(ray);
  if (!in_fan) return false;
  line.in_fan = *in_fan;
  const double cos_elevation = in_fan->cos_elevation;
  const BeamSample sample{static_cast<float>(in_fan->sin_azimuth), 1.0f};
  const Beam& beam = *view_->beam;
  double weight;
  if (with_arrays) {
    weight = beam.two_way(view_->sector, {&sample, 1}, cos_elevation, ray.launch, ray.range_m,
                          *view_->motion) /
             cos_elevation;
  } else {
    const auto [sent, heard] =
        beam.vertical_powers(view_->sector, ray.launch, ray.range_m, *view_->motion);
    weight = sent * heard;
  }
  // EchoFormer applies the mean absorption over the range.
  const double more_db = ray.absorption_db - medium_.absorption_db_per_m * ray.range_m;
  line.energy = weight / std::pow(ray.apparent.squaredNorm(), 2) * scatter::from_db(-2.0 * more_db);
  return line.energy > 0.0;
}

/// Where a ray and the ray above it hit, or infinity; and the labels there.
std::array<ObjectSight::FirstHit, 2> ObjectSight::first_hits(std::size_t plane,
                                                             std::size_t ray) const {
  const RayFan& fan = *view_->fan;
  std::array<FirstHit, 2> ends;
  if (!first_.runs) {
    for (std::size_t k = 0; k < 2; ++k)
      if (const Hit& hit = first_.hits[plane * fan.elevations() + ray + k])
        ends[k] = {hit.t, labels().label_of(hit.face)};
    return ends;
  }
  const FanRuns& runs = *first_.runs;
  const auto begin = runs.end.begin() + static_cast<std::ptrdiff_t>(runs.first[plane]);
  const std::size_t end = runs.first[plane + 1];
  const auto found = std::upper_bound(begin, runs.end.begin() + static_cast<std::ptrdiff_t>(end),
                                      static_cast<std::uint32_t>(ray));
  auto run = static_cast<std::size_t>(found - runs.end.begin());
  for (std::size_t k = 0; k < 2; ++k, ++ray) {
    if (run < end && runs.end[run] <= ray) ++run;
    if (run == end || runs.begin[run] > ray) continue;
    const double range_m = runs.distance[run] / (runs.level[run] * fan.grid->cos_elevation[ray] +
                                                 runs.pole[run] * fan.grid->sin_elevation[ray]);
    if (range_m > 0.0) ends[k].range_m = range_m;
    ends[k].label = labels().label_of(runs.face[run]);
  }
  return ends;
}

/// The four rays around a direction: two planes, and two rays of each.
ObjectSight::RaysAround ObjectSight::rays_around(const FanPlace& place) const {
  const FanGrid& grid = *fan().grid;
  const auto beside = [](const auto& values, double value, const auto& of) {
    const auto above = std::ranges::lower_bound(values, value, {}, of);
    const auto last = static_cast<std::size_t>(values.size() - 1);
    const std::size_t to =
        std::clamp<std::size_t>(static_cast<std::size_t>(above - values.begin()), 1, last);
    const double low = of(values[to - 1]), high = of(values[to]);
    return std::pair(to - 1, std::clamp((value - low) / (high - low), 0.0, 1.0));
  };
  const auto plane =
      beside(grid.planes, place.sin_azimuth, [](const FanGrid::Plane& p) { return p.sin_azimuth; });
  const auto ray =
      beside(grid.sin_elevation, place.sin_elevation, [](double sine) { return sine; });
  return {plane.first, ray.first, plane.second, ray.second};
}

/// Whether a place of an object lies under the topmost face of the bed.
bool ObjectSight::is_covered(const Eigen::Vector3d& away) const {
  if (!bed_height_m_) return false;
  const Eigen::Vector3d place = fan().origin + away;
  return bed_height_m_(place.x(), place.y()) >= place.z();
}

/// Whether a label belongs to another object.
bool ObjectSight::is_other(int label, const OwnPlace& own) const {
  if (label < 0) return false;
  const Label& met = labels()[static_cast<std::uint16_t>(label)];
  return met.instance != labels()[own.label].instance && met.instance > 0 && !met.feature;
}

/// How far a face that rays meet may lie from its true place, because its vertices are floats.
double ObjectSight::rounding_m(const Eigen::Vector3d& away) const {
  return double(std::numeric_limits<float>::epsilon()) *
         (fan().origin + away).cwiseAbs().maxCoeff();
}

/// Whether what a ray next to a place met is nearer than the place, which is range_m away. The ray
/// has another direction, so the object itself and the bed may be a little nearer there. Another
/// object may not be nearer, because the place may lie just behind its surface.
bool ObjectSight::is_nearer(const FirstHit& hit, double range_m, const OwnPlace& own) const {
  const double own_m = hit.label == int{own.label} ? own.own_m : 0.0;
  const double nearer_m =
      rounding_m(own.away) + (is_other(hit.label, own) ? 0.0 : tolerance_m_ + own_m);
  return hit.range_m < range_m - nearer_m;
}

/// Whether a ray met the object of a place. A place under the bed is hidden from other rays,
/// although some of them meet the bed farther away than the place.
bool ObjectSight::is_own(const FirstHit& hit, const OwnPlace& own) const {
  return hit.label >= 0 &&
         labels()[static_cast<std::uint16_t>(hit.label)].instance == labels()[own.label].instance;
}

/// How far apart the rays around a direction are at a range.
double ObjectSight::apart_m(const FanPlace& place, double time_range_m) const {
  const FanGrid& grid = *fan().grid;
  const RaysAround around = rays_around(place);
  return time_range_m *
         std::hypot(
             grid.planes[around.plane + 1].sin_azimuth - grid.planes[around.plane].sin_azimuth,
             grid.sin_elevation[around.ray + 1] - grid.sin_elevation[around.ray]);
}

/// The share of the sound that reaches a place of an object (own), or of the bed (null). Each of
/// the four rays around the place has a weight. The share is the weight of the rays in whose
/// direction nothing hides the place, divided by the weight of the traced rays. If all four meet
/// one other object, the place is hidden if it lies behind the plane through their hits. With the
/// weights w_i and directions u_i of the rays, this plane is at 1 / r = sum(w_i / r_i) / |sum(w_i
/// u_i)|.
double ObjectSight::seen_share(const FanPlace& place, double time_range_m,
                               const OwnPlace* own) const {
  const FanGrid& grid = *fan().grid;
  const RaysAround around = rays_around(place);
  double traced = 0.0, seen = 0.0, past_object = 0.0, per_m = 0.0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  int others = 0, other = -1;
  for (const std::size_t p : {0, 1}) {
    const std::array<FirstHit, 2> ends = first_hits(around.plane + p, around.ray);
    const Eigen::Vector3d in_plane = fan().plane_direction(around.plane + p);
    for (const std::size_t j : {0, 1}) {
      if (!grid.within_beam(around.plane + p, around.ray + j)) continue;
      const double share = around.share(p, j);
      traced += share;
      if (own && (others == 0 || ends[j].label == other) && is_other(ends[j].label, *own)) {
        ++others;
        other = ends[j].label;
        per_m += share / ends[j].range_m;
        direction += share * fan().direction(in_plane, around.ray + j);
      }
      const bool hidden = own ? is_nearer(ends[j], time_range_m, *own)
                              : ends[j].range_m < time_range_m - tolerance_m_;
      if (!hidden) (own && !is_own(ends[j], *own) ? past_object : seen) += share;
    }
  }
  if (others == 4)
    return direction.norm() / per_m < time_range_m - rounding_m(own->away) ? 0.0 : 1.0;
  if (past_object > 0.0 && !is_covered(own->away)) seen += past_object;
  return traced > 0.0 ? seen / traced : 0.0;
}

/// The range of a place, and how much of the place is seen. The rays to another place (shows_seen)
/// decide how much is seen. If the fan has no rays to shows_seen, the rays nearest to it along the
/// array decide. None if the place is not in the fan and its beam.
std::optional<ObjectSight::Sight> ObjectSight::sight_of(const Eigen::Vector3d& place,
                                                        const OwnPlace& shows_seen,
                                                        bool with_arrays) const {
  const std::optional<RayToPlace> ray = ray_to(place);
  Line line;
  if (!ray || !see(*ray, line, with_arrays)) return std::nullopt;
  const RayFan& fan = *view_->fan;
  // Between the fan's last planes and its truncation some rays are missing.
  const double farthest_m = 0.7 * fan.grid->sin_truncation * place.norm();
  const double from_m = place.dot(fan.array_axis), to_m = shows_seen.away.dot(fan.array_axis);
  const double kept_m =
      std::clamp(to_m, std::min(from_m, -farthest_m), std::max(from_m, farthest_m));
  const Eigen::Vector3d kept = shows_seen.away + (kept_m - to_m) * fan.array_axis;
  const std::optional<RayToPlace> there = ray_to(kept);
  Line line_there;
  const auto seen_at = [&](const Line& its_line, double range_m, const Eigen::Vector3d& away) {
    const OwnPlace own{away, shows_seen.label, shows_seen.own_m};
    return seen_share(its_line.in_fan, range_m, &own);
  };
  const double seen = there && see(*there, line_there) ? seen_at(line_there, there->range_m, kept)
                                                       : seen_at(line, ray->range_m, place);
  return Sight{.range_m = ray->range_m, .seen = seen, .energy = line.energy};
}

/// The share of the sound that reaches a place of a flat part. Only those rays around the place
/// count that pass through the flat part, because what the others meet lies next to it; none if no
/// ray passes. off: the place, from the flat part's middle.
std::optional<double> ObjectSight::seen_through(const FlatPart& flat_part, const OwnPlace& middle,
                                                const Eigen::Vector3d& off) const {
  constexpr double inside = 0.95;  // the rectangle may reach beyond the flat part
  const std::optional<RayToPlace> ray = ray_to(middle.away + off);
  const std::optional<FanPlace> in_fan = ray ? place_in_fan(*ray) : std::nullopt;
  if (!in_fan) return std::nullopt;
  const RayFan& fan = *view_->fan;
  const Eigen::Vector3d normal = flat_part.normal.cast<double>();
  const Eigen::Vector3d arrival = ray->apparent.normalized();
  const double facing = arrival.dot(normal);
  const RaysAround around = rays_around(*in_fan);
  double passing = 0.0, seen = 0.0;
  for (const std::size_t p : {0, 1}) {
    const std::array<FirstHit, 2> ends = first_hits(around.plane + p, around.ray);
    const Eigen::Vector3d in_plane = fan.plane_direction(around.plane + p);
    for (const std::size_t j : {0, 1}) {
      if (!fan.grid->within_beam(around.plane + p, around.ray + j)) continue;
      // From the place to where this ray meets the flat part's plane.
      const Eigen::Vector3d turned =
          ray->range_m * (fan.direction(in_plane, around.ray + j) - ray->launch);
      const Eigen::Vector3d aside = turned - turned.dot(normal) / facing * arrival;
      const Eigen::Vector3d meets = off + aside;
      const double along = 2.0 * meets.dot(flat_part.along.cast<double>()) / flat_part.length_m;
      const double across = 2.0 * meets.dot(flat_part.across.cast<double>()) / flat_part.width_m;
      const bool passes = flat_part.round
                              ? std::hypot(along, across) < inside * 2.0 * std::numbers::inv_sqrtpi
                              : std::abs(along) < inside && std::abs(across) < inside;
      if (!passes) continue;
      const double share = around.share(p, j);
      passing += share;
      const Eigen::Vector3d there = middle.away + meets;
      const double farther_m = (ray->apparent + aside).norm() - ray->apparent.norm();
      const OwnPlace own{there, middle.label};
      if (!is_nearer(ends[j], ray->range_m + farther_m, own) &&
          (is_own(ends[j], own) || !is_covered(there)))
        seen += share;
    }
  }
  if (!(passing > 0.0)) return std::nullopt;
  return seen / passing;
}

/// How much is seen of the cells of a flat part; none if no ray shows any cell.
std::optional<SeenCells> ObjectSight::look_at_cells(const FlatPart& flat_part,
                                                    const OwnPlace& middle,
                                                    const FlatPartInBeam& in_beam,
                                                    std::size_t count) const {
  const std::optional<SeenCells> cells = in_beam.cells(count);
  if (!cells) return std::nullopt;
  return shown(*cells, [&](std::size_t column, std::size_t row) {
    return seen_through(flat_part, middle, in_beam.middle_of(*cells, column, row));
  });
}

/// How much is seen of the cells of a line, by rays that pass through the plane that touches the
/// surface there; none if no ray shows any cell. middle: the line's middle, from the sonar.
std::optional<SeenCells> ObjectSight::look_at_line(const MirrorLine& line, const OwnPlace& middle,
                                                   const BeamOnLine& in_beam,
                                                   std::size_t count) const {
  const std::optional<LineCells> cells = in_beam.cells(count);
  if (!cells) return std::nullopt;
  const Eigen::Vector3d across = line.away.cross(line.along).normalized();
  FlatPart touching{};
  touching.normal = line.along.cross(across).cast<float>();
  touching.along = line.along.cast<float>();
  touching.across = across.cast<float>();
  touching.length_m = static_cast<float>(line.length_m);
  touching.width_m = static_cast<float>(std::numbers::sqrt2 * line.radius_m);
  return shown({.level = *cells, .up = {.count = 1}}, [&](std::size_t column, std::size_t) {
    return seen_through(touching, middle, cells->middle_m[column] * line.along);
  });
}

GlintBeam ObjectSight::glint_beam() const {
  const Beam& beam = *view_->beam;
  return {.beam = beam,
          .motion = *view_->motion,
          .array_axis = fan().array_axis,
          .array_m = wavelength_m_ *
                     double(std::max(beam.transmit().x_per_sine, beam.receive().x_per_sine)),
          .sin_truncation = fan().grid->sin_truncation};
}

/// Whether a ball may reach into the fan's beam and range.
bool ObjectSight::may_see(const Eigen::Vector3d& middle, double radius_m) const {
  const RayFan& fan = *view_->fan;
  const double reach_m = fan.range_m * fan.bend.lengthening + radius_m;
  return (middle - fan.origin).squaredNorm() <= reach_m * reach_m &&
         may_be_in_beam(middle, radius_m);
}

/// Whether a ball may reach into the fan's beam at any range. (An echo from a little beyond the
/// fan's range still counts in the last bin.)
bool ObjectSight::may_be_in_beam(const Eigen::Vector3d& middle, double radius_m) const {
  const RayFan& fan = *view_->fan;
  const Eigen::Vector3d away = middle - fan.origin;
  const double distance_m2 = away.squaredNorm();
  double strays_m = radius_m;
  if (fan.bend.turn_rad > 0.0) strays_m += fan.bend.turn_rad * std::sqrt(distance_m2);
  const double off_m = std::max(std::abs(away.dot(fan.array_axis)) - strays_m, 0.0);
  const double sine = fan.grid->sin_truncation;
  return away.dot(fan.middle) >= -strays_m && off_m * off_m <= sine * sine * distance_m2;
}

}  // namespace ensonify::engine
