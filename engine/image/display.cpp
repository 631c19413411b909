#include <ensonify/engine/image/display.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include <Eigen/Core>

#include <ensonify/engine/image/picture_columns.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t equalised_pixels = 500'000;     // more would not change the histogram
constexpr std::size_t normalised_pixels = 4'000'000;  // more would not change the medians
constexpr std::size_t depressions = 180;              // half degrees, from level to nadir

/// The greatest value of a channel.
double full_of(int bits) { return bits == 16 ? 65535.0 : 255.0; }

}  // namespace

/// The levels of a waterfall, normalised as the display asks.
class Levels {
 public:
  Levels(const Renderer& renderer, const Waterfall& waterfall)
      : renderer_(renderer),
        waterfall_(waterfall),
        layout_(renderer.layout_),
        columns_(waterfall.columns()),
        height_m_(heights_m(waterfall)) {
    if (renderer.display_.beam_normalisation)
      beam_ = inverse_medians(
          layout_.sectors() * depressions,
          [&](std::size_t row, std::size_t column) { return beam_cell(row, column); });
    if (renderer.display_.flat_field)
      column_ = inverse_medians(columns_, [](std::size_t, std::size_t column) { return column; });
  }
  /// The levels of other rows of the sonar, with the factors of `normalised`.
  Levels(const Levels& normalised, const Waterfall& waterfall)
      : renderer_(normalised.renderer_),
        waterfall_(waterfall),
        layout_(normalised.layout_),
        columns_(normalised.columns_),
        height_m_(heights_m(waterfall)),
        beam_(normalised.beam_),
        column_(normalised.column_) {}

  /// The level of a pixel; 1 is mid-brightness. A normalisation makes the bed's median 1 and does
  /// not change the water column.
  double at(std::size_t row, std::size_t column) const {
    double level = renderer_.level(waterfall_, row, column);
    if (beam_.empty() && column_.empty()) return level;
    if (region(row * columns_ + column) == Region::water_column) return level;
    if (!beam_.empty()) level *= beam_[beam_cell(row, column)];
    if (!column_.empty()) level *= column_[column];
    return level;
  }
  bool seabed(std::size_t pixel) const {
    return region(pixel) == Region::seabed || region(pixel) == Region::object;
  }

 private:
  static std::vector<double> heights_m(const Waterfall& waterfall) {
    std::vector<double> by_row;
    for (std::size_t row = 0; row < waterfall.rows(); ++row)
      by_row.push_back(height_over_bed_m(waterfall, row));
    return by_row;
  }
  Region region(std::size_t pixel) const {
    return static_cast<Region>(waterfall_.pixels.region[pixel]);
  }
  std::size_t beam_cell(std::size_t row, std::size_t column) const {
    const auto [sector, bin] = layout_.place(column);
    const double r = (static_cast<double>(bin) + 0.5) * waterfall_.sonar.bin_m();
    const double depression = std::asin(std::min(1.0, height_m_[row] / r));
    const auto cell =
        static_cast<std::size_t>(depression * 2.0 / std::numbers::pi * (depressions - 1));
    return sector * depressions + cell;
  }
  /// The inverse of the median level of the bed in each cell; 1 for a cell without bed. Single
  /// strong echoes do not change a median. With very many pixels only every n-th row is used.
  template <class Cell>
  std::vector<double> inverse_medians(std::size_t cells, Cell&& cell) const {
    std::vector<std::vector<float>> levels(cells);
    const std::size_t step = 1 + waterfall_.rows() * columns_ / normalised_pixels;
    for (std::size_t row = 0; row < waterfall_.rows(); row += step)
      for (std::size_t column = 0; column < columns_; ++column)
        if (region(row * columns_ + column) == Region::seabed)
          levels[cell(row, column)].push_back(static_cast<float>(at(row, column)));
    std::vector<double> inverse(cells, 1.0);
    for (std::size_t i = 0; i < cells; ++i) {
      if (levels[i].empty()) continue;
      const auto middle = levels[i].begin() + std::ssize(levels[i]) / 2;
      std::ranges::nth_element(levels[i], middle);
      if (*middle > 0.0f) inverse[i] = 1.0 / static_cast<double>(*middle);
    }
    return inverse;
  }

  const Renderer& renderer_;
  const Waterfall& waterfall_;
  LineLayout layout_;
  std::size_t columns_;
  std::vector<double> height_m_;  // of the sonar over the bed, by row
  std::vector<double> beam_;      // by sector and depression
  std::vector<double> column_;    // by column
};

namespace {

/// The levels of pixels with seabed or an object, ascending; of very many only every n-th.
std::vector<float> seabed_levels(const Waterfall& waterfall, const Levels& levels) {
  const std::size_t pixels = waterfall.rows() * waterfall.columns();
  const std::size_t step = 1 + pixels / equalised_pixels;
  std::vector<float> values;
  values.reserve(pixels / step + 1);
  for (std::size_t i = 0; i < pixels; i += step)
    if (levels.seabed(i))
      values.push_back(
          static_cast<float>(levels.at(i / waterfall.columns(), i % waterfall.columns())));
  std::ranges::sort(values);
  return values;
}

// Polynomials fitted to matplotlib's colour map viridis (van der Walt and Smith).
std::array<double, 3> viridis(double t) {
  constexpr std::array<std::array<double, 3>, 7> terms{
      {{0.2777273272234177, 0.005407344544966578, 0.3340998053353061},
       {0.1050930431085774, 1.404613529898575, 1.384590162594685},
       {-0.3308618287255563, 0.214847559468213, 0.09509516302823659},
       {-4.634230498983486, -5.799100973351585, -19.33244095627987},
       {6.228269936347081, 14.17993336680509, 56.69055260068105},
       {4.776384997670288, -13.74514537774601, -65.35303263337234},
       {-5.435455855934631, 4.645852612178535, 26.3124352495832}}};
  std::array<double, 3> colour{};
  for (std::size_t i = terms.size(); i-- > 0;)
    for (std::size_t k = 0; k < 3; ++k) colour[k] = colour[k] * t + terms[i][k];
  for (double& channel : colour) channel = std::clamp(channel, 0.0, 1.0);
  return colour;
}

/// How many pixels a Gaussian reaches on each side: three standard deviations.
double reach_px(double sigma_px) { return std::ceil(3.0 * sigma_px); }

/// A Gaussian's weights at 0, 1, 2 ... pixels from the middle, as far as it reaches. The weights of
/// both sides and of the middle sum to 1.
std::vector<float> gaussian(double sigma_px) {
  if (sigma_px == 0.0) return {1.0f};
  std::vector<float> weights;
  float sum = 0.0f;
  for (double at = 0.0; at <= reach_px(sigma_px); at += 1.0) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * at * at / (sigma_px * sigma_px))));
    sum += (at > 0.0 ? 2.0f : 1.0f) * weights.back();
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

using Row = Eigen::Array<float, 1, Eigen::Dynamic>;

/// The sum of at(k) and at(-k) over k, each with the factor weights[k].
template <class At>
Row weighted_sum(std::span<const float> weights, At&& at) {
  Row sum = weights[0] * at(0);
  for (Eigen::Index k = 1; k < std::ssize(weights); ++k)
    sum += weights[static_cast<std::size_t>(k)] * (at(-k) + at(k));
  return sum;
}

/// The level that a column of the picture shows. level(column) is of a column of the waterfall.
template <class Level>
double level_of(ShownColumns shown, ColumnValue value, Level&& level) {
  switch (value) {
    case ColumnValue::mean: break;
    case ColumnValue::peak: return greatest_over(shown, level);
    case ColumnValue::middle: return shown.from < shown.until ? level(shown.middle()) : 0.0;
  }
  // The mean is of amplitudes, not of brightnesses. Amplitudes above white are not cut off first,
  // so that a thin strong echo stays bright.
  const double mean =
      mean_over(shown, [&](std::size_t column) { return std::sqrt(level(column)); });
  return mean * mean;
}

double sigma_along_track_px(const Display& display) {
  return std::hypot(display.smoothing_px, display.track_smoothing_px);
}

/// Smooths a grey picture by a Gaussian. Beyond its border the outermost pixels are repeated.
void smooth(Picture& grey, double track_sigma_px, double range_sigma_px) {
  const std::vector<float> over_rows = gaussian(track_sigma_px),
                           over_columns = gaussian(range_sigma_px);
  const Eigen::Index rows = static_cast<Eigen::Index>(grey.height),
                     columns = static_cast<Eigen::Index>(grey.width),
                     reach = std::ssize(over_rows) - 1, side = std::ssize(over_columns) - 1;
  // The rows that the sum of a row needs, before smoothing.
  std::vector<Row> near(2 * over_rows.size() - 1);
  const auto values = [&](Eigen::Index row) -> Row& {
    return near[static_cast<std::size_t>(row) % near.size()];
  };
  // Plain loops, because compilers vectorise them.
  const auto load = [&](Eigen::Index row) {
    Row& cells = values(row);
    cells.resize(columns);
    const std::uint8_t* from =
        &grey.pixels[static_cast<std::size_t>(row * columns * grey.bits / 8)];
    if (grey.bits == 8)
      for (Eigen::Index i = 0; i < columns; ++i) cells[i] = static_cast<float>(from[i]);
    else
      for (Eigen::Index i = 0; i < columns; ++i)
        cells[i] = static_cast<float>(from[2 * i] << 8 | from[2 * i + 1]);
  };
  for (Eigen::Index row = 0; row < std::min(reach, rows); ++row) load(row);
  Row beyond(columns + 2 * side);
  std::uint8_t* to = grey.pixels.data();
  for (Eigen::Index row = 0; row < rows; ++row) {
    if (row + reach < rows) load(row + reach);
    beyond.segment(side, columns) = weighted_sum(over_rows, [&](Eigen::Index k) -> const Row& {
      return values(std::clamp<Eigen::Index>(row + k, 0, rows - 1));
    });
    beyond.head(side) = beyond[side];
    beyond.tail(side) = beyond[side + columns - 1];
    const Eigen::Array<int, 1, Eigen::Dynamic> steps =
        (weighted_sum(over_columns,
                      [&](Eigen::Index k) { return beyond.segment(side + k, columns); }) +
         0.5f)
            .cast<int>();
    if (grey.bits == 8) {
      for (Eigen::Index i = 0; i < columns; ++i) to[i] = static_cast<std::uint8_t>(steps[i]);
    } else {
      for (Eigen::Index i = 0; i < columns; ++i) {
        to[2 * i] = static_cast<std::uint8_t>(steps[i] >> 8);
        to[2 * i + 1] = static_cast<std::uint8_t>(steps[i] & 0xff);
      }
    }
    to += columns * grey.bits / 8;
  }
}

/// Finds the step of brightness of a level by a table. step_of(level) must not decrease with the
/// level. The table has 256 cells per octave of the level, and one cell for all levels below the
/// first octave. A cell is filled when it is used first.
template <class StepOf>
class StepTable {
 public:
  explicit StepTable(const StepOf& step_of) : step_of_(step_of), cells_(cells) {}
  std::size_t at(double level) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(static_cast<float>(level));
    const std::uint32_t number = std::max(bits >> dropped_bits, below) - below;
    if (number >= cells) return step_of_(level);
    Cell& cell = cells_[number];
    if (cell.step == unknown) cell = filled(number);
    if (cell.step == several) return step_of_(level);
    return cell.step + (level >= cell.next_from ? 1 : 0);
  }

 private:
  struct Cell {
    std::uint32_t step = unknown;  ///< the lowest step in the cell
    double next_from = 0.0;        ///< the level at which the next step begins
  };

  /// Searches from one end of a cell to the other, and a little beyond both ends, because at()
  /// rounds a level to a float to find its cell.
  Cell filled(std::uint32_t number) const {
    const auto begin = [](std::uint32_t of) {
      return of == 0 ? 0.0 : double{std::bit_cast<float>((below + of) << dropped_bits)};
    };
    double low = begin(number) * (1.0 - 1e-6), high = begin(number + 1) * (1.0 + 1e-6);
    const std::size_t step = step_of_(low), last = step_of_(high);
    if (last > step + 1) return {several};
    Cell cell{static_cast<std::uint32_t>(step), std::numeric_limits<double>::infinity()};
    if (last == step) return cell;
    for (double middle = std::midpoint(low, high); low < middle && middle < high;
         middle = std::midpoint(low, high))
      (step_of_(middle) == step ? low : high) = middle;
    cell.next_from = high;
    return cell;
  }

  static constexpr int dropped_bits = 23 - 8;
  static constexpr std::uint32_t unknown = ~0u, several = ~0u - 1;
  static constexpr std::uint32_t below = ((127 - 28) << 8) - 1;  // the cell below the level 2^-28
  static constexpr std::uint32_t cells = (36 << 8) + 1;          // up to the level 2^8
  const StepOf& step_of_;
  std::vector<Cell> cells_;
};

}  // namespace

std::size_t smoothed_rows(const Display& display) {
  return static_cast<std::size_t>(reach_px(sigma_along_track_px(display)));
}

std::array<double, 3> colour_of(Palette palette, double brightness) {
  const double dark = 1.0 - brightness;
  switch (palette) {
    case Palette::grey: break;
    // From black through orange-brown to pale yellow: red rises first, blue last.
    case Palette::copper:
      return {1.0 - dark * dark, 0.95 * std::pow(brightness, 1.3),
              0.72 * std::pow(brightness, 3.0)};
    case Palette::bronze:
      return {std::pow(brightness, 0.8), std::pow(brightness, 1.1), std::pow(brightness, 1.9)};
    case Palette::paper: return {dark, dark, dark};
    case Palette::viridis: return viridis(brightness);
  }
  return {brightness, brightness, brightness};
}

Renderer::Renderer(const Sonar& sonar, const Display& display, const Calibration& calibration)
    : sonar_(sonar),
      display_(display),
      recorder_(display.of == DisplayedLayer::sample ? calibration.recorder : nullptr),
      layout_(sonar),
      columns_(layout_.columns()),
      row_spacing_m_(calibration.row_spacing_m) {
  if (calibration.level_bed.size() != columns_ ||
      (!calibration.automatic_gain.empty() && calibration.automatic_gain.size() != columns_))
    throw std::invalid_argument("Renderer: the level bed's columns are not the sonar's");
  if (recorder_)
    for (std::uint32_t i = 0; recorder_->full_scale() <= 0xffff && i <= recorder_->full_scale();
         ++i)
      amplitudes_.push_back(static_cast<float>(recorder_->amplitude(i)));
  std::vector<double> bed;  // the level bed's median level in each column
  for (std::size_t column = 0; column < columns_; ++column) {
    const std::size_t bin = layout_.place(column).bin;
    const double r = std::max(static_cast<double>(bin) + 0.5, 1.0) * sonar.bin_m();
    double gain_db = display.spreading * std::log10(r);
    if (display.absorption) gain_db += 2.0 * calibration.absorption_db_per_m * r;
    gains_.push_back(scatter::from_db(gain_db));
    const double median = calibration.level_bed[column] * calibration.median_share;
    std::uint32_t sample = 0;
    if (recorder_) {
      const double recorder_gain = recorder_->gain(bin);
      gains_.back() /= recorder_gain * recorder_gain;
      const double automatic =
          calibration.automatic_gain.empty() ? 1.0 : calibration.automatic_gain[column];
      sample = recorder_->sample(static_cast<float>(std::sqrt(median) * recorder_gain * automatic));
    }
    bed.push_back(level(column, median, sample));
  }
  // Sets scale_ so that the median of the columns whose bed has more than this intensity becomes 1.
  // An imaging sonar has the bed in its narrow vertical beam in a part of the columns only, so there
  // three of four columns have less.
  const auto scale_to = [&](double least) {
    std::vector<double> some;
    for (std::size_t column = 0; column < columns_; ++column)
      if (calibration.level_bed[column] > least) some.push_back(bed[column]);
    if (some.empty()) return false;
    const std::size_t middle = sonar_.steers() ? 3 * some.size() / 4 : some.size() / 2;
    std::ranges::nth_element(some, some.begin() + static_cast<std::ptrdiff_t>(middle));
    // The median is 0 if the bed is below the recorder's smallest sample. Full scale is then shown
    // at mid-brightness.
    const double median = some[middle];
    scale_ = median > 0.0 ? 1.0 / median : 1.0 / *std::ranges::max_element(gains_);
    return true;
  };
  if (!scale_to(0.0)) throw std::invalid_argument("Renderer: the level bed has no echo");
  if (!(calibration.noise > 0.0)) return;
  // The gain is limited where the noise would be brighter than the bed's median. In this case only
  // columns whose bed is 3 dB above the noise count for the bed's median.
  const auto max_gain = [&](std::size_t column) {
    const double recorder_gain =
        recorder_ ? double{recorder_->gain(layout_.place(column).bin)} : 1.0;
    return 1.0 / (scale_ * calibration.noise * recorder_gain * recorder_gain);
  };
  std::size_t column = 0;
  while (column < columns_ && gains_[column] <= max_gain(column)) ++column;
  if (column == columns_) return;
  scale_to(2.0 * calibration.noise);
  for (column = 0; column < columns_; ++column)
    gains_[column] = std::min(gains_[column], max_gain(column));
}

double Renderer::level(std::size_t column, double intensity, std::uint32_t sample) const {
  if (!recorder_) return intensity * gains_[column] * scale_;
  const double amplitude =
      sample < amplitudes_.size() ? amplitudes_[sample] : recorder_->amplitude(sample);
  return amplitude * amplitude * gains_[column] * scale_;
}

double Renderer::level(const Waterfall& waterfall, std::size_t row, std::size_t column) const {
  const std::size_t pixel = row * columns_ + column;
  return level(column, waterfall.pixels.intensity[pixel], waterfall.pixels.sample[pixel]);
}

void Renderer::levels(const Waterfall& waterfall, std::size_t row, std::span<float> into) const {
  for (std::size_t column = 0; column < columns_; ++column)
    into[column] = static_cast<float>(level(waterfall, row, column));
}

Picture Renderer::render(const Waterfall& waterfall, int bits,
                         const NeighbourRows* neighbours) const {
  const auto is_of_sonar = [&](const Waterfall& rows) { return rows.columns() == columns_; };
  if (!is_of_sonar(waterfall) ||
      (neighbours && !(is_of_sonar(neighbours->before) && is_of_sonar(neighbours->after))))
    throw std::invalid_argument("Renderer: the waterfall is of another sonar");
  const Levels levels(*this, waterfall);
  const Display& display = display_;
  const std::vector<float> sorted = display.mapping == Mapping::equalised
                                        ? seabed_levels(waterfall, levels)
                                        : std::vector<float>();
  const double amplitude_gain = mid_amplitude * scatter::from_db(0.5 * display.gain_db);
  const double scale = amplitude_gain * amplitude_gain;
  // Brightness of a level: 0 to 1, not yet clamped.
  const auto brightness = [&](double level) {
    switch (display.mapping) {
      case Mapping::gamma: break;
      case Mapping::logarithmic:
        return level > 0.0 ? 0.5 + (scatter::to_db(level) + display.gain_db) / display.range_db
                           : 0.0;
      case Mapping::equalised: {
        const auto above = std::ranges::lower_bound(sorted, static_cast<float>(level));
        return static_cast<double>(above - sorted.begin()) /
               static_cast<double>(std::max<std::size_t>(sorted.size(), 1));
      }
    }
    return std::pow(level * scale, 0.5 * display.gamma);
  };

  const double full = full_of(bits);
  const auto step_of = [&](double level) {
    return static_cast<std::size_t>(std::lround(full * std::clamp(brightness(level), 0.0, 1.0)));
  };
  StepTable steps(step_of);
  const PictureColumns columns = picture_columns(sonar_, display, row_spacing_m_);
  const bool of_bins = columns == columns_of_bins(sonar_);
  const std::size_t width = columns.layout(sonar_).columns();
  const auto grey = [&](const Waterfall& of, const Levels& its_levels) {
    Picture picture{width, of.rows(), 1, {}, bits};
    picture.pixels.resize(of.rows() * width * (bits == 16 ? 2 : 1));
    std::uint8_t* pixel = picture.pixels.data();
    const auto show = [&](double level) {
      const std::size_t step = steps.at(level);
      if (bits == 16) *pixel++ = static_cast<std::uint8_t>(step >> 8);
      *pixel++ = static_cast<std::uint8_t>(step & 0xff);
    };
    for (std::size_t row = of.rows(); row-- > 0;)
      if (of_bins) {
        for (std::size_t column = 0; column < columns_; ++column) show(its_levels.at(row, column));
      } else {
        const auto level = [&](std::size_t column) { return its_levels.at(row, column); };
        for (const ShownColumns& shown : shown_columns(of, row, columns))
          show(level_of(shown, display.column_value, level));
      }
    return picture;
  };
  Picture picture = grey(waterfall, levels);
  if (smoothed_rows(display) > 0) {
    std::vector<std::uint8_t>& pixels = picture.pixels;
    const std::size_t bytes = pixels.size();
    std::ptrdiff_t bytes_above = 0;  // of the rows after the waterfall's, which are above it
    if (neighbours) {
      const Picture above = grey(neighbours->after, Levels(levels, neighbours->after)),
                    below = grey(neighbours->before, Levels(levels, neighbours->before));
      pixels.insert(pixels.begin(), above.pixels.begin(), above.pixels.end());
      pixels.insert(pixels.end(), below.pixels.begin(), below.pixels.end());
      picture.height += above.height + below.height;
      bytes_above = std::ssize(above.pixels);
    }
    smooth(picture, sigma_along_track_px(display), display.smoothing_px);
    pixels.erase(pixels.begin(), pixels.begin() + bytes_above);
    pixels.resize(bytes);
    picture.height = waterfall.rows();
  }
  return painted(std::move(picture), display.palette);
}

Picture painted(Picture grey, Palette palette) {
  if (palette == Palette::grey) return grey;
  const bool wide = grey.bits == 16, coloured = palette != Palette::paper;
  Picture picture{grey.width, grey.height, coloured ? 3 : 1, {}, grey.bits};
  const auto channels = static_cast<std::size_t>(picture.channels);
  const std::size_t pixel_bytes = channels * (wide ? 2 : 1);
  const double full = full_of(grey.bits);
  std::vector<std::uint8_t> colours;  // the bytes of a pixel for each brightness
  for (double step = 0.0; step <= full; step += 1.0) {
    const std::array<double, 3> colour = colour_of(palette, step / full);
    for (std::size_t k = 0; k < channels; ++k) {
      const auto value = static_cast<unsigned>(std::lround(full * colour[k]));
      if (wide) colours.push_back(static_cast<std::uint8_t>(value >> 8));
      colours.push_back(static_cast<std::uint8_t>(value & 0xff));
    }
  }
  picture.pixels.resize(grey.pixels.size() * channels);
  std::uint8_t* pixel = picture.pixels.data();
  for (auto from = grey.pixels.begin(); from != grey.pixels.end();) {
    std::size_t step = *from++;
    if (wide) step = step << 8 | *from++;
    for (std::size_t k = 0; k < pixel_bytes; ++k) *pixel++ = colours[step * pixel_bytes + k];
  }
  return picture;
}

Picture render(const Waterfall& waterfall, const Display& display, const Calibration& calibration,
               int bits, const NeighbourRows* neighbours) {
  return Renderer(waterfall.sonar, display, calibration).render(waterfall, bits, neighbours);
}

}  // namespace ensonify::engine
