#include <ensonify/engine/sonar/echo/object_echoes.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <tuple>

#include <ensonify/engine/sonar/echo/buried_echoes.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr double inv_sqrt2 = 1.0 / std::numbers::sqrt2;

constexpr double few_planes = 6.0;     // longest small object, in spacings of planes or elevations
constexpr std::size_t few_cells = 3;   // columns and rows that show whether a flat part is hidden
constexpr double steepest_wall = 0.5;  // sine of a wall's inclination to the vertical, at most

/// What look(count) sees of a part by few cells; if these show that it is partly hidden, what it
/// sees by more cells, if any ray shows these.
template <class Look>
auto look_closer(const Look& look) {
  auto seen = look(few_cells);
  if (seen && seen->least < seen->most)
    if (auto closer = look(LineCells::most)) seen = closer;
  return seen;
}

}  // namespace

ObjectEchoes::ObjectEchoes(const Sonar& sonar, const Medium& medium,
                           std::span<const MaterialInSonar> materials,
                           const ObjectSurfaces& surfaces)
    : wavelength_m_(medium.sound_speed_mps / sonar.frequency_hz),
      join_m_(0.5 * std::max(sonar.bin_m(), sonar.pulse.cell_m(medium.sound_speed_mps))),
      join_pieces_m_(0.125 * sonar.pulse.cell_m(medium.sound_speed_mps)),
      materials_(materials),
      surfaces_(surfaces),
      sight_(medium, wavelength_m_, sonar.bin_m(), surfaces.bed_height_m) {}

void ObjectEchoes::find(const SectorView& view, const FanHits& first) {
  sight_.look(view, first);
  glints_.clear();
  facets_.clear();
  walls_.clear();
  for (const std::uint16_t label : small_labels_) small_[label] = 0;
  small_labels_.clear();
  for (const std::vector<ObjectSurface>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects)
      for (const ObjectSurface& object : *objects) {
        if (object.flat_parts.empty()) continue;  // removed: it has no label
        look_at(object);
        find_walls(object);
      }
  if (surfaces_.buried) {
    const BuriedEchoes buried(sight_, materials_, wavelength_m_);
    for (const BuriedGroup& group : *surfaces_.buried) buried.find(group, facets_, glints_);
  }
  join_glints();
}

double ObjectEchoes::arrival_sine(const ObjectEcho& echo) const {
  const Vector3d& axis = sight_.fan().array_axis;
  if (sight_.bent())
    if (const std::optional<RayToPlace> ray = sight_.ray_to(echo.place))
      return ray->launch.dot(axis);
  return echo.place.dot(axis) / echo.place.norm();
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
  const RayFan& fan = sight_.fan();
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
  if (!sight_.may_see(object.middle, object.radius_m)) return;
  const RayFan& fan = sight_.fan();
  const double distance_m = (object.middle - fan.origin).norm();
  const std::vector<FanGrid::Plane>& planes = fan.grid->planes;
  // The distance of planes where it is least, at the middle plane.
  const double apart_m = planes[planes.size() / 2].width_rad * distance_m;
  const double small_m = few_planes * apart_m;
  const Label& label = sight_.labels()[object.label];
  const std::optional<SmallBody> whole = small_body_of(object, label.two_sided, wavelength_m_);
  bool small = whole || is_short(object, fan.array_axis, small_m);
  if (!small) {
    // Near the horizontal the elevations may be farther apart than the planes.
    const double step_m = widest_step_rad(object) * distance_m;
    const Vector3d upwards = fan.array_axis.cross(object.middle - fan.origin).normalized();
    small = step_m > apart_m && is_short(object, upwards, few_planes * step_m);
  }
  const double specular = materials_[label.sediment].smooth_specular;
  const GlintBeam beam = sight_.glint_beam();
  const auto reach_of = [&](const FlatPartBlock& block) {
    const double nearest_m = (block.middle - fan.origin).norm() - block.radius_m;
    return nearest_m > 0.0 ? glint_reach(block, wavelength_m_, nearest_m, &beam) : 1.0;
  };
  if (small) {
    if (small_.size() <= object.label) small_.resize(object.label + std::size_t{1}, 0);
    small_[object.label] = 1;
    small_labels_.push_back(object.label);
  }
  if (!small && !(specular > 0.0)) return;
  const double facet_gain = whole ? whole->gain(wavelength_m_) : 1.0;
  if (whole && specular > 0.0) add_small_body(*whole, specular, object);
  const std::span<const FlatPart> flat_parts = object.flat_parts;
  for (const FlatPartBlock& block : object.blocks) {
    const bool may_glint =
        specular > 0.0 && !whole && sight_.may_be_in_beam(block.middle, block.radius_m) &&
        block.may_face(fan.origin, reach_of(block) + fan.bend.turn_rad, label.two_sided);
    const bool may_echo = small && sight_.may_be_in_beam(block.middle, block.radius_m);
    if (!may_echo && !may_glint) continue;
    for (const FlatPart& flat_part : flat_parts.subspan(block.first, block.count)) {
      const Vector3d to = flat_part.middle - fan.origin;
      if (may_echo) add_facets(flat_part, to, object, small_m, facet_gain);
      if (!may_glint) continue;
      const std::optional<RayToPlace> ray = sight_.ray_to(to);
      if (!ray) continue;
      if (!(ray->apparent.dot(flat_part.normal.cast<double>()) < 0.0) && !label.two_sided) continue;
      add_glint(flat_part, to, ray->apparent, specular, object);
    }
  }
  if (specular > 0.0 && !whole)
    for (const RightCorner& corner : object.corners)
      if (corner.open || label.two_sided) add_corner(corner, specular, object);
}

/// Adds the steady echo of an object that is shorter than the waves, as a whole.
void ObjectEchoes::add_small_body(const SmallBody& body, double specular,
                                  const ObjectSurface& object) {
  const Vector3d place = object.middle - sight_.fan().origin;
  const std::optional<RayToPlace> ray = sight_.ray_to(place);
  if (!ray) return;
  // The object's surface is nearer than its middle.
  const std::optional<ObjectSight::Sight> sight =
      sight_.sight_of(place, {place, object.label, object.radius_m});
  if (!sight || !(sight->seen > 0.0)) return;
  const double cross_section_m2 = body.cross_section_m2(-ray->apparent.normalized(), wavelength_m_);
  glints_.push_back(glint_at(place, sight->range_m,
                             sight->seen * sight->energy * specular * cross_section_m2,
                             object.label, object.flat_parts.front().surface));
}

/// Cuts the flat part into cells that are as small as a small object.
void ObjectEchoes::add_facets(const FlatPart& flat_part, const Vector3d& away,
                              const ObjectSurface& object, double small_m, double gain) {
  const Label& label = sight_.labels()[object.label];
  const scatter::BackscatterTable& table = materials_[label.sediment].table;
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
    const std::optional<RayToPlace> ray = sight_.ray_to(place);
    ObjectSight::Line line;
    if (!ray || (!(ray->apparent.dot(normal) < 0.0) && !label.two_sided) || !sight_.see(*ray, line))
      continue;
    const Vector3d arrival = ray->apparent.normalized();
    const double sine = std::min(std::abs(arrival.dot(normal)), 1.0);
    const double slope = std::sqrt(1.0 - sine * sine) / sine;
    // No convex body lies before its tangent plane, so a part that is nearer by more hides the
    // place.
    const double own_m = std::min(small_m, slope * sight_.apart_m(line.in_fan, ray->range_m));
    const ObjectSight::OwnPlace own{place, object.label, own_m};
    const double seen = sight_.seen_share(line.in_fan, ray->range_m, &own);
    if (!(seen > 0.0)) continue;
    const double area_m2 = cell_length_m * cell_width_m;
    const double cross_section_m2 = gain * table.sigma_over_sine(sine) * sine * area_m2;
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
  SonarFrom sonar_from;
  if (sight_.bent())  // bent rays
    sonar_from = [&](const Vector3d& place) -> Vector3d {
      const Vector3d& origin = sight_.fan().origin;
      const std::optional<RayToPlace> ray = sight_.ray_to(place - origin);
      return ray ? place - ray->apparent : origin;
    };
  const GlintBeam beam = sight_.glint_beam();
  std::optional<Mirror> mirror =
      mirror_of(flat_part, object.curved, apparent, wavelength_m_, sonar_from, &beam);
  if (!mirror) return;
  Vector3d place = away + mirror->offset;
  const Vector3d shows_seen = away + mirror->inside;
  std::optional<ObjectSight::Sight> sight =
      sight_.sight_of(place, {shows_seen, object.label}, !mirror->in_beam);
  if (!sight) return;
  bool partly_hidden = false;
  if (flat_part.facets == 0) {
    const FlatPartInBeam in_beam(flat_part, apparent, (apparent + mirror->offset).norm(),
                                 wavelength_m_, beam);
    const std::optional<SeenCells> cells = look_closer([&](std::size_t count) {
      return sight_.look_at_cells(flat_part, {away, object.label}, in_beam, count);
    });
    if (cells) sight->seen = cells->least;
    partly_hidden = cells && cells->least < cells->most;
    if (partly_hidden) mirror = in_beam.mirror(&*cells);
  } else if (mirror->line) {
    const MirrorLine line = *mirror->line;
    const BeamOnLine in_beam(line.away, line.along, 0.5 * line.length_m,
                             (apparent + mirror->offset).norm(), wavelength_m_, beam);
    const Vector3d middle = away + line.middle;
    const std::optional<SeenCells> seen = look_closer([&](std::size_t count) {
      return sight_.look_at_line(line, {middle, object.label}, in_beam, count);
    });
    if (seen) sight->seen = seen->least;
    partly_hidden = seen && seen->least < seen->most;
    if (partly_hidden) {
      const std::optional<LineGlint> glint =
          line_glint_in_beam(in_beam, line.away, line.along, line.width, line.other_width, &*seen);
      mirror->cross_section_m2 = glint ? glint->power_m3 : 0.0;
    }
  }
  if (!mirror) return;
  if (partly_hidden) {
    place = away + mirror->offset;
    sight = sight_.sight_of(place, {place, object.label}, false);
    if (!sight) return;
    sight->seen = 1.0;
  }
  if (!(sight->seen > 0.0)) return;
  glints_.push_back(glint_of(flat_part, *mirror, place, sight->range_m,
                             sight->seen * sight->energy * specular, object.label));
}

void ObjectEchoes::add_corner(const RightCorner& corner, double specular,
                              const ObjectSurface& object) {
  const Vector3d edge = corner.edge.cast<double>();
  const Vector3d to = corner.middle - sight_.fan().origin;
  const std::optional<RayToPlace> ray_to_middle = sight_.ray_to(to);
  if (!ray_to_middle) return;
  // The point of the edge that is nearest to the sonar.
  const Vector3d& apparent = ray_to_middle->apparent;
  const double length_m = double(corner.length_m);
  const GlintBeam beam = sight_.glint_beam();
  const std::optional<LineGlint> lengthwise =
      glint_of_line(apparent, edge, length_m, 1.0, 1.0, wavelength_m_, &beam);
  if (!lengthwise) return;
  const Vector3d offset = lengthwise->place_m * edge;
  const double range_m = lengthwise->range_m;
  const Vector3d back = -(apparent + offset) / range_m;
  const double sine_one = back.dot(corner.other.cast<double>());
  const double sine_other = back.dot(corner.one.cast<double>());
  if (!(sine_one > 0.0 && sine_other > 0.0)) return;
  const double width_m =
      2.0 * std::min(double(corner.one_m) * sine_one, double(corner.other_m) * sine_other);
  const Vector3d place = to + offset;
  // A corner may be inside an open body. It is seen only if its flat parts are seen, and not at the
  // very ends of its edge, next to which other rays pass.
  const Vector3d inner =
      to + std::clamp(lengthwise->place_m, -0.4 * length_m, 0.4 * length_m) * edge;
  const auto seen_of = [&](const Eigen::Vector3f& from_edge, float reach_m, double sine) {
    const Vector3d on_part = inner + 0.5 * double(reach_m) * from_edge.cast<double>();
    const std::optional<RayToPlace> ray = sight_.ray_to(on_part);
    ObjectSight::Line line;
    if (!ray || !sight_.see(*ray, line)) return 0.0;
    const double slope = std::sqrt(std::max(1.0 - sine * sine, 0.0)) / sine;
    const double own_m =
        std::min(double(reach_m), slope * sight_.apart_m(line.in_fan, ray->range_m));
    const ObjectSight::OwnPlace own{on_part, object.label, own_m};
    return sight_.seen_share(line.in_fan, ray->range_m, &own);
  };
  const double flat_parts_seen = sight_.labels()[object.label].two_sided
                                     ? std::min(seen_of(corner.one, corner.one_m, sine_one),
                                                seen_of(corner.other, corner.other_m, sine_other))
                                     : 1.0;
  if (!(flat_parts_seen > 0.0)) return;
  // The corner's own flat parts are nearer than its edge.
  const double own_m = double(std::max(corner.one_m, corner.other_m));
  const std::optional<ObjectSight::Sight> sight =
      sight_.sight_of(place, {place, object.label, own_m}, !lengthwise->in_beam);
  if (!sight || !(sight->seen > 0.0)) return;
  const double cross_section_m2 =
      corner_power_m2(width_m, double(corner.excess_rad), range_m, wavelength_m_) *
      lengthwise->power_m3 / (wavelength_m_ * wavelength_m_);
  glints_.push_back(glint_at(
      place, sight->range_m,
      flat_parts_seen * (sight->seen * sight->energy) * specular * specular * cross_section_m2,
      object.label, corner.surface));
}

void ObjectEchoes::find_walls(const ObjectSurface& object) {
  const Label& label = sight_.labels()[object.label];
  const std::optional<WallMirror>& mirror = materials_[label.sediment].wall;
  if (!mirror || !(mirror->smooth + mirror->rough > 0.0)) return;
  if (!sight_.may_see(object.middle, object.radius_m)) return;
  const std::span<const FlatPart> flat_parts = object.flat_parts;
  for (const FlatPartBlock& block : object.blocks)
    if (sight_.may_be_in_beam(block.middle, block.radius_m))
      for (const FlatPart& flat_part : flat_parts.subspan(block.first, block.count))
        if (std::abs(double(flat_part.normal.z())) < steepest_wall)
          add_wall(flat_part, *mirror, object.label);
}

void ObjectEchoes::add_wall(const FlatPart& flat_part, const WallMirror& mirror,
                            std::uint16_t its_label) {
  const Vector3d to = flat_part.middle - sight_.fan().origin;
  Vector3d normal = flat_part.normal.cast<double>();
  if (to.dot(normal) >= 0.0) {
    if (!sight_.labels()[its_label].two_sided) return;
    normal = -normal;
  }
  // The extents of the wall's rectangle in the horizontal direction and across it, by second
  // moments.
  const Vector3d level = normal.cross(Vector3d::UnitZ()).normalized(), up = level.cross(normal);
  const auto extent = [&](const Vector3d& direction) {
    return std::hypot(double(flat_part.length_m) * flat_part.along.cast<double>().dot(direction),
                      double(flat_part.width_m) * flat_part.across.cast<double>().dot(direction));
  };
  const double length_m = extent(level), height_m = extent(up);
  // How much of the wall is seen, at its place nearest to the middle of the beam, but not at its
  // very ends, next to which other rays pass.
  const Vector3d& axis = sight_.fan().array_axis;
  const double along = level.dot(axis);
  const double off_m = std::abs(along) > 1e-6 ? -to.dot(axis) / along : 0.0;
  const Vector3d place = to + std::clamp(off_m, -0.4 * length_m, 0.4 * length_m) * level;
  const std::optional<ObjectSight::Sight> sight = sight_.sight_of(place, {place, its_label});
  if (!sight || !(sight->seen > 0.0)) return;
  // A facet of a curved surface stands for normals on both sides of its own normal.
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
                        .reflected = sight->seen * share,
                        .slope = std::hypot(slope, bend)});
  };
  add(mirror.smooth, 0.0);
  add(mirror.rough, mirror.slope);
}

/// Joins facets of one surface at about one range to one glint at their mean range, and also the
/// pieces of a flat part, which add with their phases.
void ObjectEchoes::join_glints() {
  const auto turn_rad = [&](double path_m) {
    return 4.0 * std::numbers::pi / wavelength_m_ * path_m;
  };
  std::erase_if(glints_, [](const ObjectEcho& glint) { return !(glint.energy > 0.0); });
  std::ranges::sort(glints_, {}, [](const ObjectEcho& glint) {
    return std::tuple(glint.label, glint.surface, glint.range_m);
  });
  std::size_t count = 0;
  for (std::size_t i = 0, end; i < glints_.size(); i = end) {
    ObjectEcho sum = glints_[i];
    const double first_m = sum.range_m;
    std::complex<double> field;
    const auto add_field = [&](const ObjectEcho& piece) {
      field +=
          std::polar(std::sqrt(piece.energy), turn_rad(piece.range_m - first_m) + piece.phase_rad);
    };
    if (sum.piece) add_field(sum);
    sum.range_m *= sum.energy;
    sum.place *= sum.energy;
    for (end = i + 1; end < glints_.size(); ++end) {
      const ObjectEcho& glint = glints_[end];
      if (glint.label != sum.label || glint.surface != sum.surface ||
          glint.range_m - first_m > (sum.piece ? join_pieces_m_ : join_m_))
        break;
      sum.energy += glint.energy;
      sum.range_m += glint.energy * glint.range_m;
      sum.place += glint.energy * glint.place;
      if (sum.piece) add_field(glint);
    }
    sum.range_m /= sum.energy;
    sum.place /= sum.energy;
    if (sum.piece) {
      sum.energy = std::norm(field);
      sum.phase_rad = std::arg(field) - turn_rad(sum.range_m - first_m);
    }
    glints_[count++] = sum;
  }
  glints_.erase(glints_.begin() + static_cast<std::ptrdiff_t>(count), glints_.end());
}

}  // namespace ensonify::engine
