#include <ensonify/engine/seafloor/bed/survey_detail.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/catmull_rom.h>
#include <ensonify/engine/seafloor/bed/detail_in_windows.h>
#include <ensonify/engine/seafloor/bed/height_blocks.h>
#include <ensonify/engine/seafloor/bed/spectral.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr double max_points = 268435456.0;  // 2^28
constexpr double max_points_across = 2147483647.0;

/// Interpolates between the middle two of four heights; extrapolates a missing outer one linearly.
double between(std::array<double, 4> p, double t) {
  if (t == 0.0) return p[1];
  if (std::isnan(p[0])) p[0] = 2.0 * p[1] - p[2];
  if (std::isnan(p[3])) p[3] = 2.0 * p[2] - p[1];
  const auto w = catmull_rom(t);
  return w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + w[3] * p[3];
}

/// The number of the finer grid's cells along a cell of the survey.
struct Parts {
  int east, north;
};

Parts parts_of(const Heightfield& survey, const SurveyDetail& detail) {
  const double east = std::round(survey.cell_east_m / detail.cell_m);
  const double north = std::round(survey.cell_north_m / detail.cell_m);
  if (!(detail.cell_m > 0.0 && std::max(east, north) >= 2.0))
    throw std::invalid_argument(
        fmt::format("survey detail: cells of {} m are not finer than the survey's {} x {} m",
                    detail.cell_m, survey.cell_east_m, survey.cell_north_m));
  const auto whole = [&](double parts, int points) {
    if (!((points - 1.0) * std::max(1.0, parts) < max_points_across))
      throw std::invalid_argument(fmt::format(
          "survey detail: cells of {} m make more points than there can be in a row; use larger "
          "cells, or cut a part out with gdal_translate -projwin",
          detail.cell_m));
    return std::max(1, static_cast<int>(parts));
  };
  return {whole(east, survey.columns), whole(north, survey.rows)};
}

/// The number of points of the finer grid along this number of the survey's points.
int points_along(int points, int parts) { return (points - 1) * parts + 1; }

/// Interpolates to a window of the finer grid. Points of the survey keep their heights. `coarse` is
/// the survey, or a window of it with two points on each side of every place in `window`.
void interpolate(const Heightfield& coarse, const Parts& parts, Heightfield& window) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const auto width = static_cast<std::size_t>(window.columns);
  // Fine to the east, coarse to the north.
  std::vector<double> lines(static_cast<std::size_t>(coarse.rows) * width);
  for (int row = 0; row < coarse.rows; ++row)
    for (int column = 0; column < window.columns; ++column) {
      const int in_all = window.first_column + column, left = in_all / parts.east;
      const auto at = [&](int c) {
        const int in_window = c - coarse.first_column;
        return in_window < 0 || in_window >= coarse.columns ? none : coarse.at(in_window, row);
      };
      lines[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] =
          between({at(left - 1), at(left), at(left + 1), at(left + 2)},
                  static_cast<double>(in_all % parts.east) / parts.east);
    }
  for (int row = 0; row < window.rows; ++row)
    for (int column = 0; column < window.columns; ++column) {
      const int in_all = window.first_row + row, below = in_all / parts.north;
      const auto at = [&](int r) {
        const int in_window = r - coarse.first_row;
        return in_window < 0 || in_window >= coarse.rows
                   ? none
                   : lines[static_cast<std::size_t>(in_window) * width +
                           static_cast<std::size_t>(column)];
      };
      window.at(column, row) = between({at(below - 1), at(below), at(below + 1), at(below + 2)},
                                       static_cast<double>(in_all % parts.north) / parts.north);
    }
}

/// The power that a sampled and interpolated field lacks, compared with a fractal field of spectrum
/// Phi. Sampling folds Phi into the band of the grid's wavenumbers. Interpolation repeats this band
/// outside, multiplied by the response T of the interpolation: the power at k is T^2 (Phi(k0) + the
/// rest), where k0 is the folded k, and the rest is what was folded onto k0 from outside the band.
/// The rest is an even function of k0 without poles, so it is stored in a table.
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
    double there = 0.0;  // 0 for k0 = 0: a wave sampled once per period adds only to the mean
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
double second_difference_m2(std::span<const Heightfield> parts, int lag, bool east) {
  double sum = 0.0, count = 0.0;
  const int dc = east ? lag : 0, dr = east ? 0 : lag;
  for (const Heightfield& field : parts)
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

/// The scale from the options; values that they leave unset are estimated from the survey.
FractalScale scale_of(std::span<const Heightfield> parts, const SurveyDetail& detail) {
  FractalScale scale = fractal_scale(parts);
  scale.hurst = detail.hurst.value_or(scale.hurst);
  scale.height_at_1m_m = detail.height_at_1m_m.value_or(scale.height_at_1m_m);
  if (!(scale.hurst > 0.0 && scale.hurst < 1.0 && scale.height_at_1m_m >= 0.0))
    throw std::invalid_argument(fmt::format(
        "survey detail: a Hurst exponent of {} and a height of {} m at 1 m are not possible; "
        "expected an exponent between 0 and 1 and a height of at least 0 m",
        scale.hurst, scale.height_at_1m_m));
  return scale;
}

/// The spectrum of the relief that interpolated heights lack.
SpectralField missing_field(const FractalScale& scale, const Heightfield& survey) {
  const auto missing =
      std::make_shared<const Missing>(scale, survey.cell_east_m, survey.cell_north_m);
  return {.amplitude = [missing](double kx, double ky) { return missing->amplitude(kx, ky); }};
}

}  // namespace

FractalScale fractal_scale(std::span<const Heightfield> parts) {
  if (parts.empty()) return {};
  const Heightfield& survey = parts.front();
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const bool east : {true, false})
    for (const int lag : {1, 2, 4}) {
      const double square = second_difference_m2(parts, lag, east);
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

Heightfield grid_with_detail(const Heightfield& survey, const SurveyDetail& detail) {
  const Parts parts = parts_of(survey, detail);
  Heightfield fine = survey;
  fine.z_m.clear();
  fine.columns = points_along(survey.columns, parts.east);
  fine.rows = points_along(survey.rows, parts.north);
  fine.cell_east_m = survey.cell_east_m / parts.east;
  fine.cell_north_m = survey.cell_north_m / parts.north;
  return fine;
}

Heightfield with_detail(const Heightfield& survey, const SurveyDetail& detail, std::uint64_t seed,
                        const WorkControl& control) {
  if (detail.cell_m == 0.0) return survey;
  Heightfield fine = grid_with_detail(survey, detail);
  const double points = fine.points();
  if (!(points <= max_points))
    throw std::invalid_argument(
        fmt::format("survey detail: cells of {} m make {:.2g} points of the survey's {} x {}; use "
                    "larger cells, or cut a part out with gdal_translate -projwin",
                    detail.cell_m, points, survey.columns, survey.rows));
  const FractalScale scale = scale_of({&survey, 1}, detail);
  fine.z_m.resize(static_cast<std::size_t>(points));
  interpolate(survey, parts_of(survey, detail), fine);
  if (scale.height_at_1m_m == 0.0) return fine;
  add_spectral_field(fine, missing_field(scale, survey), RandomStream(seed, Purpose::survey_detail),
                     control);
  return fine;
}

refine::HeightTiles::Heights with_detail_in_windows(const Heightfield& survey,
                                                    refine::HeightTiles::Heights heights,
                                                    std::span<const Heightfield> parts,
                                                    const SurveyDetail& detail,
                                                    std::uint64_t seed) {
  const FractalScale scale = scale_of(parts, detail);
  std::shared_ptr<FieldInWindows> relief;
  if (scale.height_at_1m_m > 0.0)
    relief = std::make_shared<FieldInWindows>(grid_with_detail(survey, detail),
                                              missing_field(scale, survey), seed,
                                              Purpose::survey_detail);
  const Heightfield size = survey.window(0, 0, survey.columns, survey.rows);
  return [size, divided = parts_of(survey, detail), heights = std::move(heights), relief](
             int first_column, int first_row, int columns, int rows, std::span<double> z_m,
             std::span<std::uint8_t>) {
    // The survey's points about the window.
    const auto around = [](int first, int count, int of, int points, int& from, int& number) {
      from = std::max(0, first / of - 1);
      number = std::min(points, (first + count - 1) / of + 3) - from;
    };
    Heightfield coarse = size;
    around(first_column, columns, divided.east, size.columns, coarse.first_column, coarse.columns);
    around(first_row, rows, divided.north, size.rows, coarse.first_row, coarse.rows);
    coarse.z_m.resize(static_cast<std::size_t>(coarse.points()));
    heights(coarse.first_column, coarse.first_row, coarse.columns, coarse.rows, coarse.z_m, {});
    Heightfield window{.columns = columns,
                       .rows = rows,
                       .z_m = std::vector<double>(z_m.size()),
                       .first_column = first_column,
                       .first_row = first_row};
    interpolate(coarse, divided, window);
    std::ranges::copy(window.z_m, z_m.begin());
    if (relief) relief->add(first_column, first_row, columns, rows, z_m);
  };
}

}  // namespace ensonify::engine
