#include <ensonify/engine/seafloor/bed/tiled_field.h>

#include <algorithm>
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

// Points by which the coarse grid extends beyond the bed's blocks on each side.
constexpr int coarse_margin = 12;

}  // namespace

TiledField::TiledField(const Heightfield& grid, SpectralField what, std::uint64_t seed,
                       Purpose purpose, double coarse_cells, std::uint64_t number)
    : cell_m_(grid.cell_east_m),
      what_(std::move(what)),
      seed_(seed),
      purpose_(purpose),
      number_(number) {
  if (grid.cell_north_m != grid.cell_east_m)
    throw std::invalid_argument("relief: tiles need square cells");
  what_ = calibrated(std::move(what_), grid);

  const double side_m =
      std::max({what_.period_m, 2.0 * grid.columns * cell_m_, 2.0 * grid.rows * cell_m_});
  while (std::pow(side_m / spacing_m(band_count_), 2) > coarse_cells) ++band_count_;
  // On the next five lattices the blocks have the same offset from a point; on coarser lattices the
  // offsets differ by up to one point.
  LatticeWindow window{0, 0, block_points, block_points};
  for (std::size_t band = 0; band < band_count_; ++band) {
    // One point more, because on a coarser lattice the number of points depends on the place.
    bands_.push_back(make_band(band, window.columns + 1));
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
  coarse_.z_m.assign(static_cast<std::size_t>(coarse_.points()), 0.0);
  const SpectralField rest{
      .amplitude = [this](double kx, double ky) { return amplitude(band_count_, kx, ky); },
      .period_m = what_.period_m};
  add_spectral_field(coarse_, rest,
                     RandomStream(seed_, purpose_, {band_count_ + 1, 0, 1 + 2 * number_}));
  take_mean_over(grid);
}

/// Subtracts the rest's mean over the grid from the rest; the coarse grid is larger than the grid.
void TiledField::take_mean_over(const Heightfield& grid) {
  const auto last = [&](int points) {
    return coarse_margin +
           static_cast<int>(std::lround((points - 1) * cell_m_ / coarse_.cell_east_m));
  };
  double sum_m = 0.0;
  int count = 0;
  for (int row = coarse_margin; row <= last(grid.rows); ++row)
    for (int column = coarse_margin; column <= last(grid.columns); ++column, ++count)
      sum_m += coarse_.at(column, row);
  for (double& z_m : coarse_.z_m) z_m -= sum_m / count;
}

double TiledField::spacing_m(std::size_t band) const {
  return cell_m_ * std::pow(double{band_ratio}, static_cast<double>(band));
}

/// The amplitude of the waves of a band; the number after the last band is the rest.
double TiledField::amplitude(std::size_t band, double kx, double ky) const {
  const double length_m = 2.0 * pi / std::hypot(kx, ky);
  double share = 1.0;
  if (band > 0) share = handed_over_share(length_m / spacing_m(band - 1));
  if (band < band_count_) share *= kept_share(length_m / spacing_m(band));
  return share == 0.0 ? 0.0 : share * what_.amplitude(kx, ky);
}

/// The band with its kernel, for windows of `points` points. White noise of variance 1 at points
/// with the spacing d has the power spectrum d^2 / (2 pi)^2, so the filter is amplitude * 2 pi / d.
TiledField::Band TiledField::make_band(std::size_t number, int points) const {
  constexpr double max_lost = 1e-4, max_lost_at_last = 1e-2;
  constexpr int first_reach = 96, last_reach = 384;
  const double d = spacing_m(number);
  for (int reach = first_reach;; reach *= 2) {
    const int length = fast_length(10.0 * reach);
    const GridTransform wide(length, length, GridTransform::Ways::backward);
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
        GridTransform(fast_length(points + 2 * reach), fast_length(points + 2 * reach),
                      GridTransform::Ways::both),
        {}};
    // The kernel fades out from half of its reach on.
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
    if (lost <= (reach < last_reach ? max_lost : max_lost_at_last) * all) {
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
  const std::vector<double> block =
      waves(0, {std::int64_t{column} * block_points, std::int64_t{row} * block_points, block_points,
                block_points});
  for (std::size_t i = 0; i < block.size(); ++i) z_m[i] += block[i];
}

/// The heights of a band and of all longer waves, at points of the band's lattice.
std::vector<double> TiledField::waves(std::size_t band, const LatticeWindow& window) const {
  if (band == band_count_) {
    const auto columns = static_cast<std::size_t>(window.columns);
    const auto rows = static_cast<std::size_t>(window.rows);
    std::vector<double> heights(columns * rows);
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t column = 0; column < columns; ++column)
        heights[row * columns + column] =
            coarse_.at(static_cast<int>(window.column) + coarse_margin + static_cast<int>(column),
                       static_cast<int>(window.row) + coarse_margin + static_cast<int>(row));
    return heights;
  }
  std::vector<double> heights = waves_of(band, window);
  add_interpolated(waves(band + 1, window.coarser()), window, heights);
  return heights;
}

/// The heights of one band. The convolution is cyclic, but only values in the margin, which are not
/// used, have contributions from the other side.
std::vector<double> TiledField::waves_of(std::size_t number, const LatticeWindow& window) const {
  const Band& band = bands_[number];
  const auto length = static_cast<std::size_t>(band.transform.columns());
  const std::size_t stride = band.transform.stride();
  const GridTransform::Values values = band.transform.allocate();
  // Numbers of the random stream count from far west, so that they are positive.
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

  const auto columns = static_cast<std::size_t>(window.columns);
  const auto rows = static_cast<std::size_t>(window.rows);
  const auto margin = static_cast<std::size_t>(band.reach);
  std::vector<double> heights(columns * rows);
  for (std::size_t row = 0; row < rows; ++row)
    std::copy_n(values.get() + (row + margin) * stride + margin, columns,
                heights.data() + row * columns);
  return heights;
}

}  // namespace ensonify::engine
