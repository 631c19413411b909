#include <ensonify/engine/seafloor/bed/wave_bands.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr int taps = 12;  // points of the interpolation from one lattice to the next
constexpr int taps_before = taps / 2 - 1;

// Between 16 and 48 points per wave of a band, its share falls and the share of the next coarser
// band rises. 16 points are 4 points of the coarser lattice, enough to interpolate.
constexpr double shortest_handed_over = 16.0, longest_kept = 48.0;

double handed_over(double points_per_wave) {
  return smooth_step(std::log(points_per_wave / shortest_handed_over) /
                     std::log(longest_kept / shortest_handed_over));
}

/// The modified Bessel function I0, by its series.
double bessel_i0(double x) {
  double term = 1.0, sum = 1.0;
  for (int k = 1; k < 40; ++k) {
    term *= 0.25 * x * x / (static_cast<double>(k) * k);
    sum += term;
  }
  return sum;
}

/// The weights of the points around a place that lies `phase` quarters of a step behind a point of
/// the coarser lattice: a sinc in Kaiser's window. They keep waves of at least 4 points, and
/// suppress the images of these waves at 4/3 points.
std::array<double, taps> interpolation(int phase) {
  constexpr double beta = 8.0;
  std::array<double, taps> weights{};
  double sum = 0.0;
  for (int i = 0; i < taps; ++i) {
    const double t = i - taps_before - static_cast<double>(phase) / band_ratio;
    const double u = t / (0.5 * taps);
    const double sinc = t == 0.0 ? 1.0 : std::sin(pi * t) / (pi * t);
    const double window = u * u < 1.0 ? bessel_i0(beta * std::sqrt(1.0 - u * u)) : 0.0;
    weights[static_cast<std::size_t>(i)] = sinc * window;
    sum += sinc * window;
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// The last coarser point that is not behind a place.
std::int64_t coarser_point(std::int64_t place) {
  return (place - (place % band_ratio + band_ratio) % band_ratio) / band_ratio;
}

/// The first point, counted from `first`, for the interpolation to a place; and the phase.
std::pair<std::size_t, std::size_t> place_of(std::int64_t place, std::int64_t first) {
  const std::int64_t before = coarser_point(place);
  return {static_cast<std::size_t>(before - taps_before - first),
          static_cast<std::size_t>(place - before * band_ratio)};
}

}  // namespace

double smooth_step(double t) {
  const double u = std::clamp(t, 0.0, 1.0);
  return u * u * u * u * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u * u * u);
}

double kept_share(double points_per_wave) {
  if (points_per_wave <= shortest_handed_over) return 1.0;
  return std::cos(0.5 * pi * handed_over(points_per_wave));
}

double handed_over_share(double points_per_wave) {
  if (points_per_wave <= shortest_handed_over) return 0.0;
  return std::sin(0.5 * pi * handed_over(points_per_wave));
}

LatticeWindow LatticeWindow::coarser() const {
  const auto first = [](std::int64_t place) { return coarser_point(place) - taps_before; };
  const auto points = [&](std::int64_t place, int count) {
    return static_cast<int>(coarser_point(place + count - 1) + taps / 2 + 1 - first(place));
  };
  return {first(column), first(row), points(column, columns), points(row, rows)};
}

void add_interpolated(std::span<const double> coarser, const LatticeWindow& window,
                      std::span<double> heights) {
  const LatticeWindow wide = window.coarser();
  const auto columns = static_cast<std::size_t>(window.columns);
  const auto rows = static_cast<std::size_t>(window.rows);
  const auto wide_columns = static_cast<std::size_t>(wide.columns);
  const auto wide_rows = static_cast<std::size_t>(wide.rows);
  std::array<std::array<double, taps>, band_ratio> weights;
  for (int phase = 0; phase < band_ratio; ++phase)
    weights[static_cast<std::size_t>(phase)] = interpolation(phase);

  // First along the rows, then across them.
  std::vector<double> along(wide_rows * columns);
  for (std::size_t column = 0; column < columns; ++column) {
    const auto [first, phase] =
        place_of(window.column + static_cast<std::int64_t>(column), wide.column);
    for (std::size_t row = 0; row < wide_rows; ++row) {
      double sum = 0.0;
      for (std::size_t i = 0; i < taps; ++i)
        sum += weights[phase][i] * coarser[row * wide_columns + first + i];
      along[row * columns + column] = sum;
    }
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto [first, phase] = place_of(window.row + static_cast<std::int64_t>(row), wide.row);
    double* const to = heights.data() + row * columns;
    for (std::size_t i = 0; i < taps; ++i) {
      const double weight = weights[phase][i];
      const double* const from = along.data() + (first + i) * columns;
      for (std::size_t column = 0; column < columns; ++column) to[column] += weight * from[column];
    }
  }
}

}  // namespace ensonify::engine
