#include <ensonify/engine/sonar/scatterers.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include <ensonify/engine/random.h>
#include <ensonify/engine/sonar/signal_kernel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr int frames = 12;  // directions of cells over half a turn
constexpr double rows_per_octave = 12.0;
constexpr double beam_reach = 0.8;   // nulls to either side, where sinc^4 has all but 0.2 %
constexpr double most_cells = 16.0;  // across the beam; half as many at least
constexpr int finest_level = 10;     // its cells are a 1024th of the array
constexpr double bin_share = 1.0;    // of a bin, how long a cell is
constexpr double rise = 0.25;  // metres of cells a metre of height, so that walls have some too

/// The field of a uniform line array of length 1 in its middle's units at range r: the mean of
/// exp(i k (y - a)^2 / 2 r) over it. Focused: of exp(i k (y^2 - 2 y a) / 2 r).
std::complex<double> one_way(double length_m, double wavelength_m, bool focused, double y_m,
                             double range_m) {
  const double x = length_m * y_m / (wavelength_m * range_m);
  const double quadratic = pi * y_m * y_m / (wavelength_m * range_m);
  const double fresnel = focused ? 0.0 : 0.5 * length_m * length_m / (wavelength_m * range_m);
  if (fresnel < 1e-3) {
    const double sinc = std::abs(x) < 1e-6 ? 1.0 : std::sin(pi * x) / (pi * x);
    return std::polar(sinc, quadratic);
  }
  const int steps = 32 + 2 * static_cast<int>(4.0 * (fresnel + std::abs(x)));
  std::complex<double> sum = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const double u = static_cast<double>(i) / steps - 0.5;
    const double weight = i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += std::polar(weight / (3.0 * steps), 2.0 * pi * (fresnel * u * u - x * u));
  }
  return sum * std::polar(1.0, quadratic);
}

}  // namespace

Scatterers::Scatterers(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                       double reference_heading_rad)
    : cell_m_(bin_share * sonar.bin_m()), reference_rad_(reference_heading_rad) {
  const double wavelength_m = sound_speed_mps / sonar.frequency_hz;
  turns_per_cell_ = 2.0 * cell_m_ / wavelength_m;
  columns_ = static_cast<std::uint32_t>((0.5 * most_cells * (sonar.side_lobes + 1) + 2.0) *
                                        columns_per_cell);
  // Nearer than an array's length nothing is seen but the array itself.
  const double nearest_m = 0.5 * (sonar.array_length_m + sonar.receive_length_m());
  int levels = 0;
  for (int bin = 0; bin < sonar.bins; ++bin) {
    const double range_m = std::max((bin + 0.5) * sonar.bin_m(), nearest_m);
    const auto row = static_cast<std::size_t>(rows_per_octave * std::log2(range_m / nearest_m));
    while (rows_.size() <= row) {
      const double middle = (static_cast<double>(rows_.size()) + 0.5) / rows_per_octave;
      rows_.push_back(make_row(sonar, wavelength_m, nearest_m * std::exp2(middle)));
      levels = std::max(levels, rows_.back().level + 1);
    }
    row_of_bin_.push_back(static_cast<std::uint16_t>(row));
  }
  rows_.push_back(make_row(  // for the widths beyond the last one's middle
      sonar, wavelength_m,
      nearest_m * std::exp2((static_cast<double>(rows_.size()) + 0.5) / rows_per_octave)));
  for (int bin = 0; bin < sonar.bins; ++bin) {  // between rows, linear in the range's logarithm
    const double range_m = std::max((bin + 0.5) * sonar.bin_m(), nearest_m);
    const double place = std::clamp(rows_per_octave * std::log2(range_m / nearest_m) - 0.5, 0.0,
                                    static_cast<double>(rows_.size() - 1));
    const auto row = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(row);
    const Row& next = rows_[std::min(row + 1, rows_.size() - 1)];
    width_of_bin_m_.push_back(rows_[row].width_m + share * (next.width_m - rows_[row].width_m));
  }
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    const double heading = reference_rad_ + static_cast<double>(frame) * pi / frames;
    Frame& made = frames_.emplace_back();
    made.along = {std::sin(heading), std::cos(heading)};
    made.across = {std::cos(heading), -std::sin(heading)};
    std::vector<double> random(static_cast<std::size_t>(levels));
    Stream(seed, Purpose::speckle, {std::bit_cast<std::uint64_t>(sonar.frequency_hz), frame, 0})
        .uniform(random);
    for (const double r : random) made.keys.push_back(static_cast<std::uint32_t>(r * 0x1p32 - 1.0));
  }
}

Scatterers::Row Scatterers::make_row(const Sonar& sonar, double wavelength_m, double range_m) {
  const double lengths[] = {sonar.array_length_m, sonar.receive_length_m()};
  double reach_m = 1e300;
  for (const double length_m : lengths)
    reach_m =
        std::min(reach_m, (sonar.focused ? 0.0 : 0.5 * length_m) +
                              (sonar.side_lobes + beam_reach) * wavelength_m * range_m / length_m);
  Row row;
  const double across = most_cells * (sonar.side_lobes + 1);
  const double shortest_m = lengths[0] * std::exp2(-finest_level);
  row.level =
      std::max(0, static_cast<int>(std::ceil(std::log2(2.0 * reach_m / across / shortest_m))));
  const double cell_m = shortest_m * std::exp2(row.level);
  row.cells_per_m = 1.0 / cell_m;
  row.reach = static_cast<float>(reach_m / cell_m);
  row.first_weight = static_cast<std::uint32_t>(weights_.size() / 2);
  row.width_m = 0.0;
  const double step_m = cell_m / columns_per_cell;
  const int columns = static_cast<int>(std::ceil(row.reach * columns_per_cell));
  for (int column = 0; column < columns; ++column) {
    const double y_m = (column + 0.5) * step_m;
    const std::complex<double> sent =
        one_way(lengths[0], wavelength_m, sonar.focused, y_m, range_m);
    const std::complex<double> weight =
        sent * (lengths[0] == lengths[1]
                    ? sent
                    : one_way(lengths[1], wavelength_m, sonar.focused, y_m, range_m));
    weights_.push_back(static_cast<float>(weight.real()));
    weights_.push_back(static_cast<float>(weight.imag()));
    row.width_m += 2.0 * step_m * std::norm(weight);
  }
  weights_.resize(2 * (row.first_weight + std::size_t{columns_}), 0.0f);
  return row;
}

double Scatterers::pattern(std::size_t bin, double along_m) const {
  const Row& row = rows_[row_of_bin_[bin]];
  const double cells = std::abs(along_m) * row.cells_per_m;
  if (cells >= row.reach) return 0.0;
  const auto power = [&](std::size_t column) {
    const float* weight = &weights_[2 * (row.first_weight + column)];
    return weight[0] * weight[0] + weight[1] * weight[1];
  };
  return power(static_cast<std::size_t>(cells * columns_per_cell)) / power(0);
}

void Scatterers::gather(const Listener& listener, const Layers& bins, int look, Memory& memory,
                        std::span<float> re, std::span<float> im) const {
  const std::size_t room = (re.size() + signal_group - 1) / signal_group * signal_group;
  for (auto* of_bin : {&memory.bin, &memory.across_cell, &memory.across_within, &memory.first_cell,
                       &memory.first_weight, &memory.key})
    of_bin->resize(room);
  for (auto* of_bin : {&memory.first_column, &memory.turns, &memory.re, &memory.im})
    of_bin->resize(room);
  memory.cells.assign(room / signal_group, 0);
  const std::size_t lit = place_cells(listener, bins, look, memory);
  std::fill(re.begin(), re.end(), 0.0f);
  std::fill(im.begin(), im.end(), 0.0f);
  sum_cells({.across_cell = memory.across_cell.data(),
             .across_within = memory.across_within.data(),
             .first_cell = memory.first_cell.data(),
             .first_column = memory.first_column.data(),
             .first_weight = memory.first_weight.data(),
             .key = memory.key.data(),
             .turns = memory.turns.data(),
             .cells = memory.cells.data(),
             .bins = (lit + signal_group - 1) / signal_group * signal_group,
             .weights = weights_.data(),
             .columns_per_cell = columns_per_cell,
             .last_column = columns_ - 1,
             .re = memory.re.data(),
             .im = memory.im.data()});
  for (std::size_t i = 0; i < lit; ++i) {
    re[memory.bin[i]] = memory.re[i];
    im[memory.bin[i]] = memory.im[i];
  }
}

/// Which cells each bin with an echo has; returns how many bins.
std::size_t Scatterers::place_cells(const Listener& listener, const Layers& bins, int look,
                                    Memory& memory) const {
  const Eigen::Vector2d level_axis = listener.axis.head<2>();
  const double heading = std::atan2(level_axis.x(), level_axis.y());
  const auto turned = std::lround((heading - reference_rad_) * frames / pi);
  const Frame& frame = frames_[static_cast<std::size_t>((turned % frames + frames) % frames)];
  const double along_axis = frame.along.dot(level_axis);
  const double per_axis = 1.0 / std::copysign(std::max(std::abs(along_axis), 1e-3), along_axis);
  const double across_origin = frame.across.dot(listener.origin.head<2>());
  const double cells_per_m = 1.0 / cell_m_;
  const std::uint32_t of_look = static_cast<std::uint32_t>(look) * 0x85157af5u;

  double across = 0.0, along = 0.0, side = 1.0, turns = 0.0;
  std::size_t lit = 0;
  for (std::size_t n = 0; n < bins.intensity_mean.size(); ++n) {
    if (!(bins.intensity_mean[n] > 0.0f)) continue;
    const Eigen::Vector3d place(bins.x_m[n], bins.y_m[n], bins.z_m[n]);
    if (!place.isZero(0.0)) {
      // Where the row of this bin crosses the beam's middle.
      across = frame.across.dot(place.head<2>());
      along =
          frame.along.dot(place.head<2>()) - per_axis * listener.axis.dot(place - listener.origin);
      side = across < across_origin ? -1.0 : 1.0;
      turns = -side * turns_per_cell_ * std::abs(across - across_origin) /
              std::max<double>(bins.range_m[n], 1e-3);
      across -= side * rise * place.z();
    } else {
      across += side * cell_m_;  // nothing but another bin's side lobe
    }
    const Row& row = rows_[row_of_bin_[n]];
    const double cell = across * cells_per_m, whole = std::floor(cell);
    const double middle = along * row.cells_per_m;
    const double first = std::floor(middle - row.reach);
    const auto cells = static_cast<std::uint32_t>(std::floor(middle + row.reach) - first) + 1;
    memory.bin[lit] = static_cast<std::uint32_t>(n);
    memory.across_cell[lit] = static_cast<std::uint32_t>(static_cast<std::int64_t>(whole));
    memory.across_within[lit] = static_cast<std::uint32_t>((cell - whole) * 0x1p32);
    memory.first_cell[lit] = static_cast<std::uint32_t>(static_cast<std::int64_t>(first));
    memory.first_column[lit] = static_cast<float>((first - middle) * columns_per_cell);
    memory.first_weight[lit] = row.first_weight;
    memory.key[lit] = frame.keys[static_cast<std::size_t>(row.level)] + of_look;
    memory.turns[lit] = static_cast<float>(turns);
    std::uint32_t& most = memory.cells[lit / signal_group];
    most = std::max(most, cells);
    ++lit;
  }
  // The rest of the last group is like its last bin.
  for (std::size_t i = lit; lit > 0 && i % signal_group != 0; ++i) {
    memory.first_weight[i] = memory.first_weight[lit - 1];
    memory.first_column[i] = 0.0f;
    memory.turns[i] = 0.0f;
  }
  return lit;
}

}  // namespace ensonify::engine
