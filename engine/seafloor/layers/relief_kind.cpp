#include <ensonify/engine/seafloor/layers/relief_kind.h>

#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {

void check_relief_value(std::string_view list, std::string_view key, double low, double high,
                        double value) {
  const bool in_degrees = key.ends_with("_deg");
  const double given = in_degrees ? value / degree : value;
  const double rounding = in_degrees ? 1e-9 : 0.0;
  if (!(given >= low - rounding && given <= high + rounding))
    throw std::invalid_argument(
        fmt::format("{}: '{}' is {}, expected {} to {}", list, key, given, low, high));
}

void check_cover(std::string_view list, double per_hectare, double diameter_m, double mean_square) {
  constexpr double most = 20.0;
  const double cover = 1e-4 * per_hectare * diameter_m * diameter_m * mean_square;
  if (!(cover <= most))
    throw std::invalid_argument(
        fmt::format("{}: {} per hectare of {} m would cover the bed {} times, expected at most {}",
                    list, per_hectare, diameter_m, cover, most));
}

}  // namespace ensonify::engine
