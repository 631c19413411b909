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

}  // namespace ensonify::engine
