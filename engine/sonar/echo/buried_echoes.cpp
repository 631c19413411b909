#include <ensonify/engine/sonar/echo/buried_echoes.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ensonify/engine/sonar/echo/glint.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr double same_place_m = 1e-3;  // largest difference of two estimates of a place
constexpr int max_turns = 8;           // number of estimates
constexpr double inaudible = 14.0;     // nepers of energy that sound loses in the bed: 61 dB

}  // namespace

void BuriedEchoes::find(const BuriedGroup& group, std::vector<ObjectEcho>& facets,
                        std::vector<ObjectEcho>& glints) const {
  if (!sight_.may_see(group.middle, group.radius_m)) return;
  const Label& label = sight_.labels()[group.label];
  const double specular = materials_[label.sediment].smooth_specular;
  for (std::size_t i = 0, end; i < group.parts.size(); i = end) {
    const FlatPart& flat_part = *group.parts[i].whole;
    const Vector3d along = flat_part.along.cast<double>(), across = flat_part.across.cast<double>();
    const BuriedPart* nearest = &group.parts[i];  // to the foot of the line of sight
    double min_m2 = std::numeric_limits<double>::infinity();
    for (end = i; end < group.parts.size() && group.parts[end].whole == &flat_part; ++end) {
      const BuriedPart& part = group.parts[end];
      if (sight_.may_see(part.flat.middle,
                         0.5 * (double(part.flat.length_m) + double(part.flat.width_m))))
        add_facets(part, group, label, facets);
      const Vector3d off = part.flat.middle - sight_.fan().origin;
      const double m2 = std::pow(off.dot(along), 2) + std::pow(off.dot(across), 2);
      if (m2 < min_m2) nearest = &part, min_m2 = m2;
    }
    if (specular > 0.0) add_glint(*nearest, group, specular, glints);
  }
}

/// The way to a place that lies depth_m under the bed's plane above a part. Returns nullopt if no
/// sound enters, if almost nothing would return, or if the place is not under the bed. A bent ray
/// enters the bed like the straight ray of a sonar at the apparent place of this sonar. The point
/// of entry depends on the apparent place, and the apparent place depends on the point of entry, so
/// both are found by iteration.
std::optional<BuriedEchoes::Way> BuriedEchoes::way_into_bed(const Vector3d& away, double depth_m,
                                                            const BuriedPart& part) const {
  const std::uint16_t material = sight_.labels()[sight_.labels().label_of(part.bed_face)].sediment;
  if (!materials_[material].sediment) return std::nullopt;
  const scatter::Sediment& sediment = *materials_[material].sediment;
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
    const std::optional<RayToPlace> ray = sight_.ray_to(
        sight_.bent() ? Vector3d(apparent_entry + (away - apparent)) : apparent_entry);
    if (!ray) return std::nullopt;
    const Vector3d correction = ray->apparent - apparent_entry;
    if (sight_.bent() && turn < max_turns && correction.norm() > same_place_m) {
      apparent += correction;
      continue;
    }
    if (path.sediment_m > longest_m) return std::nullopt;
    return Way{.path = path,
               .sediment = &sediment,
               .ray = *ray,
               .arrival = path.cos_sediment * ahead - path.sin_sediment * part.bed_normal};
  }
}

/// The echo of 1 m^2 of cross-section by that way; energy 0 if there is no echo.
BuriedEchoes::Sight BuriedEchoes::see(const Way& way) const {
  ObjectSight::Line line;
  if (!sight_.see(way.ray, line)) return {};
  const double time_range_m =
      way.ray.range_m + way.path.sediment_m / way.sediment->sound_speed_ratio;
  if (time_range_m > sight_.fan().range_m) return {};
  // The bed's relief hides nothing that lies deeper than the relief is high.
  const double seen =
      sight_.seen_share(line.in_fan, way.ray.range_m - way.path.sediment_m, nullptr);
  // The factor of the energy for the further spreading in the sediment.
  const double more = std::pow(way.ray.apparent.squaredNorm() / way.path.spreading_m2, 2);
  return {.time_range_m = time_range_m,
          .energy = seen * line.energy * more *
                    scatter::buried_gain(way.path, *way.sediment, wavelength_m_)};
}

/// Cuts the part into cells that are narrow in the beam.
void BuriedEchoes::add_facets(const BuriedPart& part, const BuriedGroup& group, const Label& label,
                              std::vector<ObjectEcho>& facets) const {
  constexpr double planes_per_cell = 4.0;
  const RayFan& fan = sight_.fan();
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
  const scatter::BackscatterTable& table = materials_[label.sediment].table;
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
    const Sight sight = see(*way);
    if (!(sight.energy > 0.0)) continue;
    const double sine = std::min(std::abs(facing), 1.0);
    const double cross_section_m2 =
        table.sigma_over_sine(sine) * sine * cell_length_m * cell_width_m;
    const double spread_m = 0.5 * (cell_length_m * std::abs(way->arrival.dot(along)) +
                                   cell_width_m * std::abs(way->arrival.dot(across)));
    facets.push_back({.range_m = sight.time_range_m,
                      .spread_m = spread_m / way->sediment->sound_speed_ratio,
                      .energy = sight.energy * cross_section_m2,
                      .place = away,
                      .grazing_rad = std::asin(sine),
                      .label = group.label,
                      .surface = flat.surface});
  }
}

/// The glint of the whole flat part, with the bed above one of its parts. The flat part is treated
/// as if the sonar was sqrt(J) away, in the direction from which the sound arrives.
void BuriedEchoes::add_glint(const BuriedPart& part, const BuriedGroup& group, double specular,
                             std::vector<ObjectEcho>& glints) const {
  const FlatPart& flat_part = *part.whole;
  const Vector3d to = part.flat.middle - sight_.fan().origin;
  const auto to_part = way_into_bed(to, part.depth_m, part);
  if (!to_part) return;
  const double facing = -to_part->arrival.dot(flat_part.normal.cast<double>());
  // The normals of a curved surface are not farther from the flat part's.
  const double turn = double(flat_part.bend_along_rad) + double(flat_part.bend_across_rad);
  if (!(facing > 0.0) || (flat_part.facets > 0 && facing < 0.9 - turn)) return;
  const Vector3d off = flat_part.middle - part.flat.middle;
  const double wavelength_m = wavelength_m_ * to_part->sediment->sound_speed_ratio;
  const Vector3d apparent = std::sqrt(to_part->path.spreading_m2) * to_part->arrival;
  // Over a facet, the direction of the sound changes by more or less than the direction to a sonar
  // at one place. So each corner has its own direction, and neighbouring facets agree on which of
  // them has the glint.
  const auto sonar_from = [&](const Vector3d& place) {
    const Vector3d from_part = place - part.flat.middle;
    const auto way =
        way_into_bed(to + from_part, part.depth_m - from_part.dot(part.bed_normal), part);
    return way ? Vector3d(place - std::sqrt(way->path.spreading_m2) * way->arrival)
               : Vector3d(part.flat.middle - apparent);
  };
  const auto mirror = mirror_of(flat_part, *group.curved, off + apparent, wavelength_m, sonar_from);
  if (!mirror) return;
  const Vector3d from_part = off + mirror->offset;
  const auto way =
      way_into_bed(to + from_part, part.depth_m - from_part.dot(part.bed_normal), part);
  if (!way) return;
  const Sight sight = see(*way);
  if (!(sight.energy > 0.0)) return;
  glints.push_back(glint_of(flat_part, *mirror, to + from_part, sight.time_range_m,
                            sight.energy * specular, group.label));
}

}  // namespace ensonify::engine
