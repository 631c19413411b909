#include <ensonify/scatter/backscatter.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

constexpr double half_right_angle_sine = std::numbers::sqrt2 / 2.0;
constexpr double smallest_grazing_rad = 1e-6;  // where the quotient's limit is taken

template <std::size_t N>
double interpolate(const std::array<double, N>& table, double place) {
  const auto i = static_cast<std::size_t>(place);
  return table[i] + (place - static_cast<double>(i)) * (table[i + 1] - table[i]);
}

}  // namespace

Lambert::Lambert(double mu_db) : mu_(from_db(mu_db)) {
  if (!(mu_ <= std::numbers::inv_pi))
    throw std::invalid_argument(
        "Lambert: mu_db is above -4.97 dB: more than the arriving energy would be scattered");
}

double Lambert::cross_section(double grazing_rad) const {
  const double s = std::sin(grazing_rad);
  return mu_ * s * s;
}

BackscatterTable::BackscatterTable(const Backscatter& model) {
  const auto quotient = [&](double grazing_rad) {
    const double g = std::max(grazing_rad, smallest_grazing_rad);
    return model.cross_section(g) / std::sin(g);
  };
  for (int i = 0; i < cells + 2; ++i) {
    // The last entry only guards the interpolation's upper neighbour.
    const double x = std::min(i, cells) * half_right_angle_sine / cells;
    by_sine_[i] = quotient(std::asin(x));
    by_cosine_[i] = quotient(std::acos(x));
  }
}

double BackscatterTable::over_sine(double sin_grazing) const {
  constexpr double places = cells / half_right_angle_sine;
  if (sin_grazing < half_right_angle_sine) return interpolate(by_sine_, sin_grazing * places);
  const double cosine = std::sqrt(std::max(0.0, 1.0 - sin_grazing * sin_grazing));
  return interpolate(by_cosine_, cosine * places);
}

}  // namespace ensonify::scatter
