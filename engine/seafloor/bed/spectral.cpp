#include <ensonify/engine/seafloor/bed/spectral.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <numbers>
#include <span>
#include <stdexcept>

#include <fftw3.h>
#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr double max_cells = 536870912.0;  // 2^29: 4 GiB

struct Free {
  void operator()(double* data) const { fftw_free(data); }
};

// Only fftw_execute may run in two threads at once.
std::mutex& planner() {
  static std::mutex mutex;
  return mutex;
}

class Plan {
 public:
  template <class MakePlan>
  explicit Plan(MakePlan make_plan) {
    const std::lock_guard lock(planner());
    plan_ = make_plan();
    if (!plan_) throw std::bad_alloc();
  }
  ~Plan() {
    const std::lock_guard lock(planner());
    fftw_destroy_plan(plan_);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;
  void execute() const { fftw_execute(plan_); }

 private:
  fftw_plan plan_ = nullptr;
};

// The next 2^a 3^b 5^c with a >= 1: FFTW is fast at these lengths, and they have a Nyquist term.
int fast_length(double at_least) {
  if (!(at_least <= 0.5 * std::numeric_limits<int>::max()))
    throw std::invalid_argument(fmt::format(
        "relief: {:.3g} cells in a row are too many to synthesise; use larger cells or a smaller "
        "extent",
        at_least));
  for (int length = 2 * static_cast<int>(std::ceil(0.5 * at_least));; length += 2) {
    int rest = length;
    for (const int prime : {2, 3, 5})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return length;
  }
}

struct Size {
  int columns, rows;
};
Size size_of(const Heightfield& field, double period_m) {
  return {fast_length(std::max(2.0 * field.columns, period_m / field.cell_east_m)),
          fast_length(std::max(2.0 * field.rows, period_m / field.cell_north_m))};
}

double signed_frequency(int index, int length) {
  return index <= length / 2 ? index : index - length;
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
  const std::size_t stride = 2 * (width / 2 + 1);  // in place: room for a row of complex numbers
  const std::unique_ptr<double, Free> values(
      fftw_alloc_real(stride * static_cast<std::size_t>(rows)));
  if (!values) throw std::bad_alloc();
  double* const heights = values.get();
  auto* const spectrum = reinterpret_cast<fftw_complex*>(heights);
  const Plan forward(
      [&] { return fftw_plan_dft_r2c_2d(rows, columns, heights, spectrum, FFTW_ESTIMATE); });
  const Plan backward(
      [&] { return fftw_plan_dft_c2r_2d(rows, columns, spectrum, heights, FFTW_ESTIMATE); });

  // The noise is made in space, so that its transform has the symmetry of a real field.
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row)
    noise.normal(std::span(heights + row * stride, width), row * width);
  forward.execute();

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
      fftw_complex& term =
          spectrum[static_cast<std::size_t>(row) * (stride / 2) + static_cast<std::size_t>(column)];
      if (row == 0 && column == 0) {
        term[0] = term[1] = 0.0;
        continue;
      }
      const double kx = dkx * column;
      const double ky = dky * signed_frequency(row, rows);
      const double amplitude = what.amplitude(kx, ky);
      if (what.weight) {
        const int partners = column == 0 || column == columns / 2 ? 1 : 2;  // k and -k
        calibration += partners * what.weight(kx, ky) * amplitude * amplitude * dkx * dky;
      }
      for (double& part : term) part *= amplitude * to_filter;
    }
  backward.execute();

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

double fractal_period_m(const Heightfield& field, double hurst) {
  return (hurst > 0.7 ? 4.0 : 2.0) *
         std::max(field.columns * field.cell_east_m, field.rows * field.cell_north_m);
}

double spectral_field_bytes(const Heightfield& field, double period_m) {
  const auto [columns, rows] = size_of(field, period_m);
  return sizeof(double) * (columns + 2.0) * rows;
}

}  // namespace ensonify::engine
