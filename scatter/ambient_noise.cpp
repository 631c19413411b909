#include <ensonify/scatter/ambient_noise.h>

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

double checked_khz(double frequency_hz) {
  if (!(frequency_hz > 0.0 && std::isfinite(frequency_hz)))
    throw std::invalid_argument(
        fmt::format("ambient noise: frequency is {} Hz, expected more than 0", frequency_hz));
  return frequency_hz / 1000.0;
}

}  // namespace

double turbulence_noise_db(double frequency_hz) {
  return 17.0 - 30.0 * std::log10(checked_khz(frequency_hz));
}

double shipping_noise_db(double frequency_hz, double shipping) {
  const double f = checked_khz(frequency_hz);
  if (!(shipping >= 0.0 && shipping <= 1.0))
    throw std::invalid_argument(fmt::format(
        "ambient noise: shipping is {}, expected 0 (none near) to 1 (heavy traffic)", shipping));
  return 40.0 + 20.0 * (shipping - 0.5) + 26.0 * std::log10(f) - 60.0 * std::log10(f + 0.03);
}

double wind_noise_db(double frequency_hz, double wind_mps) {
  const double f = checked_khz(frequency_hz);
  if (!(wind_mps >= 0.0 && wind_mps <= 60.0))
    throw std::invalid_argument(
        fmt::format("ambient noise: wind is {} m/s, expected 0 to 60", wind_mps));
  return 50.0 + 7.5 * std::sqrt(wind_mps) + 20.0 * std::log10(f) - 40.0 * std::log10(f + 0.4);
}

double thermal_noise_db(double frequency_hz) {
  return -15.0 + 20.0 * std::log10(checked_khz(frequency_hz));
}

double ambient_noise_db(double frequency_hz, double wind_mps, double shipping) {
  return to_db(from_db(turbulence_noise_db(frequency_hz)) +
               from_db(shipping_noise_db(frequency_hz, shipping)) +
               from_db(wind_noise_db(frequency_hz, wind_mps)) +
               from_db(thermal_noise_db(frequency_hz)));
}

}  // namespace ensonify::scatter
