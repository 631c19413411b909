#include <ensonify/engine/trace/refraction/travel_time.h>

#include <cmath>

namespace ensonify::engine {
namespace {

constexpr double level_m = 1e-3;  // a ray is level if its depth changes by less

}  // namespace

TravelTime::TravelTime(const scatter::SoundSpeedProfile& profile, double reference_mps)
    : profile_(&profile), reference_mps_(reference_mps) {
  for (const scatter::SoundSpeedLayer& layer : profile.layers())
    layer_top_s_.push_back(
        std::isinf(layer.top_m) ? 0.0 : layer.top_m / profile.mean_speed_mps(0.0, layer.top_m));
}

void TravelTime::apply(const RayFan& fan, std::span<Hit> hits) {
  fan_ = &fan;
  straight_m_.resize(hits.size());
  const double source_s = at(-fan.origin.z()).time_s;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const double in_plane_z = fan.plane_direction(plane).z();
    for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
      const std::size_t number = plane * fan.elevations() + elevation;
      Hit& hit = hits[number];
      if (!hit) continue;
      const double deeper_m = -hit.t * (fan.grid->cos_elevation[elevation] * in_plane_z +
                                        fan.grid->sin_elevation[elevation] * fan.pole.z());
      const Depth there = at(deeper_m - fan.origin.z());
      straight_m_[number] = hit.t;
      // A slanted line takes as many times longer than the vertical one as it is longer.
      hit.t *= reference_mps_ * (std::abs(deeper_m) > level_m ? (there.time_s - source_s) / deeper_m
                                                              : 1.0 / there.speed_mps);
      if (hit.t > fan.range_m) hit = Hit{};
    }
  }
}

// Let p be a place from the sonar, and K(z) the reference speed divided by the mean speed down to
// p. The place of p in straightened space is K p. The Jacobian is K I + p (dK/dz e_z)^T, and a
// normal n becomes its inverse transposed times n: by Sherman and Morrison (n - e_z (p n) dK/dz /
// (K + p_z dK/dz)) / K. K + p_z dK/dz is the reference speed divided by the speed at p.
RayIncidence TravelTime::incidence_of(std::size_t number, Hit& hit) {
  const Eigen::Vector3d direction = fan_->direction(
      fan_->plane_direction(number / fan_->elevations()), number % fan_->elevations());
  const double straight_m = straight_m_[number];
  const Eigen::Vector3d place = fan_->origin + straight_m * direction;
  const double mean = straight_m / hit.t;  // speed, divided by the reference speed
  const double local = at(-place.z()).speed_mps / reference_mps_;
  const bool level = std::abs(straight_m * direction.z()) <= level_m;
  return {.place = place,
          .direction = direction,
          .spreading_m2 = straight_m * straight_m,
          .absorption_db =
              straight_m * profile_->mean_absorption_db_per_m(-fan_->origin.z(), -place.z()),
          .along = mean,
          .upwards = mean,
          .sideways = mean,
          .turn_along = 0.0,
          .turn_upwards = 1.0 / hit.t,
          .turn_sideways = 1.0 / hit.t,
          .upturn = level ? 0.0 : (local - mean) / direction.z()};
}

std::optional<RayToPlace> TravelTime::ray_to(const Eigen::Vector3d& origin,
                                             const Eigen::Vector3d& away) const {
  const double straight_m = away.norm(), from_m = -origin.z(), to_m = from_m - away.z();
  return RayToPlace{.launch = away / straight_m,
                    .apparent = away,
                    .range_m = straight_m * reference_mps_ / profile_->mean_speed_mps(from_m, to_m),
                    .absorption_db = straight_m * profile_->mean_absorption_db_per_m(from_m, to_m)};
}

/// In a layer of constant gradient g, sound needs the time log(1 + g dz / c) / g for the depth dz
/// below the top of the layer, where c is the speed at the top.
TravelTime::Depth TravelTime::at(double depth_m) const {
  const std::size_t i = profile_->layer_index(depth_m);
  const scatter::SoundSpeedLayer& layer = profile_->layers()[i];
  if (i == 0) return {depth_m / layer.top_mps, layer.top_mps};
  const double dz = depth_m - layer.top_m, x = layer.gradient_per_s * dz / layer.top_mps;
  // log(1 + x) / x; the next term of the series is below rounding.
  const double log_over_x =
      std::abs(x) > 5e-3
          ? std::log1p(x) / x
          : 1.0 - x * (1.0 / 2 - x * (1.0 / 3 - x * (1.0 / 4 - x * (1.0 / 5 - x * (1.0 / 6)))));
  return {layer_top_s_[i] + dz / layer.top_mps * log_over_x,
          layer.top_mps + layer.gradient_per_s * dz};
}

}  // namespace ensonify::engine
