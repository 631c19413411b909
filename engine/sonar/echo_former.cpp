#include <ensonify/engine/sonar/echo_former.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/sonar/pulse.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// Whether a ray can be left out of a run on one facet, because range and density go on like straight
/// lines over elevation from the last sight to the next ray: as curved as they are, for a five-hundredth.
bool goes_on(const FanGrid& grid, const Sight& last, std::size_t j, const Hit* hits) {
  constexpr std::size_t longest = 8;  // rays
  constexpr double widest_rad = 0.005, bend = 0.002;
  const Hit &hit = hits[j], &next = hits[j + 1];
  if (hit.index != last.index || next.index != last.index || j - last.elevation >= longest)
    return false;
  const double so_far_rad = grid.elevation_rad[j] - grid.elevation_rad[last.elevation];
  const double step_rad = grid.elevation_rad[j + 1] - grid.elevation_rad[j];
  const double so_far = (hit.t - hits[last.elevation].t) * step_rad,
               onwards = (next.t - hit.t) * so_far_rad;
  return so_far_rad < widest_rad && std::abs(onwards - so_far) < bend * std::abs(so_far);
}

/// Of x in [0, 1], within 2e-8: Abramowitz and Stegun (1964), 4.4.46.
double arcsine(double x) {
  const double p =
      1.5707963050 +
      x * (-0.2145988016 +
           x * (0.0889789874 +
                x * (-0.0501743046 +
                     x * (0.0308918810 +
                          x * (-0.0170881256 + x * (0.0066700901 + x * -0.0012624911))))));
  return 0.5 * std::numbers::pi - std::sqrt(1.0 - x) * p;
}

}  // namespace

EchoFormer::EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
                       std::span<const scatter::BackscatterTable> by_material,
                       const std::vector<Label>* moving)
    : labels_(seafloor, moving),
      beam_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      by_material_(by_material),
      absorption_db_per_m_(medium.absorption_db_per_m),
      bins_(sonar.bin_m(), static_cast<std::size_t>(std::ceil(
                               trace_range_m(sonar, medium.sound_speed_mps) / sonar.bin_m())) +
                               1),
      pulse_(pulse_kernel(sonar.pulse, medium.sound_speed_mps, sonar.bin_m())) {
  const refine::Bounds box = seafloor.bounds();
  lowest_ = box.lowest.head<2>().cast<double>();
  highest_ = box.highest.head<2>().cast<double>();
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    const double range_m = (static_cast<double>(bin) + 0.5) * sonar.bin_m();
    gain_.push_back(
        scatter::from_db(sonar.source_level_db - 2.0 * medium.absorption_db_per_m * range_m));
  }
  energy_.resize(gain_.size() + 2 * pulse_.size());
  sums_.resize(static_cast<std::size_t>(sonar.bins));
}

void EchoFormer::form(const RayFan& fan, const Aperture& aperture, const Reception& reception,
                      refine::Triangles triangles, std::span<const Hit> hits, RayArrivals* arrivals,
                      EchoLine& line) {
  triangles_ = triangles;
  plane_beam_.begin(beam_, fan, aperture, reception, line.side);
  bins_.reset();
  line.rays = line.hits = 0;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    walk_plane(fan, hits, arrivals, plane, line);
  bins_.tell(labels_, line);

  const std::size_t margin = pulse_.size();
  for (std::size_t i = 0; i < gain_.size(); ++i) energy_[margin + i] = gain_[i] * bins_.energy(i);
  // Bins within, so that they are summed side by side.
  const double* here = &energy_[margin];
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] = pulse_[0] * here[i];
  for (std::size_t d = 1; d < pulse_.size(); ++d)
    for (std::size_t i = 0; i < sums_.size(); ++i)
      sums_[i] += pulse_[d] * (here[i + d] + *(here + i - d));
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    line.bins.intensity_mean[i] = line.bins.intensity[i] = static_cast<float>(sums_[i]);
    line.bins.range_m[i] = static_cast<float>((static_cast<double>(i) + 0.5) * bins_.bin_m());
  }
}

void EchoFormer::walk_plane(const RayFan& fan, std::span<const Hit> hits, RayArrivals* arrivals,
                            std::size_t plane, EchoLine& line) {
  const FanGrid& grid = *fan.grid;
  const std::size_t count = fan.elevations();
  bins_.begin_plane();
  plane_beam_.begin_plane(plane);
  const Eigen::Vector3d broadside = fan.plane_direction(plane);
  Sight sights[2];
  Sight *before = &sights[0], *now = &sights[1];  // before: the neighbour below, if in the beam
  Sight last;          // the last surface that ended, unless its back came after it
  bool fades = false;  // it ran out of range rather than ending
  for (std::size_t j = 0; j < count; ++j) {
    if (!grid.within_beam(plane, j)) {
      *before = last = Sight{};
      continue;
    }
    const std::size_t number = plane * count + j;
    Hit hit = hits[number];
    ++line.rays;
    line.hits += static_cast<bool>(hit);
    if (*before && j + 1 < count && goes_on(grid, *before, j, &hits[plane * count])) continue;
    const Eigen::Vector3d direction = fan.direction(broadside, j);
    Arrival arrival;
    if (arrivals && hit) arrival = arrivals->tell(number, hit);
    look(fan, j, direction, hit, arrivals ? &arrival : nullptr, *before, *now);
    const std::size_t neighbour = *before ? before->elevation : j > 0 ? j - 1 : j;
    const double step = grid.elevation_rad[j] - grid.elevation_rad[neighbour];
    if (*before && *now && continuous(*before, *now)) {
      bins_.spread(*before, *now, step);
    } else {
      if (*before) {
        const double onward_m = before->plane_range_m(direction);
        fades = !hit && std::isfinite(onward_m) && onward_m >= fan.range_m;
        if (fades) {
          const Hit onward{
              .face = triangles_.number(before->index), .index = before->index, .t = onward_m};
          Arrival beyond;
          if (arrivals) {
            Hit last_hit = hits[number - 1];
            beyond = arrivals->tell(number - 1, last_hit)
                         .onwards(onward_m / before->range_m,
                                  onward_m * direction - before->range_m * before->direction);
          }
          Sight sight;
          look(fan, j, direction, onward, arrivals ? &beyond : nullptr, *before, sight);
          bins_.spread(*before, sight, step);
        } else {
          bins_.settle(*before, step);
        }
      }
      if (*now) bins_.settle(*now, step);
      if (*before && *now) bins_.shade(*before, now->range_m, now->weight);
    }
    if (*before && !*now) last = *before;
    if (hit && !*now) last = Sight{};  // a back: the surface's hole, not its shadow
    std::swap(before, now);
  }
  // A surface that ends in mid-water hides all behind it, as does one that stands higher than the
  // fan; one that the fan's lower edge leaves hides nothing.
  if (*before ? before->direction.z() >= 0.0 : last && !fades)
    shade_beyond(fan, *before ? *before : last);
  bins_.end_plane();
}

// Up to the range limit, or to where the line of sight leaves the seafloor: nothing is known there.
void EchoFormer::shade_beyond(const RayFan& fan, const Sight& blocker) {
  double leaves_m = fan.range_m;
  for (int axis = 0; axis < 2; ++axis) {
    const double speed = blocker.direction[axis];
    if (speed == 0.0) continue;
    const double border = speed > 0.0 ? highest_[axis] : lowest_[axis];
    leaves_m = std::min(leaves_m, (border - fan.origin[axis]) / speed);
  }
  if (leaves_m > blocker.range_m)
    bins_.shade(blocker, leaves_m, plane_beam_.weight(blocker.elevation, leaves_m));
}

void EchoFormer::look(const RayFan& fan, std::size_t elevation, const Eigen::Vector3d& direction,
                      const Hit& hit, const Arrival* arrival, const Sight& before, Sight& sight) {
  sight.index = Hit::none;
  if (!hit) return;
  if (hit.index == before.index && !arrival) {
    sight.normal = before.normal;
    sight.label = before.label;
    sight.longest_edge_m = before.longest_edge_m;
  } else {
    const Eigen::Vector3d a = triangles_.corner(hit.index, 0);
    sight.normal = (triangles_.corner(hit.index, 1) - a)
                       .cross(triangles_.corner(hit.index, 2) - a)
                       .normalized();
    sight.label = labels_.label_of(hit.face);
    sight.longest_edge_m = -1.0;
  }
  const Label& label = labels_[sight.label];
  const Eigen::Vector3d& travel = arrival ? arrival->direction : direction;
  if (label.two_sided && sight.normal.dot(travel) > 0.0) sight.normal = -sight.normal;
  const double sine = std::min(-sight.normal.dot(travel), 1.0);
  if (sine <= 0.0) return;  // a back: it hides, but does not answer
  sight.index = hit.index;
  sight.elevation = elevation;
  sight.range_m = hit.t;
  sight.bin = bins_.bin_of(hit.t);
  sight.direction = direction;
  sight.grazing_rad = arcsine(sine);
  sight.weight = plane_beam_.weight(elevation, hit.t);
  sight.place = fan.origin + hit.t * direction;
  const double spreading_m2 = arrival ? arrival->spreading_m2 : hit.t * hit.t;
  sight.density = sight.weight * by_material_[label.sediment].over_sine(sine) / spreading_m2;
  if (arrival) {  // the bins' gain absorbs over the range that the time stands for
    sight.density *= scatter::from_db(-2.0 * absorption_db_per_m_ * (arrival->path_m - hit.t));
    sight.place = arrival->place;
    sight.normal = arrival->pictured(sight.normal, direction);
  }
}

// Two facets that meet between the rays are no farther apart in range than one of them runs from the
// one ray to the other, and no farther in space than they are long. Twice that is allowed, for the
// small facets that may lie between.
bool EchoFormer::continuous(Sight& a, Sight& b) const {
  if (a.index == b.index) return true;
  const double apart_m = std::abs(b.range_m - a.range_m);
  const double run_m = std::max(std::abs(a.plane_range_m(b.direction) - a.range_m),
                                std::abs(b.plane_range_m(a.direction) - b.range_m));
  if (apart_m > 2.0 * run_m) return false;
  const double distance_m = (b.range_m * b.direction - a.range_m * a.direction).norm();
  return distance_m <= longest_edge_m(a) + longest_edge_m(b) + 2.0 * bins_.bin_m();
}

double EchoFormer::longest_edge_m(Sight& sight) const {
  if (sight.longest_edge_m < 0.0) {
    const Eigen::Vector3d a = triangles_.corner(sight.index, 0),
                          b = triangles_.corner(sight.index, 1),
                          c = triangles_.corner(sight.index, 2);
    sight.longest_edge_m =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  }
  return sight.longest_edge_m;
}

}  // namespace ensonify::engine
