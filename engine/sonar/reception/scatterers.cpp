#include <ensonify/engine/sonar/reception/scatterers.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/reception/signal_kernel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr int frames = 12;            // directions of cells over half a turn
constexpr int headings = 2 * frames;  // of which every second one is used
constexpr double rows_per_octave = 12.0;
constexpr double beam_reach = 0.8;       // to either side, in nulls: contains 99.8 % of sinc^4
constexpr double max_cells = 16.0;       // across the beam; at least half as many
constexpr double max_plane_cells = 4.0;  // across a plane; at least half as many
constexpr int finest_level = 10;         // the finest cells have a 1024th of the array's length
constexpr double bin_share = 1.0;        // length of a cell divided by the length of a bin
// Metres over cells per metre of height, so that walls have cells, too.
constexpr double rise = 0.25;
// Metres over patches per metre of height on objects, so that walls have as many patches as a level
// surface. Only a surface that falls by 38 degrees in this direction has a single patch along the
// fall.
const Eigen::Vector2d patches_rise{1.0, 0.8};

/// The complex field of a line array at a range r and a distance y along the array: the mean of
/// exp(i k (y - a)^2 / 2 r - i k a^2 / 2 z) over the array's points a with their weights, if the
/// array is focused at z.
std::complex<double> one_way(const LineArray& array, double y_m, double range_m, double defocus) {
  const double x = array.length_m * y_m / (array.wavelength_m * range_m);
  const double quadratic = pi * y_m * y_m / (array.wavelength_m * range_m);
  return array.shading.field(x, array.nearness(range_m, defocus)) * std::polar(1.0, quadratic);
}

/// The scatterers that an echo sums, one for each bin, with the squared weights of the pulse's
/// filter. If a bin is longer than the cell, there is one scatterer.
TexturedGround::RangeWeights scatterers_of_echo(const Sonar& sonar, double sound_speed_mps) {
  const SpeckleFilter filter = speckle_filter(sonar.pulse, sound_speed_mps, sonar.bin_m());
  TexturedGround::RangeWeights samples{.step_m = sonar.bin_m(), .weights = {}};
  if (filter.even)
    for (std::size_t i = filter.taps.size(); i-- > 1;)
      samples.weights.push_back(double(filter.taps[i]) * double(filter.taps[i]));
  for (const float tap : filter.taps) samples.weights.push_back(double(tap) * double(tap));
  return samples;
}

/// The pulse's intensity over range. The side lobes of a sweep beyond the eighth have 1 % of it.
TexturedGround::RangeWeights pulse_over_range(const Sonar& sonar, double sound_speed_mps) {
  constexpr double steps_per_cell = 16.0, farthest_cells = 8.0;
  const double cell_s = sonar.pulse.effective_length_s(), step_s = cell_s / steps_per_cell;
  const double begin_s = std::max(sonar.pulse.begin_s(), -farthest_cells * cell_s);
  const double end_s = std::min(sonar.pulse.end_s(), farthest_cells * cell_s);
  TexturedGround::RangeWeights pulse{.step_m = 0.5 * sound_speed_mps * step_s, .weights = {}};
  for (double t_s = begin_s + 0.5 * step_s; t_s < end_s; t_s += step_s)
    pulse.weights.push_back(sonar.pulse.intensity(t_s));
  return pulse;
}

/// The number of the direction of cells that is nearest to a heading or to the opposite heading.
long number_of_heading(double heading_rad) {
  const long turned = std::lround(heading_rad * headings / pi);
  return (turned % headings + headings) % headings;
}

}  // namespace

Scatterers::Scatterers(const Sonar& sonar, double sound_speed_mps, const TexturedGround& ground,
                       double reference_heading_rad)
    : cell_m_(bin_share * sonar.bin_m()),
      turns_per_cell_(2.0 * cell_m_ / (sound_speed_mps / sonar.frequency_hz)),
      nearest_m_(0.5 * (sonar.array_length_m + sonar.receive_length_m())),
      ground_(ground),
      odd_(number_of_heading(reference_heading_rad) % 2 != 0) {}

Scatterers::Scatterers(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                       double reference_heading_rad,
                       const std::vector<scatter::GroundTexture>& by_material, double farthest_m,
                       const std::function<void()>& stop_check)
    : Scatterers(sonar, sound_speed_mps,
                 TexturedGround(by_material, scatterers_of_echo(sonar, sound_speed_mps),
                                pulse_over_range(sonar, sound_speed_mps), seed),
                 reference_heading_rad) {
  const double wavelength_m = sound_speed_mps / sonar.frequency_hz;
  const LineArray arrays[] = {sonar.transmit_array(wavelength_m),
                              sonar.receive_array(wavelength_m)};
  columns_ = static_cast<std::uint32_t>((0.5 * max_cells * (sonar.side_lobes + 1) + 2.0) *
                                        columns_per_cell);
  add_rows_of_bins(sonar,
                   [&](double range_m) { return make_row(sonar, arrays, range_m, stop_check); });
  do {  // for the widths beyond the middle of the last bin's row
    rows_.push_back(make_row(sonar, arrays, middle_m(rows_.size()), stop_check));
  } while (middle_m(rows_.size() - 1) < farthest_m);
  for (int bin = 0; bin < sonar.bins; ++bin)
    width_of_bin_m_.push_back(width_m_at((bin + 0.5) * sonar.bin_m()));
  add_tables(sonar, seed, 1);
}

Scatterers Scatterers::of_planes(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                                 double reference_heading_rad,
                                 const std::vector<scatter::GroundTexture>& by_material,
                                 double sine_step, double least_cosine) {
  Scatterers made(sonar, sound_speed_mps,
                  TexturedGround(by_material, scatterers_of_echo(sonar, sound_speed_mps),
                                 pulse_over_range(sonar, sound_speed_mps), seed),
                  reference_heading_rad);
  made.columns_ = static_cast<std::uint32_t>((0.5 * max_plane_cells + 1.0) * columns_per_cell);
  const double shortest_m = sine_step * made.nearest_m_ / max_plane_cells;
  // Rather narrower than wider than the plane: planes that shared scatterers would be correlated,
  // and their sum too loud.
  const auto make = [&](double middle_m) {
    return made.make_plane_row(shortest_m,
                               sine_step * middle_m * std::exp2(-0.5 / rows_per_octave));
  };
  made.add_rows_of_bins(sonar, make);
  const auto tables = static_cast<std::size_t>(
      std::ceil(rows_per_octave * -std::log2(std::clamp(least_cosine, 0.01, 1.0))) + 1.0);
  for (std::size_t i = 1; i < tables; ++i)
    made.rows_.push_back(make(made.middle_m(made.rows_.size())));
  made.add_tables(sonar, seed, tables);
  return made;
}

std::size_t Scatterers::table_of(double cos_azimuth) const {
  const double steps = -rows_per_octave * std::log2(std::max(cos_azimuth, 1e-3));
  return std::min(static_cast<std::size_t>(std::max(steps, 0.0)), tables_.size() - 1);
}

void Scatterers::add_rows_of_bins(const Sonar& sonar,
                                  const std::function<Row(double range_m)>& make) {
  for (int bin = 0; bin < sonar.bins; ++bin) {
    const double range_m = std::max((bin + 0.5) * sonar.bin_m(), nearest_m_);
    const auto row = static_cast<std::size_t>(rows_per_octave * std::log2(range_m / nearest_m_));
    while (rows_.size() <= row) rows_.push_back(make(middle_m(rows_.size())));
    row_of_bin_.push_back(static_cast<std::uint16_t>(row));
  }
}

void Scatterers::add_tables(const Sonar& sonar, std::uint64_t seed, std::size_t count) {
  std::size_t levels = 0;
  for (std::size_t i = 0; i < row_of_bin_.back() + count; ++i)
    levels = std::max(levels, static_cast<std::size_t>(rows_[i].level) + 1);
  // 32-bit keys; the sum of a level's and a frame's key is used.
  const auto keys = [&](std::uint64_t number, std::size_t key_count) {
    std::vector<double> random(key_count);
    RandomStream(seed, Purpose::speckle,
                 {std::bit_cast<std::uint64_t>(sonar.frequency_hz), number, 0})
        .uniform(random);
    std::vector<std::uint32_t> made;
    for (const double r : random) made.push_back(static_cast<std::uint32_t>(r * 0x1p32 - 1.0));
    return made;
  };
  const std::vector<std::uint32_t> of_heading = keys(0, headings), of_level = keys(1, levels);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double heading = (2.0 * static_cast<double>(frame) + (odd_ ? 1.0 : 0.0)) * pi / headings;
    frames_.push_back({.along = {std::sin(heading), std::cos(heading)},
                       .across = {std::cos(heading), -std::sin(heading)},
                       .key = of_heading[odd_ ? frames + frame : frame]});
  }
  for (std::size_t i = 0; i < count; ++i) {
    Table& table = tables_.emplace_back();
    for (std::size_t bin = 0; bin < whole_groups(row_of_bin_.size()); ++bin) {
      const Row& row = rows_[row_of_bin_[std::min(bin, row_of_bin_.size() - 1)] + i];
      table.cells_per_m.push_back(static_cast<float>(row.cells_per_m));
      table.cell_rows.push_back(TexturedGround::rows_of(1.0 / row.cells_per_m));
      table.reach.push_back(row.reach);
      table.first_weight.push_back(row.first_weight);
      table.key.push_back(of_level[static_cast<std::size_t>(row.level)]);
    }
  }
}

/// A row without weights, whose cells are 2^level times as long as the shortest.
Scatterers::Row Scatterers::begin_row(double shortest_m, int level, double reach_m) const {
  const double cell_m = shortest_m * std::exp2(level);
  return {.cells_per_m = 1.0 / cell_m,
          .reach = static_cast<float>(reach_m / cell_m),
          .level = level,
          .width_m = 0.0,
          .first_weight = static_cast<std::uint32_t>(weights_.size() / 2)};
}

Scatterers::Row Scatterers::make_row(const Sonar& sonar, std::span<const LineArray, 2> arrays,
                                     double range_m, const std::function<void()>& stop_check) {
  const std::array defocus{sonar.transmit_defocus(range_m), sonar.defocus(range_m)};
  const bool same = arrays[0] == arrays[1] && defocus[0] == defocus[1];
  double reach_m = 1e300;
  for (const std::size_t i : {0u, 1u}) {
    const LineArray& array = arrays[i];
    const Shading& shading = array.shading;
    // A shaded array has the main lobe of a shorter array without shading.
    const double widening = shading.beam_width_x() / Shading().beam_width_x();
    const double inner = shading.null_x(sonar.side_lobes);
    const double lobes = sonar.side_lobes == 0
                             ? beam_reach * widening
                             : inner + beam_reach * (shading.null_x(sonar.side_lobes + 1) - inner);
    reach_m = std::min(reach_m, array.half_width_m(lobes, range_m, defocus[i], widening));
  }
  const double across = max_cells * (sonar.side_lobes + 1);
  const double shortest_m = arrays[0].length_m * std::exp2(-finest_level);
  Row row = begin_row(
      shortest_m,
      std::max(0, static_cast<int>(std::ceil(std::log2(2.0 * reach_m / across / shortest_m)))),
      reach_m);
  const double step_m = shortest_m * std::exp2(row.level) / columns_per_cell;
  const int columns = static_cast<int>(std::ceil(row.reach * columns_per_cell));
  for (int column = 0; column < columns; ++column) {
    if (stop_check) stop_check();  // a column takes long far inside the near field of a long array
    const double y_m = (column + 0.5) * step_m;
    const std::complex<double> sent = one_way(arrays[0], y_m, range_m, defocus[0]);
    const std::complex<double> weight =
        sent * (same ? sent : one_way(arrays[1], y_m, range_m, defocus[1]));
    weights_.push_back(static_cast<float>(weight.real()));
    weights_.push_back(static_cast<float>(weight.imag()));
    row.width_m += 2.0 * step_m * std::norm(weight);
  }
  weights_.resize(2 * (row.first_weight + std::size_t{columns_}), 0.0f);
  return row;
}

/// The row of a plane that is width_m wide.
Scatterers::Row Scatterers::make_plane_row(double shortest_m, double width_m) {
  Row row = begin_row(
      shortest_m,
      std::max(0, static_cast<int>(std::ceil(std::log2(width_m / max_plane_cells / shortest_m)))),
      0.5 * width_m);
  row.width_m = width_m;
  const auto columns = static_cast<int>(row.reach * columns_per_cell);
  for (int column = 0; column < columns; ++column) {
    weights_.push_back(1.0f);
    weights_.push_back(0.0f);
  }
  weights_.resize(2 * (row.first_weight + std::size_t{columns_}), 0.0f);
  return row;
}

double Scatterers::middle_m(std::size_t row) const {
  return nearest_m_ * std::exp2((static_cast<double>(row) + 0.5) / rows_per_octave);
}

// Between rows it is linear in the logarithm of the range. Nearer and farther than all rows it is
// proportional to the range.
double Scatterers::width_m_at(double range_m) const {
  const std::size_t last = rows_.size() - 1;
  if (range_m < middle_m(0)) return rows_[0].width_m * range_m / middle_m(0);
  if (range_m > middle_m(last)) return rows_[last].width_m * range_m / middle_m(last);
  const double place = std::clamp(rows_per_octave * std::log2(range_m / nearest_m_) - 0.5, 0.0,
                                  static_cast<double>(last));
  const auto row = static_cast<std::size_t>(place);
  const double share = place - static_cast<double>(row);
  const Row& next = rows_[std::min(row + 1, last)];
  return rows_[row].width_m + share * (next.width_m - rows_[row].width_m);
}

double Scatterers::width_share(std::size_t bin, double from_m, double until_m) const {
  const Row& row = rows_[row_of_bin_[bin]];
  const double columns_per_m = row.cells_per_m * columns_per_cell;
  const double from = from_m * columns_per_m, until = until_m * columns_per_m;
  const auto overlap = [&](double begin, double end) {
    return std::max(std::min(end, until) - std::max(begin, from), 0.0);
  };
  double between = 0.0, all = 0.0;
  for (std::uint32_t column = 0; column < columns_; ++column) {
    const float* weight = &weights_[2 * (row.first_weight + column)];
    const double power = double(weight[0] * weight[0] + weight[1] * weight[1]);
    between += power * (overlap(column, column + 1.0) + overlap(-1.0 - column, -1.0 * column));
    all += 2.0 * power;
  }
  return between / all;
}

void Scatterers::place(const ArrayFrame& array_frame, const BinLayers& bins, Scratch& scratch,
                       std::size_t table_number) const {
  const Table& table = tables_[table_number];
  const std::size_t room = table.reach.size(), whole = bins.intensity_mean.size() / signal_group;
  for (auto* of_bin : {&scratch.across_cell, &scratch.across_within, &scratch.first_cell})
    of_bin->resize(room);
  for (auto* of_bin : {&scratch.first_column, &scratch.phase_turns}) of_bin->resize(room);
  for (auto* of_group : {&scratch.cells, &scratch.placeless}) of_group->resize(room / signal_group);
  const double heading = std::atan2(array_frame.axis.x(), array_frame.axis.y());
  const auto turned = std::lround(heading * frames / pi - (odd_ ? 0.5 : 0.0));
  const Frame& frame = frames_[static_cast<std::size_t>((turned % frames + frames) % frames)];
  scratch.frame_key = frame.key;
  // A bin's line is parallel to the array, seen from above. It crosses the beam's middle where the
  // offset along the axis is zero.
  const Eigen::Vector2d level = array_frame.axis.head<2>();
  const double level2 = std::max(level.squaredNorm(), 1e-6);
  const double along_axis = frame.along.dot(level), across_axis = frame.across.dot(level);
  const auto at_middle = [&](const Eigen::Vector2d& direction, double of_axis) {
    Eigen::Vector3d weights = -of_axis / level2 * array_frame.axis;
    weights.head<2>() += direction;
    return weights;
  };
  const Eigen::Vector3d across = at_middle(frame.across, across_axis),
                        along = at_middle(frame.along, along_axis);
  const double origin_m = array_frame.axis.dot(array_frame.origin) / level2;
  scratch.skew = across_axis / std::copysign(std::max(std::abs(along_axis), 1e-3), along_axis);
  const auto place_groups = [&](std::size_t begin, std::size_t count,
                                const std::array<const float*, 5>& layers) {
    place_cells({.bins = count,
                 .intensity = layers[0],
                 .x_m = layers[1],
                 .y_m = layers[2],
                 .z_m = layers[3],
                 .range_m = layers[4],
                 .cells_per_m = &table.cells_per_m[begin],
                 .reach = &table.reach[begin],
                 .across = {across.x(), across.y(), across.z()},
                 .across_add = across_axis * origin_m,
                 .along = {along.x(), along.y(), along.z()},
                 .along_add = along_axis * origin_m,
                 .origin_across = frame.across.dot(array_frame.origin.head<2>()),
                 .skew = scratch.skew,
                 .across_cells_per_m = 1.0 / cell_m_,
                 .turns = turns_per_cell_,
                 .rise = rise,
                 .columns_per_cell = columns_per_cell,
                 .across_cell = &scratch.across_cell[begin],
                 .across_within = &scratch.across_within[begin],
                 .first_cell = &scratch.first_cell[begin],
                 .first_column = &scratch.first_column[begin],
                 .phase_turns = &scratch.phase_turns[begin],
                 .cells = &scratch.cells[begin / signal_group],
                 .placeless = &scratch.placeless[begin / signal_group]});
  };
  const std::array layers = {bins.intensity_mean.data(), bins.x_m.data(), bins.y_m.data(),
                             bins.z_m.data(), bins.range_m.data()};
  const std::size_t begin = whole * signal_group;
  if (whole > 0) place_groups(0, begin, layers);
  if (begin < room) {  // the last group has fewer bins
    std::array<std::array<float, signal_group>, 5> last{};
    std::array<const float*, 5> padded{};
    for (std::size_t i = 0; i < layers.size(); ++i) {
      std::copy(layers[i] + begin, layers[i] + bins.intensity_mean.size(), last[i].begin());
      padded[i] = last[i].data();
    }
    place_groups(begin, signal_group, padded);
  }
  place_side_lobes(bins, table, scratch);
  if (!ground_.without_patches()) place_patches(frame, bins, table, scratch);
}

/// The patches under each bin's scatterers. Bins without a place have none.
void Scatterers::place_patches(const Frame& frame, const BinLayers& bins, const Table& table,
                               Scratch& scratch) const {
  TexturedGround::Places& patches = scratch.patches;
  const Eigen::Vector2d line = frame.along + scratch.skew * frame.across;
  for (auto* of_bin :
       {&patches.x, &patches.y, &patches.step_x, &patches.step_y, &patches.row, &patches.glint_row})
    of_bin->resize(table.reach.size());
  patches.glint_share.resize(table.reach.size());
  patches.strengths.resize(table.reach.size() * (2 * columns_ / columns_per_cell));
  patches.known = false;
  for (std::size_t n = 0; n < table.reach.size(); ++n) {
    if (n >= bins.intensity_mean.size() || !(bins.intensity_mean[n] > 0.0f) ||
        (bins.x_m[n] == 0.0f && bins.y_m[n] == 0.0f)) {
      TexturedGround::leave_even(n, patches);
      continue;
    }
    // The first cell lies where its line through the bin's place has its number along.
    const Eigen::Vector2d place(bins.x_m[n], bins.y_m[n]);
    const double step_m = 1.0 / table.cells_per_m[n];
    const double way_m =
        step_m * static_cast<std::int32_t>(scratch.first_cell[n]) - frame.along.dot(place);
    Eigen::Vector2d first = place + way_m * line;
    if (bins.region[n] == static_cast<std::uint32_t>(Region::object))
      first += bins.z_m[n] * patches_rise;
    ground_.place(n, bins.sediment[n], bins.grazing_rad[n],
                  {.x_m = first.x(),
                   .y_m = first.y(),
                   .step_x_m = step_m * line.x(),
                   .step_y_m = step_m * line.y(),
                   .step_rows = table.cell_rows[n]},
                  patches);
  }
}

/// A bin that has only energy of side lobes has no place. It gets the cells behind the cells of the
/// last bin that has a place.
void Scatterers::place_side_lobes(const BinLayers& bins, const Table& table,
                                  Scratch& scratch) const {
  if (std::ranges::all_of(scratch.placeless, [](std::uint32_t any) { return any == 0; })) return;
  std::optional<std::size_t> last;
  for (std::size_t n = 0; n < bins.intensity_mean.size(); ++n) {
    if (!(bins.intensity_mean[n] > 0.0f)) continue;
    if (bins.x_m[n] == 0.0f && bins.y_m[n] == 0.0f && bins.z_m[n] == 0.0f) {
      // Before the first bin with a place, the memory has values of an earlier ping.
      const std::size_t from = last.value_or(0);
      const float turns = last ? scratch.phase_turns[from] : 0.0f;
      const bool outwards = !(turns > 0.0f);
      const auto way = static_cast<std::uint32_t>(n - from);
      scratch.across_cell[n] =
          (last ? scratch.across_cell[from] : 0u) + (outwards ? way : ~way + 1u);
      scratch.across_within[n] = last ? scratch.across_within[from] : 0;
      scratch.phase_turns[n] = turns;
      if (last) {
        const double to_cells = double(table.cells_per_m[n]) / double(table.cells_per_m[from]);
        const auto first = static_cast<std::int32_t>(scratch.first_cell[from]);
        scratch.first_cell[n] =
            static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(to_cells * first)));
        scratch.first_column[n] = scratch.first_column[from];
      }
    }
    last = n;
  }
}

void Scatterers::gather(Scratch& scratch, int look, std::span<const float> power, float* re,
                        float* im, std::size_t table_number) const {
  const Table& table = tables_[table_number];
  sum_cells(
      {.across_cell = scratch.across_cell.data(),
       .across_within = scratch.across_within.data(),
       .first_cell = scratch.first_cell.data(),
       .first_column = scratch.first_column.data(),
       .first_weight = table.first_weight.data(),
       .key = table.key.data(),
       .phase_turns = scratch.phase_turns.data(),
       .cells_per_m = table.cells_per_m.data(),
       .power = power.data(),
       .cells = scratch.cells.data(),
       .bins = table.reach.size(),
       .across_per_m = static_cast<float>(scratch.skew / cell_m_),
       .common_key = scratch.frame_key + static_cast<std::uint32_t>(look) * 0x85157af5u,
       .texture = ground_.without_patches()
                      ? CellSums::Texture{}
                      : CellSums::Texture{.x = scratch.patches.x.data(),
                                          .y = scratch.patches.y.data(),
                                          .step_x = scratch.patches.step_x.data(),
                                          .step_y = scratch.patches.step_y.data(),
                                          .row = scratch.patches.row.data(),
                                          .glint_row = scratch.patches.glint_row.data(),
                                          .glint_share = scratch.patches.glint_share.data(),
                                          .quantiles = TexturedGround::quantiles().values().data(),
                                          .key = ground_.key(),
                                          .strengths = scratch.patches.strengths.data(),
                                          .known = scratch.patches.known},
       .weights = weights_.data(),
       .columns_per_cell = columns_per_cell,
       .last_column = columns_ - 1,
       .re = re,
       .im = im});
  scratch.patches.known = true;
}

}  // namespace ensonify::engine
