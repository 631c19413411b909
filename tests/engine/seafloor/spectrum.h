#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <fftw3.h>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::tests {

inline engine::Heightfield flat(int columns, int rows, double dx, double dy) {
  engine::Heightfield field;
  field.columns = columns;
  field.rows = rows;
  field.cell_east_m = dx;
  field.cell_north_m = dy;
  field.z_m.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0);
  return field;
}

/// Mean power spectrum of fields. Each is tapered with a Hann window: a field does not wrap, so its
/// borders would leak over the whole spectrum.
class Spectrum {
 public:
  Spectrum(int columns, int rows, double dx, double dy)
      : columns_(columns),
        rows_(rows),
        dx_(dx),
        dy_(dy),
        power_(static_cast<std::size_t>(rows) * width()) {}

  void add(const engine::Heightfield& field) {
    double mean = 0.0;
    for (const double z : field.z_m) mean += z / static_cast<double>(field.z_m.size());
    const auto window = [](int i, int n) {
      return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / n);
    };
    std::vector<double> heights(field.z_m.size());
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        heights[field.index(column, row)] =
            (field.at(column, row) - mean) * window(column, columns_) * window(row, rows_);
    fftw_complex* spectrum = fftw_alloc_complex(power_.size());
    const fftw_plan plan =
        fftw_plan_dft_r2c_2d(rows_, columns_, heights.data(), spectrum, FFTW_ESTIMATE);
    fftw_execute(plan);
    fftw_destroy_plan(plan);
    for (std::size_t i = 0; i < power_.size(); ++i)
      power_[i] += spectrum[i][0] * spectrum[i][0] + spectrum[i][1] * spectrum[i][1];
    fftw_free(spectrum);
  }

  /// Calls visit(kx, ky, power) for every wave with kx >= 0 except the mean.
  template <class Visit>
  void each(Visit visit) const {
    for (int row = 0; row < rows_; ++row)
      for (std::size_t column = 0; column < width(); ++column)
        if (row != 0 || column != 0)
          visit(2.0 * std::numbers::pi / (columns_ * dx_) * static_cast<double>(column),
                2.0 * std::numbers::pi / (rows_ * dy_) * (row <= rows_ / 2 ? row : row - rows_),
                power_[static_cast<std::size_t>(row) * width() + column]);
  }

  /// Slope of log(power) over log(k) between two numbers of waves per side; every octave has the
  /// same weight.
  double radial_slope(int from, int to) const {
    const double step = 2.0 * std::numbers::pi / (columns_ * dx_);
    constexpr int bins = 24;
    std::vector<double> sum(bins), count(bins), log_k(bins);
    each([&](double kx, double ky, double power) {
      const double waves = std::hypot(kx, ky) / step;
      if (waves < from || waves >= to) return;
      const auto bin = static_cast<std::size_t>(bins * std::log(waves / from) /
                                                std::log(static_cast<double>(to) / from));
      sum[bin] += power;
      log_k[bin] += std::log(waves);
      count[bin] += 1.0;
    });
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t bin = 0; bin < bins; ++bin) {
      if (count[bin] == 0.0) continue;
      const double a = log_k[bin] / count[bin], b = std::log(sum[bin] / count[bin]);
      n += 1;
      x += a;
      y += b;
      xx += a * a;
      xy += a * b;
    }
    return (n * xy - x * y) / (n * xx - x * x);
  }

 private:
  std::size_t width() const { return static_cast<std::size_t>(columns_ / 2 + 1); }
  int columns_, rows_;
  double dx_, dy_;
  std::vector<double> power_;
};

}  // namespace ensonify::tests
