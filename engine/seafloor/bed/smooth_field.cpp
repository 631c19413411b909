#include <ensonify/engine/seafloor/bed/smooth_field.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/interpolated.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t waves = 48;          // the sum of 48 waves has a kurtosis of 2.95
constexpr std::size_t together = 4;        // waves that take_values() adds at once; divides `waves`
constexpr double samples_per_wave = 10.0;  // then the interpolation errs by 1e-3 of the amplitude
constexpr double golden = 0.6180339887498949;

}  // namespace

SmoothField::SmoothField(const RandomStream& draws, double shortest_m, double longest_m)
    : shortest_m_(shortest_m) {
  if (!(shortest_m > 0.0 && longest_m >= shortest_m && std::isfinite(longest_m)))
    throw std::invalid_argument(fmt::format(
        "smooth field: waves of {} to {} m are not possible, expected 0 < shortest <= longest",
        shortest_m, longest_m));
  std::array<double, 2 * waves + 1> u;
  draws.uniform(u);
  double power = 0.0;
  for (std::size_t i = 0; i < waves; ++i) {
    // The half circle is divided into equal parts, with one random direction in each part. Lengths
    // are distributed evenly over the octaves.
    const double direction = std::numbers::pi * (static_cast<double>(i) + u[2 * i]) / waves;
    const double turned = golden * static_cast<double>(i) + u[2 * waves];
    const double share = turned - std::floor(turned);
    const double length_m = shortest_m * std::pow(longest_m / shortest_m, share);
    const double k = 2.0 * std::numbers::pi / length_m;
    waves_.push_back({k * std::cos(direction), k * std::sin(direction),
                      2.0 * std::numbers::pi * u[2 * i + 1], std::sqrt(length_m)});
    power += 0.5 * length_m;
  }
  double slope = 0.0;
  for (Wave& wave : waves_) {
    wave.amplitude /= std::sqrt(power);
    slope += 0.25 * wave.amplitude * wave.amplitude * (wave.kx * wave.kx + wave.ky * wave.ky);
  }
  slope_per_m_ = std::sqrt(slope);
}

double SmoothField::at(double x_m, double y_m) const {
  double sum = 0.0;
  for (const Wave& wave : waves_)
    sum += wave.amplitude * std::cos(wave.kx * x_m + wave.ky * y_m + wave.phase);
  return sum;
}

/// cos(kx x + ky y + p) is cos(kx x) cos(ky y + p) - sin(kx x) sin(ky y + p), so that only columns
/// and rows need cosines and sines.
void SmoothField::take_values(std::span<const double> x_m, std::span<const double> y_m,
                              std::span<double> values) const {
  const std::size_t columns = x_m.size();
  std::vector<double> cosines(columns * waves), sines(columns * waves);
  for (std::size_t w = 0; w < waves; ++w)
    for (std::size_t i = 0; i < columns; ++i) {
      cosines[w * columns + i] = std::cos(waves_[w].kx * x_m[i]);
      sines[w * columns + i] = std::sin(waves_[w].kx * x_m[i]);
    }
  for (std::size_t row = 0; row < y_m.size(); ++row) {
    const std::span<double> sums = values.subspan(row * columns, columns);
    std::ranges::fill(sums, 0.0);
    // Several waves together, so that the sums are read and written less often.
    for (std::size_t w = 0; w < waves; w += together) {
      std::array<double, together> cosine, sine;
      for (std::size_t k = 0; k < together; ++k) {
        const Wave& wave = waves_[w + k];
        const double turns_rad = wave.ky * y_m[row] + wave.phase;
        cosine[k] = wave.amplitude * std::cos(turns_rad);
        sine[k] = wave.amplitude * std::sin(turns_rad);
      }
      const double *const c = &cosines[w * columns], *const s = &sines[w * columns];
      for (std::size_t i = 0; i < columns; ++i) {
        double sum = sums[i];
        for (std::size_t k = 0; k < together; ++k)
          sum += cosine[k] * c[k * columns + i] - sine[k] * s[k * columns + i];
        sums[i] = sum;
      }
    }
  }
}

std::vector<double> SmoothField::over(const Heightfield& grid, int threads) const {
  std::vector<double> values(static_cast<std::size_t>(grid.points()));
  refine::for_parts(static_cast<std::size_t>(grid.rows), threads,
                    [&](std::size_t first_row, std::size_t end_row) {
                      const int row = static_cast<int>(first_row);
                      const int rows = static_cast<int>(end_row - first_row);
                      if (rows > 0)
                        std::ranges::copy(
                            over_band(grid.window(0, row, grid.columns, rows)),
                            values.begin() + static_cast<std::ptrdiff_t>(grid.index(0, row)));
                    });
  return values;
}

std::vector<double> SmoothField::over_band(const Heightfield& band) const {
  const auto places = [](std::size_t count, auto&& place) {
    std::vector<double> at_m(count);
    for (std::size_t i = 0; i < count; ++i) at_m[i] = place(i);
    return at_m;
  };
  const double step_m = shortest_m_ / samples_per_wave;
  if (step_m < 1.5 * std::max(band.cell_east_m, band.cell_north_m)) {
    std::vector<double> values(static_cast<std::size_t>(band.points()));
    const auto columns = static_cast<std::size_t>(band.columns);
    const auto rows = static_cast<std::size_t>(band.rows);
    take_values(places(columns, [&](std::size_t i) { return band.x_m(static_cast<int>(i)); }),
                places(rows, [&](std::size_t i) { return band.y_m(static_cast<int>(i)); }), values);
    return values;
  }
  return interpolated(
      band, step_m,
      [&](std::int64_t column, std::int64_t row, std::size_t columns, std::span<double> samples) {
        const auto from = [&](std::int64_t first) {
          return [=](std::size_t i) {
            return static_cast<double>(first + static_cast<std::int64_t>(i)) * step_m;
          };
        };
        take_values(places(columns, from(column)), places(samples.size() / columns, from(row)),
                    samples);
      });
}

}  // namespace ensonify::engine
