#include <ensonify/engine/sonar/echo/object_echoes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <ensonify/engine/sonar/echo/glint.h>
#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double inv_sqrt2 = 1.0 / std::numbers::sqrt2;

constexpr double few_planes = 6.0;     // or elevations: that a small object is long, at most
constexpr double max_cells = 256.0;    // of a flat part, in each direction
constexpr double steepest_wall = 0.5;  // sine of a wall's inclination to the vertical, at most
constexpr double same_place_m = 1e-3;  // of two estimates of a place
constexpr int max_turns = 8;          // of such estimates
constexpr double inaudible = 14.0;     // nepers of energy that sound loses in the bed: 61 dB

}  // namespace

ObjectEchoes::ObjectEchoes(const Sonar& sonar, const Medium& medium,
                           std::span<const scatter::BackscatterTable> material_tables,
                           const ObjectSurfaces& surfaces)
    : wavelength_m_(medium.sound_speed_mps / sonar.frequency_hz),
      join_m_(0.5 * std::max(sonar.bin_m(), sonar.pulse.cell_m(medium.sound_speed_mps))),
      tolerance_m_(0.5 * sonar.bin_m()),
      medium_(medium),
      by_material_(material_tables),
      surfaces_(surfaces) {}

void ObjectEchoes::find(const SideView& view, const FaceLabels& labels, const FirstHits& first) {
  view_ = &view;
  labels_ = &labels;
  first_ = first;
  glints_.clear();
  facets_.clear();
  walls_.clear();
  for (const std::uint16_t label : small_labels_) small_[label] = 0;
  small_labels_.clear();
  for (const std::vector<ObjectSurface>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects)
      for (const ObjectSurface& object : *objects) {
        look_at(object);
        find_walls(object);
      }
  if (surfaces_.buried)
    for (const BuriedGroup& group : *surfaces_.buried) look_into_bed(group);
  join_glints();
}

/// The ray to a place; none in a shadow zone of bent rays.
std::optional<RayToPlace> ObjectEchoes::ray_to(const Vector3d& away) const {
  if (first_.rays) return first_.rays->ray_to(view_->fan->origin, away);
  const double range_m = away.norm(), from_m = -view_->fan->origin.z();
  const double db_per_m = medium_.profile
                              ? medium_.profile->mean_absorption_db_per_m(from_m, from_m - away.z())
                              : medium_.absorption_db_per_m;
  return RayToPlace{.launch = away / range_m,
                    .apparent = away,
                    .range_m = range_m,
                    .absorption_db = db_per_m * range_m};
}

/// The line of a ray to its place, if that is within the fan and its beam.
bool ObjectEchoes::see(const RayToPlace& ray, Line& line) const {
  const RayFan& fan = *view_->fan;
  const double side = ray.launch.dot(fan.array_axis), ahead = ray.launch.dot(fan.middle);
  line.sin_elevation = ray.launch.dot(fan.pole);
  const double cos_elevation = std::hypot(side, ahead);
  if (!(ahead > 0.0) || std::abs(side) > fan.grid->sin_truncation ||
      line.sin_elevation < fan.grid->sin_elevation.front() ||
      line.sin_elevation > fan.grid->sin_elevation.back())
    return false;
  line.sin_azimuth = side / cos_elevation;
  const BeamSample sample{static_cast<float>(line.sin_azimuth), 1.0f};
  const double weight = view_->beam->two_way(view_->side, {&sample, 1}, cos_elevation, ray.launch,
                                             ray.range_m, *view_->motion) /
                        cos_elevation;
  // EchoFormer absorbs over the range, the same at all depths.
  const double more_db = ray.absorption_db - medium_.absorption_db_per_m * ray.range_m;
  line.energy = weight / std::pow(ray.apparent.squaredNorm(), 2) * scatter::from_db(-2.0 * more_db);
  return line.energy > 0.0;
}

/// Where a ray and the one above it end, or infinity; and the labels there.
std::array<ObjectEchoes::FirstHit, 2> ObjectEchoes::first_hits(std::size_t plane,
                                                               std::size_t ray) const {
  const RayFan& fan = *view_->fan;
  std::array<FirstHit, 2> ends;
  if (!first_.runs) {
    for (std::size_t k = 0; k < 2; ++k)
      if (const Hit& hit = first_.hits[plane * fan.elevations() + ray + k])
        ends[k] = {hit.t, labels_->label_of(hit.face)};
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
    ends[k].label = labels_->label_of(runs.face[run]);
  }
  return ends;
}

/// The share of the sound that reaches a place: of the four rays around it, those that go at least
/// as far. A hit with own_label (-1: none) that is nearer by less than own_m does not hide the
/// place if the tangent plane there can be as near (own_slope: its range over the distance across),
/// because no convex body lies before its tangent plane.
double ObjectEchoes::seen_share(const Line& line, double time_range_m, int own_label, double own_m,
                                double own_slope) const {
  const FanGrid& grid = *view_->fan->grid;
  const auto beside = [](const auto& values, double value, const auto& of) {
    const auto above = std::ranges::lower_bound(values, value, {}, of);
    const auto last = static_cast<std::size_t>(values.size() - 1);
    const std::size_t to =
        std::clamp<std::size_t>(static_cast<std::size_t>(above - values.begin()), 1, last);
    const double low = of(values[to - 1]), high = of(values[to]);
    return std::pair(to, std::clamp((value - low) / (high - low), 0.0, 1.0));
  };
  const auto plane =
      beside(grid.planes, line.sin_azimuth, [](const FanGrid::Plane& p) { return p.sin_azimuth; });
  const auto ray = beside(grid.sin_elevation, line.sin_elevation, [](double sine) { return sine; });
  const double apart_m =
      time_range_m *
      std::hypot(grid.planes[plane.first].sin_azimuth - grid.planes[plane.first - 1].sin_azimuth,
                 grid.sin_elevation[ray.first] - grid.sin_elevation[ray.first - 1]);
  own_m = std::min(own_m, own_slope * apart_m);
  double seen = 0.0;
  for (const std::size_t p : {0, 1}) {
    const std::array<FirstHit, 2> ends = first_hits(plane.first - 1 + p, ray.first - 1);
    for (const std::size_t j : {0, 1}) {
      const double share =
          (p ? plane.second : 1.0 - plane.second) * (j ? ray.second : 1.0 - ray.second);
      const double own = ends[j].label == own_label ? own_m : 0.0;
      if (!(ends[j].range_m < time_range_m - tolerance_m_ - own)) seen += share;
    }
  }
  return seen;
}

/// Whether a ball may reach into the fan's beam and range.
bool ObjectEchoes::may_see(const Vector3d& middle, double radius_m) const {
  const RayFan& fan = *view_->fan;
  return (middle - fan.origin).norm() <= fan.range_m * fan.bend.lengthening + radius_m &&
         may_be_in_beam(middle, radius_m);
}

/// The same at any range: an echo from a little beyond the fan's range still counts in the last
/// bin.
bool ObjectEchoes::may_be_in_beam(const Vector3d& middle, double radius_m) const {
  const RayFan& fan = *view_->fan;
  const Vector3d away = middle - fan.origin;
  const double distance_m = away.norm(), strays_m = radius_m + fan.bend.turn_rad * distance_m;
  return away.dot(fan.middle) >= -strays_m &&
         std::abs(away.dot(fan.array_axis)) <= strays_m + fan.grid->sin_truncation * distance_m;
}

/// Whether an object lies within half a length of its middle along an axis.
bool ObjectEchoes::is_short(const ObjectSurface& object, const Vector3d& axis, double length_m) {
  if (2.0 * object.radius_m < length_m) return true;
  return std::ranges::all_of(object.flat_parts, [&](const FlatPart& flat_part) {
    return std::abs((flat_part.middle - object.middle).dot(axis)) +
               0.5 * (double(flat_part.length_m) *
                          std::abs(flat_part.along.cast<double>().dot(axis)) +
                      double(flat_part.width_m) *
                          std::abs(flat_part.across.cast<double>().dot(axis))) <
           0.5 * length_m;
  });
}

/// The widest step between the fan's elevations where the object is.
double ObjectEchoes::widest_step_rad(const ObjectSurface& object) const {
  const RayFan& fan = *view_->fan;
  const Vector3d away = object.middle - fan.origin;
  const double distance_m = away.norm();
  if (!(distance_m > object.radius_m)) return 0.0;
  const double middle_rad = std::asin(std::clamp(away.dot(fan.pole) / distance_m, -1.0, 1.0));
  const double half_rad = std::asin(object.radius_m / distance_m);
  const std::vector<double>& elevations = fan.grid->elevation_rad;
  const auto first = std::ranges::upper_bound(elevations, middle_rad - half_rad);
  const auto last = std::ranges::lower_bound(elevations, middle_rad + half_rad);
  double widest_rad = 0.0;
  for (auto above = std::max(first, elevations.begin() + 1); above < elevations.end(); ++above) {
    widest_rad = std::max(widest_rad, *above - *(above - 1));
    if (above >= last) break;
  }
  return widest_rad;
}

void ObjectEchoes::look_at(const ObjectSurface& object) {
  if (!may_see(object.middle, object.radius_m)) return;
  const RayFan& fan = *view_->fan;
  const double distance_m = (object.middle - fan.origin).norm();
  const std::vector<FanGrid::Plane>& planes = fan.grid->planes;
  const double apart_m = planes[planes.size() / 2].width_rad * distance_m;  // where it is least
  const double small_m = few_planes * apart_m;
  bool small = is_short(object, fan.array_axis, small_m);
  if (!small) {
    // Near the horizontal the elevations may be farther apart than the planes.
    const double step_m = widest_step_rad(object) * distance_m;
    const Vector3d upwards = fan.array_axis.cross(object.middle - fan.origin).normalized();
    small = step_m > apart_m && is_short(object, upwards, few_planes * step_m);
  }
  const Label& label = (*labels_)[object.label];
  const double specular = label.sediment < surfaces_.smooth_specular.size()
                              ? surfaces_.smooth_specular[label.sediment]
                              : 0.0;
  if (small) {
    if (small_.size() <= object.label) small_.resize(object.label + std::size_t{1}, 0);
    small_[object.label] = 1;
    small_labels_.push_back(object.label);
  }
  if (!small && !(specular > 0.0)) return;
  const std::span<const FlatPart> flat_parts = object.flat_parts;
  for (const FlatPartBlock& block : object.blocks) {
    if (!may_be_in_beam(block.middle, block.radius_m)) continue;
    const bool may_glint =
        specular > 0.0 &&
        block.may_face(fan.origin, glint_reach(block, wavelength_m_) + fan.bend.turn_rad,
                       label.two_sided);
    if (!small && !may_glint) continue;
    for (const FlatPart& flat_part : flat_parts.subspan(block.first, block.count)) {
      const Vector3d to = flat_part.middle - fan.origin;
      if (small) add_facets(flat_part, to, object, small_m);
      if (!may_glint) continue;
      const std::optional<RayToPlace> ray = ray_to(to);
      if (!ray) continue;
      if (!(ray->apparent.dot(flat_part.normal.cast<double>()) < 0.0) && !label.two_sided) continue;
      add_glint(flat_part, to, ray->apparent, specular, object);
    }
  }
  if (specular > 0.0)
    for (const RightCorner& corner : object.corners)
      if (corner.open || label.two_sided) add_corner(corner, specular, object);
}

/// Cuts the flat part into cells that are as small as a small object.
void ObjectEchoes::add_facets(const FlatPart& flat_part, const Vector3d& away,
                              const ObjectSurface& object, double small_m) {
  const Label& label = (*labels_)[object.label];
  const scatter::BackscatterTable& table = by_material_[label.sediment];
  const Vector3d normal = flat_part.normal.cast<double>();
  const Vector3d along = flat_part.along.cast<double>(), across = flat_part.across.cast<double>();
  const double length_m = double(flat_part.length_m), width_m = double(flat_part.width_m);
  const auto cells = [&](double m) {
    return static_cast<int>(std::clamp(std::ceil(m / small_m), 1.0, max_cells));
  };
  const int lengthwise = cells(length_m), crosswise = cells(width_m);
  const double cell_length_m = length_m / lengthwise, cell_width_m = width_m / crosswise;
  for (int i = 0; i < lengthwise * crosswise; ++i) {
    const int column = i % lengthwise, row = i / lengthwise;
    const Vector3d place = away + (column + 0.5 - 0.5 * lengthwise) * cell_length_m * along +
                           (row + 0.5 - 0.5 * crosswise) * cell_width_m * across;
    const std::optional<RayToPlace> ray = ray_to(place);
    Line line;
    if (!ray || (!(ray->apparent.dot(normal) < 0.0) && !label.two_sided) || !see(*ray, line))
      continue;
    const Vector3d arrival = ray->apparent.normalized();
    const double sine = std::min(std::abs(arrival.dot(normal)), 1.0);
    const double slope = std::sqrt(1.0 - sine * sine) / sine;
    const double seen = seen_share(line, ray->range_m, object.label, small_m, slope);
    if (!(seen > 0.0)) continue;
    const double area_m2 = cell_length_m * cell_width_m;
    const double cross_section_m2 = table.sigma_over_sine(sine) * sine * area_m2;
    facets_.push_back({.range_m = ray->range_m,
                       .spread_m = 0.5 * cell_length_m * std::abs(arrival.dot(along)) +
                                   0.5 * cell_width_m * std::abs(arrival.dot(across)),
                       .energy = seen * line.energy * cross_section_m2,
                       .place = place,
                       .grazing_rad = std::asin(sine),
                       .label = object.label,
                       .surface = flat_part.surface});
  }
}

void ObjectEchoes::add_glint(const FlatPart& flat_part, const Vector3d& away,
                             const Vector3d& apparent, double specular,
                             const ObjectSurface& object) {
  const std::optional<Mirror> mirror = mirror_of(flat_part, apparent, wavelength_m_);
  if (!mirror) return;
  const Vector3d place = away + mirror->offset;
  const std::optional<RayToPlace> ray = ray_to(place);
  Line line;
  if (!ray || !see(*ray, line)) return;
  const double seen = seen_share(line, ray->range_m);
  if (!(seen > 0.0)) return;
  glints_.push_back(
      {.range_m = ray->range_m,
       .spread_m = 0.0,
       .energy = seen * line.energy * specular * mirror->cross_section_m2(wavelength_m_),
       .place = place,
       .grazing_rad = 0.5 * pi,
       .label = object.label,
       .surface = flat_part.surface});
}

void ObjectEchoes::add_corner(const RightCorner& corner, double specular,
                              const ObjectSurface& object) {
  const Vector3d edge = corner.edge.cast<double>();
  const Vector3d to = corner.middle - view_->fan->origin;
  const std::optional<RayToPlace> ray_to_middle = ray_to(to);
  if (!ray_to_middle) return;
  // The point of the edge that is nearest to the sonar.
  const Vector3d& apparent = ray_to_middle->apparent;
  const double along_m = -apparent.dot(edge), half_m = 0.5 * double(corner.length_m);
  const Vector3d offset = std::clamp(along_m, -half_m, half_m) * edge;
  const Vector3d from = apparent + offset;
  const double range_m = from.norm();
  const Vector3d back = -from / range_m;
  const double sine_one = back.dot(corner.other.cast<double>());
  const double sine_other = back.dot(corner.one.cast<double>());
  if (!(sine_one > 0.0 && sine_other > 0.0)) return;
  const MirrorExtent lengthwise(double(corner.length_m), 0.0, along_m / range_m, range_m,
                                wavelength_m_);
  if (!lengthwise.reaches()) return;
  const double width_m =
      2.0 * std::min(double(corner.one_m) * sine_one, double(corner.other_m) * sine_other);
  const Vector3d place = to + offset;
  const std::optional<RayToPlace> ray = ray_to(place);
  Line line;
  if (!ray || !see(*ray, line)) return;
  // The corner's own flat parts are nearer than its edge.
  const double own_m = double(std::max(corner.one_m, corner.other_m));
  const double seen = seen_share(line, ray->range_m - own_m);
  if (!(seen > 0.0)) return;
  const double cross_section_m2 =
      corner_power_m2(width_m, double(corner.excess_rad), range_m, wavelength_m_) *
      lengthwise.power_m2(wavelength_m_) / (wavelength_m_ * wavelength_m_);
  glints_.push_back({.range_m = ray->range_m,
                     .spread_m = 0.0,
                     .energy = seen * line.energy * specular * specular * cross_section_m2,
                     .place = place,
                     .grazing_rad = 0.5 * pi,
                     .label = object.label,
                     .surface = corner.surface});
}

void ObjectEchoes::find_walls(const ObjectSurface& object) {
  const Label& label = (*labels_)[object.label];
  if (label.sediment >= surfaces_.mirrors.size()) return;
  const WallMirror& mirror = surfaces_.mirrors[label.sediment];
  if (!(mirror.smooth + mirror.rough > 0.0) || !may_see(object.middle, object.radius_m)) return;
  const std::span<const FlatPart> flat_parts = object.flat_parts;
  for (const FlatPartBlock& block : object.blocks)
    if (may_be_in_beam(block.middle, block.radius_m))
      for (const FlatPart& flat_part : flat_parts.subspan(block.first, block.count))
        if (std::abs(double(flat_part.normal.z())) < steepest_wall)
          add_wall(flat_part, mirror, label.two_sided);
}

void ObjectEchoes::add_wall(const FlatPart& flat_part, const WallMirror& mirror, bool two_sided) {
  const Vector3d to = flat_part.middle - view_->fan->origin;
  Vector3d normal = flat_part.normal.cast<double>();
  if (to.dot(normal) >= 0.0) {
    if (!two_sided) return;
    normal = -normal;
  }
  // The extents of its rectangle in the level direction and across it, by second moments.
  const Vector3d level = normal.cross(Vector3d::UnitZ()).normalized(), up = level.cross(normal);
  const auto extent = [&](const Vector3d& direction) {
    return std::hypot(double(flat_part.length_m) * flat_part.along.cast<double>().dot(direction),
                      double(flat_part.width_m) * flat_part.across.cast<double>().dot(direction));
  };
  const double length_m = extent(level), height_m = extent(up);
  // How much is seen where it is nearest to the middle of the beam, but not at its very ends,
  // beside which other rays pass.
  const Vector3d& axis = view_->fan->array_axis;
  const double along = level.dot(axis);
  const double off_m = std::abs(along) > 1e-6 ? -to.dot(axis) / along : 0.0;
  const Vector3d place = to + std::clamp(off_m, -0.4 * length_m, 0.4 * length_m) * level;
  const std::optional<RayToPlace> ray = ray_to(place);
  Line line;
  if (!ray || !see(*ray, line)) return;
  const double seen = seen_share(line, ray->range_m);
  if (!(seen > 0.0)) return;
  // A facet of a curved surface stands for normals on either side of its own, as in its glint.
  const auto curved = [&](const Eigen::Vector3f& direction, float bend_rad) {
    return inv_sqrt2 * double(bend_rad) * direction.cast<double>().dot(level);
  };
  const double bend = std::hypot(curved(flat_part.along, flat_part.bend_along_rad),
                                 curved(flat_part.across, flat_part.bend_across_rad));
  const auto add = [&](double share, double slope) {
    if (share > 0.0)
      walls_.push_back({.middle = to,
                        .normal = normal,
                        .length_m = length_m,
                        .height_m = height_m,
                        .reflected = seen * share,
                        .slope = std::hypot(slope, bend)});
  };
  add(mirror.smooth, 0.0);
  add(mirror.rough, mirror.slope);
}

void ObjectEchoes::look_into_bed(const BuriedGroup& group) {
  if (!may_see(group.middle, group.radius_m)) return;
  const Label& label = (*labels_)[group.label];
  const double specular = label.sediment < surfaces_.smooth_specular.size()
                              ? surfaces_.smooth_specular[label.sediment]
                              : 0.0;
  for (std::size_t i = 0, end; i < group.parts.size(); i = end) {
    const FlatPart& flat_part = *group.parts[i].whole;
    const Vector3d along = flat_part.along.cast<double>(), across = flat_part.across.cast<double>();
    const BuriedPart* nearest = &group.parts[i];  // to the foot of the line of sight on it
    double min_m2 = std::numeric_limits<double>::infinity();
    for (end = i; end < group.parts.size() && group.parts[end].whole == &flat_part; ++end) {
      const BuriedPart& part = group.parts[end];
      if (may_see(part.flat.middle, 0.5 * (double(part.flat.length_m) + double(part.flat.width_m))))
        add_buried_facets(part, group, label);
      const Vector3d off = part.flat.middle - view_->fan->origin;
      const double m2 = std::pow(off.dot(along), 2) + std::pow(off.dot(across), 2);
      if (m2 < min_m2) nearest = &part, min_m2 = m2;
    }
    if (specular > 0.0) add_buried_glint(*nearest, group, specular);
  }
}

/// The way to a place that lies depth_m under the bed's plane above a part; none where no sound
/// enters, where next to nothing returns, or the place is not under the bed. Where a bent ray
/// enters the bed, it is as the straight one of a sonar that lies where this one appears to be;
/// where it enters follows from that place, so both are found in turn.
std::optional<ObjectEchoes::BuriedWay> ObjectEchoes::way_into_bed(const Vector3d& away,
                                                                  double depth_m,
                                                                  const BuriedPart& part) const {
  const std::uint16_t material = (*labels_)[labels_->label_of(part.bed_face)].sediment;
  if (material >= surfaces_.sediments.size() || !surfaces_.sediments[material]) return std::nullopt;
  const scatter::Sediment& sediment = *surfaces_.sediments[material];
  const double longest_m = inaudible / scatter::two_way_attenuation_per_m(sediment, wavelength_m_);
  if (!(depth_m > 0.0) || depth_m > longest_m) return std::nullopt;
  Vector3d apparent = away;  // the place, from where the sonar appears to be
  for (int turn = 1;; ++turn) {
    const double deep_m = -apparent.dot(part.bed_normal), height_m = deep_m - depth_m;
    if (!(height_m > 0.0)) return std::nullopt;
    const Vector3d level = apparent + deep_m * part.bed_normal;
    const double along_m = level.norm();
    const scatter::BuriedPath path =
        scatter::buried_path(height_m, depth_m, along_m, sediment.sound_speed_ratio);
    const Vector3d ahead = along_m > 0.0 ? Vector3d(level / along_m) : Vector3d::Zero();
    const Vector3d apparent_entry =
        path.water_m * path.cos_water * ahead - height_m * part.bed_normal;
    const std::optional<RayToPlace> ray =
        ray_to(first_.rays ? Vector3d(apparent_entry + (away - apparent)) : apparent_entry);
    if (!ray) return std::nullopt;
    const Vector3d correction = ray->apparent - apparent_entry;
    if (first_.rays && turn < max_turns && correction.norm() > same_place_m) {
      apparent += correction;
      continue;
    }
    if (path.sediment_m > longest_m) return std::nullopt;
    return BuriedWay{.path = path,
                     .sediment = &sediment,
                     .ray = *ray,
                     .arrival = path.cos_sediment * ahead - path.sin_sediment * part.bed_normal};
  }
}

/// Whether less than half a bin of sediment is in the way: add_facets() and add_glint() see through
/// that.
bool ObjectEchoes::is_thinly_covered(const BuriedWay& way) const {
  return way.path.sediment_m < tolerance_m_;
}

/// The echo of 1 m^2 of cross-section by that way; energy 0 if there is none.
ObjectEchoes::BuriedSight ObjectEchoes::see_buried(const BuriedWay& way) const {
  Line line;
  if (!see(way.ray, line)) return {};
  const double time_range_m =
      way.ray.range_m + way.path.sediment_m / way.sediment->sound_speed_ratio;
  if (time_range_m > view_->fan->range_m) return {};
  // The bed's relief hides nothing that lies deeper than it is high.
  const double seen = seen_share(line, way.ray.range_m - way.path.sediment_m);
  // The sediment spreads the sound on from there: by this, as an energy.
  const double more = std::pow(way.ray.apparent.squaredNorm() / way.path.spreading_m2, 2);
  return {.time_range_m = time_range_m,
          .energy = seen * line.energy * more *
                    scatter::buried_gain(way.path, *way.sediment, wavelength_m_)};
}

/// Cuts the part into cells that are narrow in the beam.
void ObjectEchoes::add_buried_facets(const BuriedPart& part, const BuriedGroup& group,
                                     const Label& label) {
  constexpr double planes_per_cell = 4.0;
  const RayFan& fan = *view_->fan;
  const FlatPart& flat = part.flat;
  const Vector3d to = flat.middle - fan.origin;
  const Vector3d along = flat.along.cast<double>(), across = flat.across.cast<double>();
  const Vector3d normal = flat.normal.cast<double>();
  const std::vector<FanGrid::Plane>& planes = fan.grid->planes;
  const double cell_m = planes_per_cell * planes[planes.size() / 2].width_rad * to.norm();
  const auto cells = [&](const Vector3d& axis, double length_m) {
    return static_cast<int>(std::ceil(
        std::clamp(std::abs(axis.dot(fan.array_axis)) * length_m / cell_m, 1.0, max_cells)));
  };
  const double length_m = double(flat.length_m), width_m = double(flat.width_m);
  const int lengthwise = cells(along, length_m), crosswise = cells(across, width_m);
  const double cell_length_m = length_m / lengthwise, cell_width_m = width_m / crosswise;
  const scatter::BackscatterTable& table = by_material_[label.sediment];
  for (int i = 0; i < lengthwise * crosswise; ++i) {
    const int column = i % lengthwise, row = i / lengthwise;
    const Vector3d offset = (column + 0.5 - 0.5 * lengthwise) * cell_length_m * along +
                            (row + 0.5 - 0.5 * crosswise) * cell_width_m * across;
    const Vector3d away = to + offset;
    if (std::abs(away.dot(fan.array_axis)) > fan.grid->sin_truncation * away.norm()) continue;
    const auto way = way_into_bed(away, part.depth_m - offset.dot(part.bed_normal), part);
    if (!way) continue;
    const double facing = -way->arrival.dot(normal);
    if (facing <= 0.0 && !label.two_sided) continue;
    if (small(group.label) && is_thinly_covered(*way)) continue;
    const BuriedSight sight = see_buried(*way);
    if (!(sight.energy > 0.0)) continue;
    const double sine = std::min(std::abs(facing), 1.0);
    const double cross_section_m2 =
        table.sigma_over_sine(sine) * sine * cell_length_m * cell_width_m;
    const double spread_m = 0.5 * (cell_length_m * std::abs(way->arrival.dot(along)) +
                                   cell_width_m * std::abs(way->arrival.dot(across)));
    facets_.push_back({.range_m = sight.time_range_m,
                       .spread_m = spread_m / way->sediment->sound_speed_ratio,
                       .energy = sight.energy * cross_section_m2,
                       .place = away,
                       .grazing_rad = std::asin(sine),
                       .label = group.label,
                       .surface = flat.surface});
  }
}

/// The glint of the whole flat part, with the bed above one of its parts. For the flat part the
/// sound comes from a place that is sqrt(J) away, against the direction in which it arrives.
void ObjectEchoes::add_buried_glint(const BuriedPart& part, const BuriedGroup& group,
                                    double specular) {
  const FlatPart& flat_part = *part.whole;
  const Vector3d to = part.flat.middle - view_->fan->origin;
  const auto to_part = way_into_bed(to, part.depth_m, part);
  if (!to_part || !(to_part->arrival.dot(flat_part.normal.cast<double>()) < 0.0)) return;
  const Vector3d off = flat_part.middle - part.flat.middle;
  const double wavelength_m = wavelength_m_ * to_part->sediment->sound_speed_ratio;
  const auto mirror = mirror_of(
      flat_part, off + std::sqrt(to_part->path.spreading_m2) * to_part->arrival, wavelength_m);
  if (!mirror) return;
  const Vector3d from_part = off + mirror->offset;
  const auto way =
      way_into_bed(to + from_part, part.depth_m - from_part.dot(part.bed_normal), part);
  if (!way || is_thinly_covered(*way)) return;
  const BuriedSight sight = see_buried(*way);
  if (!(sight.energy > 0.0)) return;
  glints_.push_back({.range_m = sight.time_range_m,
                     .spread_m = 0.0,
                     .energy = sight.energy * specular * mirror->cross_section_m2(wavelength_m),
                     .place = to + from_part,
                     .grazing_rad = 0.5 * pi,
                     .label = group.label,
                     .surface = flat_part.surface});
}

/// Facets of one surface at about one range are one glint, at their mean range.
void ObjectEchoes::join_glints() {
  std::erase_if(glints_, [](const ObjectEcho& glint) { return !(glint.energy > 0.0); });
  std::ranges::sort(glints_, {}, [](const ObjectEcho& glint) {
    return std::tuple(glint.label, glint.surface, glint.range_m);
  });
  std::size_t count = 0;
  for (std::size_t i = 0, end; i < glints_.size(); i = end) {
    ObjectEcho sum = glints_[i];
    sum.range_m *= sum.energy;
    sum.place *= sum.energy;
    for (end = i + 1; end < glints_.size(); ++end) {
      const ObjectEcho &before = glints_[end - 1], &glint = glints_[end];
      if (glint.label != sum.label || glint.surface != sum.surface ||
          glint.range_m - before.range_m > join_m_)
        break;
      sum.energy += glint.energy;
      sum.range_m += glint.energy * glint.range_m;
      sum.place += glint.energy * glint.place;
    }
    sum.range_m /= sum.energy;
    sum.place /= sum.energy;
    glints_[count++] = sum;
  }
  glints_.erase(glints_.begin() + static_cast<std::ptrdiff_t>(count), glints_.end());
}

}  // namespace ensonify::engine
