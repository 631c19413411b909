#include <ensonify/engine/seafloor/bed/spectral.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/grid_transform.h>
#include <ensonify/engine/seafloor/bed/wave_bands.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr double max_cells = 536870912.0;  // 2^29: 4 GiB

struct Size {
  int columns, rows;
  double cells() const { return static_cast<double>(columns) * rows; }
};

/// The cells of a period, east and north.
struct Lengths {
  double columns, rows;
};
Lengths lengths_of(const Heightfield& field, const SpectralField& what) {
  const auto along = [&](int points, double cell_m) {
    const double length = std::max(2.0 * points, what.period_m / cell_m);
    return what.reach_m > 0.0 ? std::min(length, points + what.reach_m / cell_m) : length;
  };
  return {along(field.columns, field.cell_east_m), along(field.rows, field.cell_north_m)};
}

/// The size of the transform with the period of the field.
Size size_of(const Heightfield& field, const SpectralField& what) {
  const auto [columns, rows] = lengths_of(field, what);
  return {fast_length(columns), fast_length(rows)};
}

/// The size of the transform for short waves. Over the margin, the correlation of the waves that
/// kept_share() keeps falls below 5e-4.
Size size_of_short_waves(const Heightfield& field, const SpectralField& what) {
  const auto along = [&](int points, double cell_m) {
    constexpr double min_margin = 96.0;
    return fast_length(points + std::max(min_margin, std::ceil(what.regular_m / cell_m)));
  };
  return {along(field.columns, field.cell_east_m), along(field.rows, field.cell_north_m)};
}

/// Whether making long waves on a coarser lattice saves time and memory.
bool has_bands(const Heightfield& field, const SpectralField& what) {
  return size_of(field, what).cells() > 2.0 * size_of_short_waves(field, what).cells();
}

LatticeWindow window_of(const Heightfield& field) { return {0, 0, field.columns, field.rows}; }

/// The coarser lattice from which the field's points are interpolated, without heights.
Heightfield coarser_lattice(const Heightfield& field) {
  const LatticeWindow window = window_of(field).coarser();
  return {.columns = window.columns,
          .rows = window.rows,
          .cell_east_m = band_ratio * field.cell_east_m,
          .cell_north_m = band_ratio * field.cell_north_m};
}

double points_per_wave(const Heightfield& field, double kx, double ky) {
  const double x = kx * field.cell_east_m, y = ky * field.cell_north_m;
  return 2.0 * pi / std::sqrt(x * x + y * y);
}

std::size_t count(int number) { return static_cast<std::size_t>(number); }

/// The heights at the field's points, row by row, for a field with the period of a transform. The
/// white noise begins at number `first` of the random stream.
GridTransform::Values one_transform(const Heightfield& field, const Size& size,
                                    const SpectralField& what, const RandomStream& noise,
                                    std::uint64_t first, const WorkControl& control) {
  const int columns = size.columns, rows = size.rows;
  const GridTransform transform(rows, columns, GridTransform::Ways::backward);
  const std::size_t stride = transform.stride(), terms = stride / 2;
  GridTransform::Values values = transform.allocate();
  double* const heights = values.get();
  auto* const spectrum = reinterpret_cast<std::complex<double>*>(heights);

  // FFTW's inverse transform sums the terms, so the mean power of a term must be amplitude^2 dkx
  // dky. A term is a complex number; each of its two parts is normal with half of this power.
  const double dkx = 2.0 * pi / (columns * field.cell_east_m);
  const double dky = 2.0 * pi / (rows * field.cell_north_m);
  const double to_part = std::sqrt(0.5 * dkx * dky);
  double calibration = 0.0;  // the integral of weight * amplitude^2
  const auto fill_row = [&](int row, std::vector<double>& amplitudes) {
    const double ky = dky * signed_frequency(row, rows);
    std::size_t used = 0;  // the terms up to the last one that has power
    for (int column = 0; column <= columns / 2; ++column) {
      const double kx = dkx * column;
      double& amplitude = amplitudes[count(column)];
      amplitude = row == 0 && column == 0 ? 0.0 : what.amplitude(kx, ky);
      if (amplitude == 0.0) continue;
      used = count(column) + 1;
      if (!what.weight) continue;
      const int partners = column == 0 || column == columns / 2 ? 1 : 2;  // k and -k
      calibration += partners * what.weight(kx, ky) * amplitude * amplitude * dkx * dky;
    }
    double* const parts = heights + count(row) * stride;
    noise.normal(std::span(parts, 2 * used), first + count(row) * stride);
    for (std::size_t i = 0; i < used; ++i)
      spectrum[count(row) * terms + i] *= to_part * amplitudes[i];
    std::fill(parts + 2 * used, parts + stride, 0.0);
  };
  // A weight needs one thread: the sum for the calibration depends on the order of its terms.
  refine::for_parts(count(rows), what.weight ? 1 : control.threads,
                    [&](std::size_t first_row, std::size_t end_row) {
                      std::vector<double> amplitudes(terms);
                      for (std::size_t row = first_row; row < end_row; ++row) {
                        control.check_stop();
                        fill_row(static_cast<int>(row), amplitudes);
                      }
                    });
  // The terms of a real field at k and -k are conjugate. Both are stored if kx is 0 or Nyquist's.
  for (const std::size_t column : {std::size_t{0}, terms - 1})
    for (std::size_t row = 0; row <= count(rows) / 2; ++row) {
      const std::complex<double> term = spectrum[row * terms + column];
      const std::size_t partner = (count(rows) - row) % count(rows);
      spectrum[partner * terms + column] =
          partner == row ? std::numbers::sqrt2 * term.real() : std::conj(term);
    }
  control.check_stop();
  transform.backward(heights);
  control.check_stop();

  const double scale = what.weight ? std::sqrt(what.calibrated_m2 / calibration) : 1.0;
  for (std::size_t row = 0; row < count(field.rows); ++row)
    for (std::size_t column = 0; column < count(field.columns); ++column)
      heights[row * count(field.columns) + column] = scale * heights[row * stride + column];
  return values;
}

/// The heights at the field's points, row by row: one transform, or a transform of the short waves
/// plus the long waves, interpolated from a coarser lattice. `level` counts lattices.
GridTransform::Values make_waves(const Heightfield& field, const SpectralField& what,
                                 const RandomStream& noise, const WorkControl& control,
                                 int level = 0) {
  // The numbers of a level do not overlap those of another, as no transform has 2^40 of them.
  const std::uint64_t first = static_cast<std::uint64_t>(level) << 40;
  if (!has_bands(field, what))
    return one_transform(field, size_of(field, what), what, noise, first, control);

  SpectralField longer = level == 0 ? calibrated(what, field) : what;
  SpectralField shorter = longer;
  longer.amplitude = [&field, amplitude = shorter.amplitude](double kx, double ky) {
    const double share = handed_over_share(points_per_wave(field, kx, ky));
    return share == 0.0 ? 0.0 : share * amplitude(kx, ky);
  };
  shorter.amplitude = [&field, amplitude = shorter.amplitude](double kx, double ky) {
    const double share = kept_share(points_per_wave(field, kx, ky));
    return share == 0.0 ? 0.0 : share * amplitude(kx, ky);
  };
  const Heightfield coarser = coarser_lattice(field);
  const GridTransform::Values long_waves = make_waves(coarser, longer, noise, control, level + 1);
  GridTransform::Values values =
      one_transform(field, size_of_short_waves(field, what), shorter, noise, first, control);
  const auto points = [](const Heightfield& of) { return count(of.columns) * count(of.rows); };
  add_interpolated({long_waves.get(), points(coarser)}, window_of(field),
                   {values.get(), points(field)});
  return values;
}

}  // namespace

void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise,
                        const WorkControl& control) {
  if (!fits_one_transform(field, what)) {
    const Size size = size_of(field, what);
    throw std::invalid_argument(
        fmt::format("relief: it needs a field of {} x {} cells, {:.0f} GB; use larger cells, {}",
                    size.columns, size.rows, 8e-9 * size.cells(),
                    what.regular_m > 0.0 ? "or shorter or less regular waves"
                                         : "or a smaller extent (the longer side counts)"));
  }
  const GridTransform::Values values = make_waves(field, what, noise, control);
  double mean_m = 0.0;
  for (std::size_t i = 0; i < field.z_m.size(); ++i) mean_m += values.get()[i];
  mean_m /= static_cast<double>(field.z_m.size());
  for (std::size_t i = 0; i < field.z_m.size(); ++i) field.z_m[i] += values.get()[i] - mean_m;
}

SpectralField calibrated(SpectralField what, const Heightfield& field) {
  if (!what.weight) return what;
  // Not a structured binding: the compiler of the fuzz targets, Clang 14, cannot capture one.
  const Lengths lengths = lengths_of(field, what);
  const double columns = lengths.columns, rows = lengths.rows;
  const double dkx = 2.0 * pi / (columns * field.cell_east_m);
  const double dky = 2.0 * pi / (rows * field.cell_north_m);
  double sum = 0.0;
  // Adds a square of wavenumbers; x, y and side are in steps of the transform's wavenumbers.
  const auto take = [&](double x, double y, double side) {
    if (2.0 * std::abs(x) > columns || 2.0 * std::abs(y) > rows || (x == 0.0 && y == 0.0)) return;
    const double amplitude = what.amplitude(x * dkx, y * dky);
    sum += what.weight(x * dkx, y * dky) * amplitude * amplitude * side * side * dkx * dky;
  };
  constexpr int longest = 64;
  constexpr int cells = 2 * longest + 1;  // from the inner to the outer border of a ring
  for (int row = -longest; row <= longest; ++row)
    for (int column = -longest; column <= longest; ++column) take(column, row, 1.0);
  // Rings whose outer wavenumber is twice the inner; their cells grow with the wavenumber.
  for (double inner = longest + 0.5; 2.0 * inner < std::max(columns, rows); inner *= 2.0) {
    const double side = inner / cells;
    for (int row = -2 * cells; row < 2 * cells; ++row)
      for (int column = -2 * cells; column < 2 * cells; ++column) {
        const double x = (column + 0.5) * side, y = (row + 0.5) * side;
        if (std::max(std::abs(x), std::abs(y)) > inner) take(x, y, side);
      }
  }
  const double scale = std::sqrt(what.calibrated_m2 / sum);
  what.amplitude = [scale, amplitude = std::move(what.amplitude)](double kx, double ky) {
    return scale * amplitude(kx, ky);
  };
  what.weight = nullptr;
  return what;
}

bool fits_one_transform(const Heightfield& field, const SpectralField& what) {
  return size_of(field, what).cells() <= max_cells;
}

double spectral_field_bytes(const Heightfield& field, const SpectralField& what) {
  const auto bytes_of = [](const Size& size) {
    return sizeof(double) * (size.columns + 2.0) * size.rows;
  };
  if (!has_bands(field, what)) return bytes_of(size_of(field, what));
  // The heights of the long waves take at most the memory of the transform that makes them.
  const Heightfield coarser = coarser_lattice(field);
  const double between = sizeof(double) * static_cast<double>(field.columns) * coarser.rows;
  return spectral_field_bytes(coarser, what) + bytes_of(size_of_short_waves(field, what)) + between;
}

}  // namespace ensonify::engine
