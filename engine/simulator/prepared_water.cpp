#include <ensonify/engine/simulator/prepared_water.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/scene/tables/profile_reader.h>

namespace ensonify::engine {

PreparedWater::PreparedWater(const Sea& sea, double mean_bed_m, double lowest_m)
    : sea_(sea),
      bed_depth_m_(std::max(0.0, -mean_bed_m)),
      sound_speed_mps_(
          sea.sound_speed_mps.value_or(scatter::sound_speed_mps(sea.water, 0.5 * bed_depth_m_))) {
  if (sea.profile.path.empty()) return;
  cast_ = read_profile(sea_.profile.path);
  sound_speed_mps_ = cast_->mean_speed_mps(0.0, bed_depth_m_);
  for (const std::string& remark : cast_->remarks(0.0, -lowest_m))
    warnings_.push_back(fmt::format("{}: {}", sea_.profile.name, remark));
  if (!sea_.absorption_db_per_km) warn_of_odd_speeds();
}

void PreparedWater::warn_of_odd_speeds() {
  for (const scatter::SoundSpeedLayer& layer : cast_->layers()) {
    if (!std::isfinite(layer.top_m)) continue;
    scatter::SeaWater water = sea_.water;
    const auto speed_at = [&](double temperature_c) {
      water.temperature_c = temperature_c;
      return scatter::sound_speed_mps(water, layer.top_m);
    };
    const auto [coldest_c, warmest_c] = scatter::mackenzie_fit.temperature_c;
    const double slowest_mps = speed_at(coldest_c), fastest_mps = speed_at(warmest_c);
    if (layer.top_mps >= slowest_mps && layer.top_mps <= fastest_mps) continue;
    warnings_.push_back(fmt::format(
        "{}: at {:.1f} m the sound speed is {:.1f} m/s, but water of {} psu and {} to {} degrees "
        "has {:.0f} to {:.0f} m/s; the nearest possible temperature is used for "
        "absorption: set sea.salinity_psu, or sea.absorption_db_per_km",
        sea_.profile.name, layer.top_m, layer.top_mps, water.salinity_psu, coldest_c, warmest_c,
        slowest_mps, fastest_mps));
    return;
  }
}

std::optional<scatter::SoundSpeedProfile> PreparedWater::profile(double frequency_hz) const {
  if (!cast_) return std::nullopt;
  // A cast has no temperatures, but they follow from its speeds.
  return cast_->with_absorption([&](double depth_m, double mps) {
    if (sea_.absorption_db_per_km) return *sea_.absorption_db_per_km / 1000.0;
    scatter::SeaWater water = sea_.water;
    water.temperature_c = scatter::temperature_of_sound_speed_c(mps, water.salinity_psu, depth_m);
    return scatter::absorption_db_per_m(water, depth_m, frequency_hz);
  });
}

Medium PreparedWater::medium(double frequency_hz, double altitude_m,
                             const scatter::SoundSpeedProfile* profile) const {
  if (profile)
    return {sound_speed_mps_,
            profile->mean_absorption_db_per_m(bed_depth_m_ - altitude_m, bed_depth_m_), profile};
  return {sound_speed_mps_,
          sea_.absorption_db_per_km
              ? *sea_.absorption_db_per_km / 1000.0
              : scatter::absorption_db_per_m(sea_.water, 0.5 * bed_depth_m_, frequency_hz)};
}

}  // namespace ensonify::engine
