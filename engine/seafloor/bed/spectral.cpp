#include <ensonify/engine/seafloor/bed/spectral.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/grid_transform.h>

namespace ensonify::engine {
namespace {

constexpr double max_cells = 536870912.0;  // 2^29: 4 GiB

struct Size {
  int columns, rows;
};
Size size_of(const Heightfield& field, double period_m) {
  return {fast_length(std::max(2.0 * field.columns, period_m / field.cell_east_m)),
          fast_length(std::max(2.0 * field.rows, period_m / field.cell_north_m))};
}

}  // namespace

void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise) {
  // Not a structured binding: the compiler of the fuzz targets, Clang 14, cannot capture one.
  const Size size = size_of(field, what.period_m);
  const int columns = size.columns;
  const int rows = size.rows;
  if (static_cast<double>(columns) * rows > max_cells)
    throw std::invalid_argument(fmt::format(
        "relief: it needs a field of {} x {} cells, {:.0f} GB; use larger cells or a smaller "
        "extent (the longer side counts)",
        columns, rows, 8e-9 * columns * rows));
  const auto width = static_cast<std::size_t>(columns);
  const std::size_t stride = 2 * (width / 2 + 1);  // room for a row of complex numbers
  const GridTransform transform(rows, columns);
  const GridTransform::Values values = transform.allocate();
  double* const heights = values.get();
  auto* const spectrum = reinterpret_cast<std::complex<double>*>(heights);

  // The noise is made in space, so that its transform has the symmetry of a real field.
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row)
    noise.normal(std::span(heights + row * stride, width), row * width);
  transform.forward(heights);

  // Each term of the transform of M white numbers has the power M, and FFTW's inverse lacks the
  // factor 1/M, so a filter f gives the variance sum(f^2)/M. This is the integral of amplitude^2
  // if f = amplitude * sqrt(M dkx dky), where M dkx dky = (2 pi)^2 / (dx dy).
  const double dkx = 2.0 * std::numbers::pi / (columns * field.cell_east_m);
  const double dky = 2.0 * std::numbers::pi / (rows * field.cell_north_m);
  const double cells = static_cast<double>(columns) * rows;
  const double root_area = std::sqrt(dkx * dky);
  const double to_filter = std::sqrt(cells) * root_area;
  double calibration = 0.0;  // the integral of weight * amplitude^2
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column <= columns / 2; ++column) {
      std::complex<double>& term =
          spectrum[static_cast<std::size_t>(row) * (stride / 2) + static_cast<std::size_t>(column)];
      if (row == 0 && column == 0) {
        term = 0.0;
        continue;
      }
      const double kx = dkx * column;
      const double ky = dky * signed_frequency(row, rows);
      const double amplitude = what.amplitude(kx, ky);
      if (what.weight) {
        const int partners = column == 0 || column == columns / 2 ? 1 : 2;  // k and -k
        calibration += partners * what.weight(kx, ky) * amplitude * amplitude * dkx * dky;
      }
      term *= amplitude * to_filter;
    }
  transform.backward(heights);

  const double calibrate = what.weight ? std::sqrt(what.calibrated_m2 / calibration) : 1.0;
  const double scale = calibrate / cells;
  const auto height_at = [&](int column, int row) {
    return scale *
           heights[static_cast<std::size_t>(row) * stride + static_cast<std::size_t>(column)];
  };
  double mean = 0.0;
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) mean += height_at(column, row);
  mean /= static_cast<double>(field.columns) * field.rows;
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column)
      field.at(column, row) += height_at(column, row) - mean;
}

bool fits_one_transform(const Heightfield& field, double period_m) {
  const Size size = size_of(field, period_m);
  return static_cast<double>(size.columns) * size.rows <= max_cells;
}

double fractal_period_m(const Heightfield& field, double hurst) {
  return (hurst > 0.7 ? 4.0 : 2.0) *
         std::max(field.columns * field.cell_east_m, field.rows * field.cell_north_m);
}

double spectral_field_bytes(const Heightfield& field, double period_m) {
  const auto [columns, rows] = size_of(field, period_m);
  return sizeof(double) * (columns + 2.0) * rows;
}

}  // namespace ensonify::engine
