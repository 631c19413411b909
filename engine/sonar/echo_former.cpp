#include <ensonify/engine/sonar/echo_former.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/sonar/pulse.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {

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
                      refine::Triangles triangles, std::span<const Hit> hits,
                      std::span<const Arrival> arrivals, EchoLine& line) {
  triangles_ = triangles;
  aperture_ = &aperture;
  reception_ = &reception;
  side_ = line.side;
  bins_.reset();
  line.rays = line.hits = 0;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    walk_plane(fan, hits, arrivals, plane);
    for (std::size_t j = 0; j < fan.elevations(); ++j) {
      line.rays += fan.grid->within_beam(plane, j);
      line.hits += static_cast<bool>(hits[plane * fan.elevations() + j]);
    }
  }
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

void EchoFormer::walk_plane(const RayFan& fan, std::span<const Hit> hits,
                            std::span<const Arrival> arrivals, std::size_t plane) {
  const FanGrid& grid = *fan.grid;
  const std::size_t count = fan.elevations();
  bins_.begin_plane();
  const Eigen::Vector3d broadside = fan.plane_direction(plane);
  Sight before;        // the neighbour below, if it is in the beam
  Sight last;          // the last surface that ended, unless its back came after it
  bool fades = false;  // it ran out of range rather than ending
  for (std::size_t j = 0; j < count; ++j) {
    if (!grid.within_beam(plane, j)) {
      before = last = Sight{};
      continue;
    }
    const std::size_t number = plane * count + j;
    const Eigen::Vector3d direction = fan.direction(broadside, j);
    const Arrival* arrival = arrivals.empty() ? nullptr : &arrivals[number];
    const Sight now = look(fan, plane, j, direction, hits[number], arrival, before);
    const double step = j > 0 ? grid.elevation_rad[j] - grid.elevation_rad[j - 1] : 0.0;
    if (before && now && continuous(before, now)) {
      bins_.spread(before, now, step);
    } else {
      if (before) {
        const double onward_m = before.plane_range_m(direction);
        fades = !hits[number] && std::isfinite(onward_m) && onward_m >= fan.range_m;
        if (fades) {
          const Hit onward{
              .face = triangles_.number(before.index), .index = before.index, .t = onward_m};
          Arrival beyond;
          if (arrival)
            beyond = arrivals[number - 1].onwards(
                onward_m / before.range_m,
                onward_m * direction - before.range_m * before.direction);
          const Sight sight =
              look(fan, plane, j, direction, onward, arrival ? &beyond : nullptr, before);
          bins_.spread(before, sight, step);
        } else {
          bins_.settle(before, step);
        }
      }
      if (now) bins_.settle(now, step);
      if (before && now) bins_.shade(before, now.range_m, now.weight);
    }
    if (before && !now) last = before;
    if (hits[number] && !now) last = Sight{};  // a back: the surface's hole, not its shadow
    before = now;
  }
  // A surface that ends in mid-water hides all behind it, as does one that stands higher than the
  // fan; one that the fan's lower edge leaves hides nothing.
  if (before ? before.direction.z() >= 0.0 : last && !fades)
    shade_beyond(fan, plane, before ? before : last);
  bins_.end_plane();
}

// Up to the range limit, or to where the line of sight leaves the seafloor: nothing is known there.
void EchoFormer::shade_beyond(const RayFan& fan, std::size_t plane, const Sight& blocker) {
  double leaves_m = fan.range_m;
  for (int axis = 0; axis < 2; ++axis) {
    const double speed = blocker.direction[axis];
    if (speed == 0.0) continue;
    const double border = speed > 0.0 ? highest_[axis] : lowest_[axis];
    leaves_m = std::min(leaves_m, (border - fan.origin[axis]) / speed);
  }
  if (leaves_m > blocker.range_m)
    bins_.shade(blocker, leaves_m, weight(plane, blocker.elevation, blocker.direction, leaves_m));
}

float EchoFormer::weight(std::size_t plane, std::size_t elevation, const Eigen::Vector3d& direction,
                         double range_m) const {
  const FanGrid& grid = *aperture_->grid;
  const std::size_t ray = plane * grid.elevation_rad.size() + elevation;
  const auto side = static_cast<std::size_t>(side_);
  if (reception_->still && beam_.focused()) return aperture_->weight[side][ray];
  return static_cast<float>(
      beam_.two_way(side_, aperture_->samples_of(plane), grid.cos_elevation[elevation],
                    aperture_->vertical[side][ray], direction, range_m, *reception_));
}

Sight EchoFormer::look(const RayFan& fan, std::size_t plane, std::size_t elevation,
                       const Eigen::Vector3d& direction, const Hit& hit, const Arrival* arrival,
                       const Sight& before) const {
  Sight sight;
  if (!hit) return sight;
  if (hit.index == before.index && !arrival) {
    sight.normal = before.normal;
    sight.label = before.label;
  } else {
    const Eigen::Vector3d a = triangles_.corner(hit.index, 0);
    sight.normal = (triangles_.corner(hit.index, 1) - a)
                       .cross(triangles_.corner(hit.index, 2) - a)
                       .normalized();
    sight.label = labels_.label_of(hit.face);
  }
  const Label& label = labels_[sight.label];
  const Eigen::Vector3d& travel = arrival ? arrival->direction : direction;
  if (label.two_sided && sight.normal.dot(travel) > 0.0) sight.normal = -sight.normal;
  const double sine = std::min(-sight.normal.dot(travel), 1.0);
  if (sine <= 0.0) return sight;  // a back: it hides, but does not answer
  sight.index = hit.index;
  sight.elevation = elevation;
  sight.range_m = hit.t;
  sight.direction = direction;
  sight.grazing_rad = std::asin(sine);
  sight.weight = weight(plane, elevation, direction, hit.t);
  sight.place = fan.origin + hit.t * direction;
  const double spreading_m2 = arrival ? arrival->spreading_m2 : hit.t * hit.t;
  sight.density = sight.weight * by_material_[label.sediment].over_sine(sine) / spreading_m2;
  if (arrival) {  // the bins' gain absorbs over the range that the time stands for
    sight.density *= scatter::from_db(-2.0 * absorption_db_per_m_ * (arrival->path_m - hit.t));
    sight.place = arrival->place;
    sight.normal = arrival->pictured(sight.normal, direction);
  }
  return sight;
}

// Two facets that meet between the rays are no farther apart in range than one of them runs from the
// one ray to the other, and no farther in space than they are long. Twice that is allowed, for the
// small facets that may lie between.
bool EchoFormer::continuous(const Sight& a, const Sight& b) const {
  if (a.index == b.index) return true;
  const double apart_m = std::abs(b.range_m - a.range_m);
  const double run_m = std::max(std::abs(a.plane_range_m(b.direction) - a.range_m),
                                std::abs(b.plane_range_m(a.direction) - b.range_m));
  if (apart_m > 2.0 * run_m) return false;
  const double distance_m = (b.range_m * b.direction - a.range_m * a.direction).norm();
  return distance_m <= longest_edge_m(a.index) + longest_edge_m(b.index) + 2.0 * bins_.bin_m();
}

double EchoFormer::longest_edge_m(std::uint32_t index) const {
  const Eigen::Vector3d a = triangles_.corner(index, 0), b = triangles_.corner(index, 1),
                        c = triangles_.corner(index, 2);
  return std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
}

}  // namespace ensonify::engine
