#include <ensonify/engine/seafloor/bed/tiled_field.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr int ratio = 4;  // from lattice to lattice
constexpr int taps = 12;  // of the interpolation from one to the next
constexpr int taps_before = taps / 2 - 1;

// A band hands over to the next coarser one between 48 and 16 of its points per wave. Those 16 are
// 4 points of the coarser lattice, which can be interpolated well.
constexpr double shortest_handed_over = 16.0, longest_kept = 48.0;

// Spacing, in points, at which the coarse grid may lie beyond the bed's last block.
constexpr int coarse_margin = 12;

/// From 0 to 1 with three continuous derivatives.
double smooth_step(double t) {
  const double u = std::clamp(t, 0.0, 1.0);
  return u * u * u * u * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u * u * u);
}

/// The share of a wave that the next, coarser band has, by the number of points per wave: 0 for
/// short waves, 1 for long ones.
double handed_over(double points_per_wave) {
  return smooth_step(std::log(points_per_wave / shortest_handed_over) /
                     std::log(longest_kept / shortest_handed_over));
}

/// Modified Bessel function of order 0, by its series.
double bessel_i0(double x) {
  double term = 1.0, sum = 1.0;
  for (int k = 1; k < 40; ++k) {
    term *= 0.25 * x * x / (static_cast<double>(k) * k);
    sum += term;
  }
  return sum;
}

/// Weights of the points around a place that lies `phase` quarters behind a point of the coarser
/// lattice: a sinc in Kaiser's window. It keeps waves of 4 points and more, and suppresses their
/// images at 4/3 points.
std::array<double, taps> interpolation(int phase) {
  constexpr double beta = 8.0;
  std::array<double, taps> weights{};
  double sum = 0.0;
  for (int i = 0; i < taps; ++i) {
    const double t = i - taps_before - static_cast<double>(phase) / ratio;
    const double u = t / (0.5 * taps);
    const double sinc = t == 0.0 ? 1.0 : std::sin(pi * t) / (pi * t);
    const double window = u * u < 1.0 ? bessel_i0(beta * std::sqrt(1.0 - u * u)) : 0.0;
    weights[static_cast<std::size_t>(i)] = sinc * window;
    sum += sinc * window;
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return (a - (a % b + b) % b) / b; }

/// The integral of weight * amplitude^2 over the wavenumbers of a single transform of this period:
/// the sum over its longest waves, then over rings of twice the wavenumber in cells that grow with
/// it.
double calibration_of(const SpectralField& what, const Heightfield& grid) {
  const double columns = std::max(2.0 * grid.columns, what.period_m / grid.cell_east_m);
  const double rows = std::max(2.0 * grid.rows, what.period_m / grid.cell_north_m);
  const double dkx = 2.0 * pi / (columns * grid.cell_east_m);
  const double dky = 2.0 * pi / (rows * grid.cell_north_m);
  double sum = 0.0;
  // A square of wavenumbers, in steps of the transform's.
  const auto take = [&](double x, double y, double side) {
    if (2.0 * std::abs(x) > columns || 2.0 * std::abs(y) > rows || (x == 0.0 && y == 0.0)) return;
    const double amplitude = what.amplitude(x * dkx, y * dky);
    sum += what.weight(x * dkx, y * dky) * amplitude * amplitude * side * side * dkx * dky;
  };
  constexpr int longest = 64;
  constexpr int cells = 2 * longest + 1;  // from the inner to the outer border of a ring
  for (int row = -longest; row <= longest; ++row)
    for (int column = -longest; column <= longest; ++column) take(column, row, 1.0);
  for (double inner = longest + 0.5; 2.0 * inner < std::max(columns, rows); inner *= 2.0) {
    const double side = inner / cells;
    for (int row = -2 * cells; row < 2 * cells; ++row)
      for (int column = -2 * cells; column < 2 * cells; ++column) {
        const double x = (column + 0.5) * side, y = (row + 0.5) * side;
        if (std::max(std::abs(x), std::abs(y)) > inner) take(x, y, side);
      }
  }
  return sum;
}

}  // namespace

TiledField::Window TiledField::Window::coarser() const {
  const auto first = [](std::int64_t place) { return floor_div(place, ratio) - taps_before; };
  const auto end = [&](std::int64_t place) {
    return floor_div(place + points - 1, ratio) + taps / 2 + 1;
  };
  // One more where it depends on the place.
  const auto most = static_cast<int>(std::max(end(column) - first(column), end(row) - first(row)));
  return {first(column), first(row), most};
}

TiledField::~TiledField() = default;

TiledField::TiledField(const Heightfield& grid, SpectralField what, std::uint64_t seed,
                       Purpose purpose, double coarse_cells, std::uint64_t number)
    : cell_m_(grid.cell_east_m),
      what_(std::move(what)),
      seed_(seed),
      purpose_(purpose),
      number_(number) {
  if (grid.cell_north_m != grid.cell_east_m)
    throw std::invalid_argument("relief: tiles need square cells");
  if (what_.weight) calibrate_ = std::sqrt(what_.calibrated_m2 / calibration_of(what_, grid));

  const double side_m =
      std::max({what_.period_m, 2.0 * grid.columns * cell_m_, 2.0 * grid.rows * cell_m_});
  while (std::pow(side_m / spacing_m(band_count_), 2) > coarse_cells) ++band_count_;
  // All blocks have the same place on the next five lattices, and within a point on others.
  Window window{0, 0, block_points};
  for (std::size_t band = 0; band < band_count_; ++band) {
    bands_.push_back(make_band(band, window.points + 1));
    window = window.coarser();
  }

  const auto points_of = [&](int points) {
    const double blocks = std::ceil(static_cast<double>(points) / block_points);
    return static_cast<int>(std::ceil(blocks * block_points * cell_m_ / spacing_m(band_count_))) +
           2 * coarse_margin;
  };
  coarse_.columns = points_of(grid.columns);
  coarse_.rows = points_of(grid.rows);
  coarse_.cell_east_m = coarse_.cell_north_m = spacing_m(band_count_);
  coarse_.z_m.assign(
      static_cast<std::size_t>(coarse_.columns) * static_cast<std::size_t>(coarse_.rows), 0.0);
  SpectralField rest;
  rest.amplitude = [this](double kx, double ky) { return amplitude(band_count_, kx, ky); };
  rest.period_m = what_.period_m;
  add_spectral_field(coarse_, rest,
                     RandomStream(seed_, purpose_, {band_count_ + 1, 0, 1 + 2 * number_}));
}

double TiledField::spacing_m(std::size_t band) const {
  return cell_m_ * std::pow(static_cast<double>(ratio), static_cast<double>(band));
}

/// Of the waves that belong to a band, or, after the last one, to the rest.
double TiledField::amplitude(std::size_t band, double kx, double ky) const {
  const double length_m = 2.0 * pi / std::hypot(kx, ky);
  double share = 1.0;
  if (band > 0) share = std::sin(0.5 * pi * handed_over(length_m / spacing_m(band - 1)));
  if (band < band_count_) share *= std::cos(0.5 * pi * handed_over(length_m / spacing_m(band)));
  return share == 0.0 ? 0.0 : share * calibrate_ * what_.amplitude(kx, ky);
}

/// The band with its kernel, for windows of `points` points. White noise of variance 1 at points
/// with the spacing d has the power spectrum d^2 / (2 pi)^2, so the filter is amplitude * 2 pi / d.
TiledField::Band TiledField::make_band(std::size_t number, int points) const {
  constexpr double most_lost = 1e-4, most_lost_at_last = 1e-2;
  constexpr int first_reach = 96, last_reach = 384;
  const double d = spacing_m(number);
  for (int reach = first_reach;; reach *= 2) {
    const int length = fast_length(10.0 * reach);
    const GridTransform wide(length, length);
    const GridTransform::Values values = wide.allocate();
    auto* const spectrum = reinterpret_cast<std::complex<double>*>(values.get());
    const double dk = 2.0 * pi / (length * d);
    for (int row = 0; row < length; ++row)
      for (int column = 0; column <= length / 2; ++column) {
        const double kx = dk * column, ky = dk * signed_frequency(row, length);
        spectrum[static_cast<std::size_t>(row) * (wide.stride() / 2) +
                 static_cast<std::size_t>(column)] =
            row == 0 && column == 0 ? 0.0 : amplitude(number, kx, ky) * 2.0 * pi / d;
      }
    wide.backward(values.get());

    const double per_point = 1.0 / (static_cast<double>(length) * length);
    const int across = 2 * reach + 1;
    Band band{
        reach,
        std::vector<double>(static_cast<std::size_t>(across) * static_cast<std::size_t>(across)),
        GridTransform(fast_length(points + 2 * reach), fast_length(points + 2 * reach)),
        {}};
    // It fades out from half its reach on.
    const auto fading = [&](int place) {
      return 1.0 - smooth_step(2.0 * std::abs(place) / static_cast<double>(reach) - 1.0);
    };
    double all = 0.0, lost = 0.0;
    for (int row = 0; row < length; ++row)
      for (int column = 0; column < length; ++column) {
        const int y = row <= length / 2 ? row : row - length;
        const int x = column <= length / 2 ? column : column - length;
        const double value =
            per_point * values.get()[static_cast<std::size_t>(row) * wide.stride() +
                                     static_cast<std::size_t>(column)];
        all += value * value;
        if (std::abs(x) > reach || std::abs(y) > reach) {
          lost += value * value;
          continue;
        }
        const double kept = value * fading(x) * fading(y);
        lost += (value - kept) * (value - kept);
        band.kernel[static_cast<std::size_t>(y + reach) * static_cast<std::size_t>(across) +
                    static_cast<std::size_t>(x + reach)] = kept;
      }
    if (lost <= (reach < last_reach ? most_lost : most_lost_at_last) * all) {
      fill_filter(band);
      return band;
    }
    if (reach == last_reach)
      throw std::invalid_argument(
          "relief: its waves are too regular to be made in tiles; use a larger "
          "ripples.relative_width, or a bed that fits one transform");
  }
}

void TiledField::fill_filter(Band& band) {
  const GridTransform& transform = band.transform;
  const int length = transform.columns(), across = 2 * band.reach + 1;
  const GridTransform::Values values = transform.allocate();
  std::fill_n(values.get(), transform.stride() * static_cast<std::size_t>(length), 0.0);
  for (int y = -band.reach; y <= band.reach; ++y)
    for (int x = -band.reach; x <= band.reach; ++x)
      values.get()[static_cast<std::size_t>((y + length) % length) * transform.stride() +
                   static_cast<std::size_t>((x + length) % length)] =
          band.kernel[static_cast<std::size_t>(y + band.reach) * static_cast<std::size_t>(across) +
                      static_cast<std::size_t>(x + band.reach)];
  transform.forward(values.get());
  const std::size_t terms = transform.stride() / 2 * static_cast<std::size_t>(length);
  const double scale = 1.0 / (static_cast<double>(length) * length);
  band.filter.resize(terms);
  // The kernel is even, so its transform is real.
  for (std::size_t i = 0; i < terms; ++i) band.filter[i] = scale * values.get()[2 * i];
  band.kernel.clear();
  band.kernel.shrink_to_fit();
}

void TiledField::add_block(int column, int row, std::vector<double>& z_m) const {
  const std::vector<double> block = waves(
      0, {std::int64_t{column} * block_points, std::int64_t{row} * block_points, block_points});
  for (std::size_t i = 0; i < block.size(); ++i) z_m[i] += block[i];
}

/// The heights of a band and of all longer waves, at points of the band's lattice.
std::vector<double> TiledField::waves(std::size_t band, const Window& window) const {
  const auto points = static_cast<std::size_t>(window.points);
  if (band == band_count_) {
    std::vector<double> heights(points * points);
    for (std::size_t row = 0; row < points; ++row)
      for (std::size_t column = 0; column < points; ++column)
        heights[row * points + column] =
            coarse_.at(static_cast<int>(window.column) + coarse_margin + static_cast<int>(column),
                       static_cast<int>(window.row) + coarse_margin + static_cast<int>(row));
    return heights;
  }
  std::vector<double> heights = waves_of(band, window);

  // What is longer, from the coarser lattice: first along the rows, then across them.
  const Window wide = window.coarser();
  const std::vector<double> longer = waves(band + 1, wide);
  const auto wide_points = static_cast<std::size_t>(wide.points);
  std::array<std::array<double, taps>, ratio> weights;
  for (int phase = 0; phase < ratio; ++phase)
    weights[static_cast<std::size_t>(phase)] = interpolation(phase);
  const auto place_of = [](std::int64_t place, std::int64_t first) {
    const std::int64_t before = floor_div(place, ratio);
    return std::pair(static_cast<std::size_t>(before - taps_before - first),
                     static_cast<std::size_t>(place - before * ratio));
  };
  std::vector<double> along(wide_points * points);
  for (std::size_t column = 0; column < points; ++column) {
    const auto [first, phase] =
        place_of(window.column + static_cast<std::int64_t>(column), wide.column);
    for (std::size_t row = 0; row < wide_points; ++row) {
      double sum = 0.0;
      for (std::size_t i = 0; i < taps; ++i)
        sum += weights[phase][i] * longer[row * wide_points + first + i];
      along[row * points + column] = sum;
    }
  }
  for (std::size_t row = 0; row < points; ++row) {
    const auto [first, phase] = place_of(window.row + static_cast<std::int64_t>(row), wide.row);
    double* const to = heights.data() + row * points;
    for (std::size_t i = 0; i < taps; ++i) {
      const double weight = weights[phase][i];
      const double* const from = along.data() + (first + i) * points;
      for (std::size_t column = 0; column < points; ++column) to[column] += weight * from[column];
    }
  }
  return heights;
}

/// The heights of one band. The transform goes round, and what comes round stays in the margin.
std::vector<double> TiledField::waves_of(std::size_t number, const Window& window) const {
  const Band& band = bands_[number];
  const auto length = static_cast<std::size_t>(band.transform.columns());
  const std::size_t stride = band.transform.stride();
  const GridTransform::Values values = band.transform.allocate();
  // Columns are numbered from far west, so that all numbers are positive, and in pairs.
  constexpr std::int64_t far_west = std::int64_t{1} << 40;
  for (std::size_t row = 0; row < length; ++row) {
    const std::int64_t lattice_row = window.row - band.reach + static_cast<std::int64_t>(row);
    RandomStream(seed_, purpose_,
                 {number + 1, static_cast<std::uint64_t>(lattice_row), 2 * number_})
        .normal(std::span(values.get() + row * stride, length),
                static_cast<std::uint64_t>(window.column - band.reach + far_west));
  }
  band.transform.forward(values.get());
  auto* const spectrum = reinterpret_cast<std::complex<double>*>(values.get());
  for (std::size_t i = 0; i < band.filter.size(); ++i) spectrum[i] *= band.filter[i];
  band.transform.backward(values.get());

  const auto points = static_cast<std::size_t>(window.points);
  const auto margin = static_cast<std::size_t>(band.reach);
  std::vector<double> heights(points * points);
  for (std::size_t row = 0; row < points; ++row)
    std::copy_n(values.get() + (row + margin) * stride + margin, points,
                heights.data() + row * points);
  return heights;
}

}  // namespace ensonify::engine
