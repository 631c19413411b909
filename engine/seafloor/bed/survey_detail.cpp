#include <ensonify/engine/seafloor/bed/survey_detail.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/bed/catmull_rom.h>
#include <ensonify/engine/seafloor/bed/spectral.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr double max_points = 268435456.0;  // 2^28

/// Interpolates between the middle two of four heights; a missing outer one is extrapolated
/// linearly.
double between(std::array<double, 4> p, double t) {
  if (t == 0.0) return p[1];
  if (std::isnan(p[0])) p[0] = 2.0 * p[1] - p[2];
  if (std::isnan(p[3])) p[3] = 2.0 * p[2] - p[1];
  const auto w = catmull_rom(t);
  return w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + w[3] * p[3];
}

/// Interpolates to a grid with cells divided by whole numbers; the original points keep their
/// heights.
Heightfield interpolated(const Heightfield& coarse, int parts_east, int parts_north) {
  Heightfield fine = coarse;
  fine.columns = (coarse.columns - 1) * parts_east + 1;
  fine.rows = (coarse.rows - 1) * parts_north + 1;
  fine.cell_east_m = coarse.cell_east_m / parts_east;
  fine.cell_north_m = coarse.cell_north_m / parts_north;
  fine.z_m.assign(static_cast<std::size_t>(fine.columns) * static_cast<std::size_t>(fine.rows),
                  0.0);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const auto width = static_cast<std::size_t>(fine.columns);
  std::vector<double> lines(static_cast<std::size_t>(coarse.rows) *
                            width);  // fine to the east, coarse to the north
  for (int row = 0; row < coarse.rows; ++row)
    for (int column = 0; column < fine.columns; ++column) {
      const int left = column / parts_east;
      const auto at = [&](int c) {
        return c < 0 || c >= coarse.columns ? none : coarse.at(c, row);
      };
      lines[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] =
          between({at(left - 1), at(left), at(left + 1), at(left + 2)},
                  static_cast<double>(column % parts_east) / parts_east);
    }
  for (int row = 0; row < fine.rows; ++row)
    for (int column = 0; column < fine.columns; ++column) {
      const int below = row / parts_north;
      const auto at = [&](int r) {
        return r < 0 || r >= coarse.rows
                   ? none
                   : lines[static_cast<std::size_t>(r) * width + static_cast<std::size_t>(column)];
      };
      fine.at(column, row) = between({at(below - 1), at(below), at(below + 1), at(below + 2)},
                                     static_cast<double>(row % parts_north) / parts_north);
    }
  return fine;
}

/// The power that a sampled and interpolated field lacks compared with a fractal one. Sampling
/// folds the spectrum Phi into the band that the cells carry, and interpolation repeats it outside
/// the band, multiplied by its response T: T^2 (Phi(k0) + the rest that was folded onto k0), where
/// k0 is the folded k. The rest is even and has no poles, so a table holds it.
class Missing {
 public:
  Missing(const FractalScale& scale, double cell_east_m, double cell_north_m)
      : exponent_(-(scale.hurst + 1.0)), east_(cell_east_m), north_(cell_north_m) {
    const double h = scale.hurst;
    factor_ = scale.height_at_1m_m * scale.height_at_1m_m * std::pow(2.0, 2.0 * h - 1.0) * h *
              std::tgamma(1.0 + h) / (pi * std::tgamma(1.0 - h));
    for (int row = 0; row <= steps; ++row)
      for (int column = 0; column <= steps; ++column) {
        double& sum = table_[static_cast<std::size_t>(row * (steps + 1) + column)];
        for (int m = -aliases; m <= aliases; ++m)
          for (int n = -aliases; n <= aliases; ++n)
            if (m != 0 || n != 0)
              sum += phi((pi * column / steps + 2.0 * pi * m) / east_,
                         (pi * row / steps + 2.0 * pi * n) / north_);
      }
  }

  double amplitude(double kx, double ky) const {
    const double x = std::abs(std::remainder(kx * east_, 2.0 * pi));
    const double y = std::abs(std::remainder(ky * north_, 2.0 * pi));
    const double response = catmull_rom_response(kx * east_) * catmull_rom_response(ky * north_);
    double there = 0.0;  // a wave sampled once per period adds only to the mean
    if (x > 1e-9 || y > 1e-9)
      there = response * response * (phi(x / east_, y / north_) + rest(x, y));
    return std::sqrt(std::max(0.0, phi(kx, ky) - there));
  }

 private:
  static constexpr int steps = 32, aliases = 6;

  double phi(double kx, double ky) const {
    return factor_ * std::pow(kx * kx + ky * ky, exponent_);
  }
  double rest(double x, double y) const {
    const double u = x / pi * steps, v = y / pi * steps;
    const int i = std::min(static_cast<int>(u), steps - 1),
              j = std::min(static_cast<int>(v), steps - 1);
    const auto at = [&](int column, int row) {
      return table_[static_cast<std::size_t>(row * (steps + 1) + column)];
    };
    const double a = u - i, b = v - j;
    return (1.0 - b) * ((1.0 - a) * at(i, j) + a * at(i + 1, j)) +
           b * ((1.0 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  }

  double exponent_, east_, north_, factor_ = 0.0;
  std::array<double, (steps + 1) * (steps + 1)> table_{};
};

/// Mean square of z(x + lag) - 2 z(x) + z(x - lag), along rows or columns.
double second_difference_m2(const Heightfield& field, int lag, bool east) {
  double sum = 0.0, count = 0.0;
  const int dc = east ? lag : 0, dr = east ? 0 : lag;
  for (int row = dr; row < field.rows - dr; ++row)
    for (int column = dc; column < field.columns - dc; ++column) {
      const double d = field.at(column + dc, row + dr) - 2.0 * field.at(column, row) +
                       field.at(column - dc, row - dr);
      if (std::isnan(d)) continue;
      sum += d * d;
      count += 1.0;
    }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace

FractalScale fractal_scale(const Heightfield& survey) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const bool east : {true, false})
    for (const int lag : {1, 2, 4}) {
      const double square = second_difference_m2(survey, lag, east);
      if (!(square > 0.0)) continue;
      const double a = std::log(lag * (east ? survey.cell_east_m : survey.cell_north_m));
      const double b = std::log(square);
      n += 1.0;
      x += a;
      y += b;
      xx += a * a;
      xy += a * b;
    }
  if (n < 2.0) return {};
  FractalScale scale;
  scale.hurst = std::clamp(0.5 * (n * xy - x * y) / (n * xx - x * x), 0.05, 0.95);
  const double log_level = (y - 2.0 * scale.hurst * x) / n;
  scale.height_at_1m_m = std::sqrt(std::exp(log_level) / (4.0 - std::pow(4.0, scale.hurst)));
  return scale;
}

Heightfield with_detail(const Heightfield& survey, const SurveyDetail& detail, std::uint64_t seed) {
  if (detail.cell_m == 0.0) return survey;
  const double parts_east = std::round(survey.cell_east_m / detail.cell_m);
  const double parts_north = std::round(survey.cell_north_m / detail.cell_m);
  if (!(detail.cell_m > 0.0 && std::max(parts_east, parts_north) >= 2.0))
    throw std::invalid_argument(
        fmt::format("survey detail: cells of {} m are not finer than the survey's {} x {} m",
                    detail.cell_m, survey.cell_east_m, survey.cell_north_m));
  const double points = survey.columns * parts_east * (survey.rows * parts_north);
  if (!(points <= max_points))
    throw std::invalid_argument(
        fmt::format("survey detail: cells of {} m make {:.2g} points of the survey's {} x {}; use "
                    "larger cells, or cut a part out with gdal_translate -projwin",
                    detail.cell_m, points, survey.columns, survey.rows));
  Heightfield fine = interpolated(survey, std::max(1, static_cast<int>(parts_east)),
                                  std::max(1, static_cast<int>(parts_north)));
  FractalScale scale = fractal_scale(survey);
  scale.hurst = detail.hurst.value_or(scale.hurst);
  scale.height_at_1m_m = detail.height_at_1m_m.value_or(scale.height_at_1m_m);
  if (!(scale.hurst > 0.0 && scale.hurst < 1.0 && scale.height_at_1m_m >= 0.0))
    throw std::invalid_argument(fmt::format(
        "survey detail: a Hurst exponent of {} and a height of {} m at 1 m are not possible; "
        "expected an exponent between 0 and 1 and a height of at least 0 m",
        scale.hurst, scale.height_at_1m_m));
  if (scale.height_at_1m_m == 0.0) return fine;
  const Missing missing(scale, survey.cell_east_m, survey.cell_north_m);
  SpectralField what;
  what.amplitude = [&](double kx, double ky) { return missing.amplitude(kx, ky); };
  add_spectral_field(fine, what, RandomStream(seed, Purpose::survey_detail));
  return fine;
}

}  // namespace ensonify::engine
