#include <ensonify/engine/scene/checks/water_check.h>

#include <cmath>

#include <fmt/format.h>

namespace ensonify::engine {

std::optional<std::string> out_of_water(const Eigen::Vector3d& place, double bed_height_m) {
  const double over_bed_m = place.z() - bed_height_m;
  if (place.z() == 0.0) return "at the sea surface, expected below it";
  if (place.z() > 0.0)
    return fmt::format(
        "{:.1f} m above the sea surface{}", place.z(),
        std::isnan(over_bed_m) ? "" : fmt::format(", {:.1f} m over the bed", over_bed_m));
  if (over_bed_m <= 0.0) return fmt::format("{:.1f} m below the bed", -over_bed_m);
  return std::nullopt;
}

std::optional<std::string> as_fast_as_sound(const Eigen::Vector3d& velocity_mps,
                                            double sound_speed_mps) {
  const double speed_mps = velocity_mps.norm();
  if (speed_mps < sound_speed_mps) return std::nullopt;
  return fmt::format("{:.4g} m/s, expected less than the speed of sound, {:.4g} m/s", speed_mps,
                     sound_speed_mps);
}

}  // namespace ensonify::engine
