#include <ensonify/engine/sonar/echo/object_echoes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <tuple>

#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::inv_sqrtpi, std::numbers::pi;

constexpr double few_planes = 6.0;   // that a small object is long, at most
constexpr double lobe_reach = 3.0;   // half widths of a lobe that count
constexpr double side_lobes = 10.0;  // of a flat patch that count

/// C(t) + i S(t): the integral of exp(i pi u^2 / 2) from 0 to t. Near 0 by its power series (7.3.11
/// and 7.3.13 of Abramowitz and Stegun 1964), elsewhere by 7.3.9, 7.3.10, 7.3.32 and 7.3.33: within
/// 0.002.
std::complex<double> fresnel(double t) {
  const double phase = 0.5 * pi * t * t;
  if (std::abs(t) < 1.8) {
    std::complex<double> term = t, sum = t;
    for (int n = 1; n <= 24; ++n) {
      term *= std::complex<double>(0.0, phase / n);
      sum += term / (2.0 * n + 1.0);
    }
    return sum;
  }
  const double x = std::abs(t);
  const double f = (1.0 + 0.926 * x) / (2.0 + 1.792 * x + 3.104 * x * x);
  const double g = 1.0 / (2.0 + 4.142 * x + 3.492 * x * x + 6.670 * x * x * x);
  const double sine = std::sin(phase), cosine = std::cos(phase);
  const std::complex<double> value(0.5 + f * sine - g * cosine, 0.5 - f * cosine - g * sine);
  return t < 0.0 ? -value : value;
}

/// One direction of a patch at a range, whose normal is inclined by `tilt` to the sonar.
struct Extent {
  double length_m, lobe, tilt, range_m;
  bool curved;

  Extent(double its_length_m, double bend_rad, double its_tilt, double its_range_m,
         double wavelength_m)
      : length_m(its_length_m), tilt(its_tilt), range_m(its_range_m) {
    curved = bend_rad > 0.0;
    lobe = curved ? bend_rad : 0.5 * inv_sqrtpi * wavelength_m / length_m;
  }
  bool reaches() const {
    const double reach = curved ? lobe_reach * lobe : side_lobes * lobe / inv_sqrtpi;
    return std::abs(tilt) < 0.5 * length_m / range_m + reach;
  }
  /// I of ObjectEchoes, m^2.
  double power_m2(double wavelength_m) const {
    const double zone_m2 = wavelength_m * range_m;
    if (curved) {
      const double half = 0.5 * length_m / range_m;
      return 0.25 * zone_m2 * (std::erf((tilt + half) / lobe) - std::erf((tilt - half) / lobe));
    }
    if (length_m * length_m < 0.09 * zone_m2) {  // far away
      const double x = 2.0 * pi * length_m * tilt / wavelength_m;
      const double sinc = std::abs(x) < 1e-4 ? 1.0 : std::sin(x) / x;
      return length_m * length_m * sinc * sinc;
    }
    const double per_m = 2.0 / std::sqrt(zone_m2), middle_m = range_m * tilt;
    return 0.25 * zone_m2 *
           std::norm(fresnel(per_m * (0.5 * length_m - middle_m)) -
                     fresnel(per_m * (-0.5 * length_m - middle_m)));
  }
  /// From the patch's middle to what is most nearly a mirror for the sonar.
  double brightest_m() const { return std::clamp(range_m * tilt, -0.5 * length_m, 0.5 * length_m); }
};

}  // namespace

ObjectEchoes::ObjectEchoes(const Sonar& sonar, double wavelength_m, double sound_speed_mps,
                           const scatter::SoundSpeedProfile* profile,
                           std::span<const scatter::BackscatterTable> material_tables,
                           const ObjectSurfaces& surfaces)
    : wavelength_m_(wavelength_m),
      sound_speed_mps_(sound_speed_mps),
      join_m_(0.5 * std::max(sonar.bin_m(), sonar.pulse.cell_m(sound_speed_mps))),
      tolerance_m_(0.5 * sonar.bin_m()),
      profile_(profile),
      by_material_(material_tables),
      surfaces_(surfaces) {}

void ObjectEchoes::find(const SideView& view, const FaceLabels& labels, const FirstHits& first) {
  view_ = &view;
  labels_ = &labels;
  first_ = first;
  glints_.clear();
  facets_.clear();
  for (const std::uint16_t label : small_labels_) small_[label] = 0;
  small_labels_.clear();
  for (const std::vector<PatchedObject>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects)
      for (const PatchedObject& object : *objects) look_at(object);
  join_glints();
}

/// The line to a place, if that is within the fan and its beam.
bool ObjectEchoes::see(const Vector3d& away, Line& line) const {
  const RayFan& fan = *view_->fan;
  line.range_m = away.norm();
  line.direction = away / line.range_m;
  const double side = line.direction.dot(fan.array_axis), ahead = line.direction.dot(fan.middle);
  line.sin_elevation = line.direction.dot(fan.pole);
  const double cos_elevation = std::hypot(side, ahead);
  if (!(ahead > 0.0) || std::abs(side) > fan.grid->sin_truncation ||
      line.sin_elevation < fan.grid->sin_elevation.front() ||
      line.sin_elevation > fan.grid->sin_elevation.back())
    return false;
  line.sin_azimuth = side / cos_elevation;
  const BeamSample sample{static_cast<float>(line.sin_azimuth), 1.0f};
  line.weight = view_->beam->two_way(view_->side, {&sample, 1}, cos_elevation, line.direction,
                                     line.range_m, *view_->motion) /
                cos_elevation;
  return line.weight > 0.0;
}

/// The range by travel time over the straight distance; 1 where rays are straight and even.
double ObjectEchoes::time_share(const Vector3d& away) const {
  if (first_.runs || !profile_) return 1.0;
  const double from_m = -view_->fan->origin.z();
  return sound_speed_mps_ / profile_->mean_speed_mps(from_m, from_m - away.z());
}

/// Where a ray ends, or infinity; and the label there.
double ObjectEchoes::first_hit_m(std::size_t plane, std::size_t ray, int& label) const {
  constexpr double nothing = std::numeric_limits<double>::infinity();
  const RayFan& fan = *view_->fan;
  if (!first_.runs) {
    const Hit& hit = first_.hits[plane * fan.elevations() + ray];
    if (!hit) return nothing;
    label = labels_->label_of(hit.face);
    return hit.t;
  }
  const FanRuns& runs = *first_.runs;
  const auto begin = runs.end.begin() + static_cast<std::ptrdiff_t>(runs.first[plane]);
  const auto end = runs.end.begin() + static_cast<std::ptrdiff_t>(runs.first[plane + 1]);
  const auto found = std::upper_bound(begin, end, static_cast<std::uint32_t>(ray));
  if (found == end) return nothing;
  const auto run = static_cast<std::size_t>(found - runs.end.begin());
  if (runs.begin[run] > ray) return nothing;
  label = labels_->label_of(runs.face[run]);
  const double range_m = runs.distance[run] / (runs.level[run] * fan.grid->cos_elevation[ray] +
                                               runs.pole[run] * fan.grid->sin_elevation[ray]);
  return range_m > 0.0 ? range_m : nothing;
}

/// How much of the sound reaches a place: of the four rays that surround it, the share that goes at
/// least so far. What has own_label hides nothing (-1: there is none).
double ObjectEchoes::seen_share(const Line& line, double time_range_m, int own_label) const {
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
  double seen = 0.0;
  for (const std::size_t p : {0, 1})
    for (const std::size_t j : {0, 1}) {
      const double share =
          (p ? plane.second : 1.0 - plane.second) * (j ? ray.second : 1.0 - ray.second);
      int label = -1;
      const double first_m = first_hit_m(plane.first - 1 + p, ray.first - 1 + j, label);
      const bool hidden =
          first_m < time_range_m - tolerance_m_ && (own_label < 0 || label != own_label);
      if (!hidden) seen += share;
    }
  return seen;
}

void ObjectEchoes::look_at(const PatchedObject& object) {
  const RayFan& fan = *view_->fan;
  const Vector3d away = object.middle - fan.origin;
  const double distance_m = away.norm(), side_m = away.dot(fan.array_axis);
  if (distance_m > fan.range_m + object.radius_m || distance_m <= object.radius_m ||
      away.dot(fan.middle) < -object.radius_m ||
      std::abs(side_m) > object.radius_m + fan.grid->sin_truncation * distance_m)
    return;
  const std::vector<FanGrid::Plane>& planes = fan.grid->planes;
  const double apart_m = planes[planes.size() / 2].width_rad * distance_m;  // where it is least
  const bool small = 2.0 * object.radius_m < few_planes * apart_m;
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
  for (const FlatPart& patch : object.patches) {
    const Vector3d to = patch.middle - fan.origin;
    const double facing_m = -to.dot(patch.normal.cast<double>());
    if (facing_m <= 0.0 && !label.two_sided) continue;
    if (small)
      add_facet(patch, to, std::abs(facing_m) / to.norm(), object, by_material_[label.sediment]);
    if (specular > 0.0) add_glint(patch, to, specular, object);
  }
}

void ObjectEchoes::add_facet(const FlatPart& patch, const Vector3d& away, double sine,
                             const PatchedObject& object, const scatter::BackscatterTable& table) {
  Line line;
  if (!see(away, line)) return;
  const double range_m = line.range_m * time_share(away);
  const double seen = seen_share(line, range_m, object.label);
  if (!(seen > 0.0)) return;
  const double area_m2 = double(patch.length_m) * double(patch.width_m);
  const double cross_section_m2 = table.sigma_over_sine(std::min(sine, 1.0)) * sine * area_m2;
  const auto half = [&](const Eigen::Vector3f& axis, float length_m) {
    return 0.5 * double(length_m) * std::abs(line.direction.dot(axis.cast<double>()));
  };
  facets_.push_back(
      {.range_m = range_m,
       .spread_m = half(patch.along, patch.length_m) + half(patch.across, patch.width_m),
       .energy = seen * line.weight * cross_section_m2 / std::pow(line.range_m, 4),
       .place = away,
       .grazing_rad = std::asin(std::min(sine, 1.0)),
       .label = object.label,
       .surface = patch.surface});
}

void ObjectEchoes::add_glint(const FlatPart& patch, const Vector3d& away, double specular,
                             const PatchedObject& object) {
  const double range_m = away.norm();
  const Vector3d along = patch.along.cast<double>(), across = patch.across.cast<double>();
  const Extent one(double(patch.length_m), double(patch.bend_along_rad), -away.dot(along) / range_m,
                   range_m, wavelength_m_);
  if (!one.reaches()) return;
  const Extent other(double(patch.width_m), double(patch.bend_across_rad),
                     -away.dot(across) / range_m, range_m, wavelength_m_);
  if (!other.reaches()) return;
  const Vector3d place = away + one.brightest_m() * along + other.brightest_m() * across;
  Line line;
  if (!see(place, line)) return;
  const double time_range_m = line.range_m * time_share(place);
  const double seen = seen_share(line, time_range_m, -1);
  if (!(seen > 0.0)) return;
  const double cross_section_m2 = specular * one.power_m2(wavelength_m_) *
                                  other.power_m2(wavelength_m_) / (wavelength_m_ * wavelength_m_);
  glints_.push_back({.range_m = time_range_m,
                     .spread_m = 0.0,
                     .energy = seen * line.weight * cross_section_m2 / std::pow(line.range_m, 4),
                     .place = place,
                     .grazing_rad = 0.5 * pi,
                     .label = object.label,
                     .surface = patch.surface});
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
