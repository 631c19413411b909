#include <ensonify/engine/recording/places.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace ensonify::engine {

bool is_on_earth(double latitude_deg, double longitude_deg) {
  return std::abs(latitude_deg) <= 90.0 && std::abs(longitude_deg) <= 360.0;
}

std::string place_text(double latitude_deg, double longitude_deg) {
  return fmt::format("latitude {:.6g}, longitude {:.6g}", latitude_deg, longitude_deg);
}

Eigen::Vector2d metres_per_radian(double latitude_rad) {
  constexpr double semi_major_m = 6378137.0, eccentricity_squared = 6.69437999014e-3;
  const double flattened = 1.0 - eccentricity_squared * std::pow(std::sin(latitude_rad), 2);
  const double prime_vertical_m = semi_major_m / std::sqrt(flattened);
  return {std::max(1.0, prime_vertical_m * std::cos(latitude_rad)),
          prime_vertical_m * (1.0 - eccentricity_squared) / flattened};
}

}  // namespace ensonify::engine
