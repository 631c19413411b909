#include <ensonify/engine/image/picture_columns.h>

#include <utility>

#include <ensonify/engine/image/truth.h>

namespace ensonify::engine {

PictureColumns columns_of_bins(const Sonar& sonar) {
  return {.over_ground = false, .per_side = static_cast<std::size_t>(sonar.bins)};
}

PictureColumns picture_columns(const Sonar& sonar, const Display& display, double row_spacing_m) {
  PictureColumns columns = columns_of_bins(sonar);
  columns.over_ground = display.slant_range_correction;
  if (display.speed_correction && row_spacing_m > 0.0)
    columns.per_side = static_cast<std::size_t>(
        std::clamp(std::round(sonar.range_m / row_spacing_m), 1.0, double(sonar.bins)));
  return columns;
}

double height_over_bed_m(const Waterfall& waterfall, std::size_t row) {
  const PingRow& ping = waterfall.pings[row];
  const double altitude_m = waterfall.sonar_altitude_m(row);
  if (ping.altitude_m > 0.0 && altitude_m > 0.0) return altitude_m;
  int first_return = 0;
  for (const LineRecord& line : ping.lines)
    first_return = std::max(first_return, line.first_return);
  return first_return * waterfall.sonar.bin_m();
}

std::vector<ShownColumns> shown_columns(const Waterfall& waterfall, std::size_t row,
                                        PictureColumns columns) {
  const Sonar& sonar = waterfall.sonar;
  const auto bins = static_cast<double>(sonar.bins);
  const double column_m = sonar.range_m / static_cast<double>(columns.per_side);
  const double height_m = columns.over_ground ? height_over_bed_m(waterfall, row) : 0.0;
  const auto bin_at = [&](double column) {
    const double over_m = column * column_m;
    return std::sqrt(over_m * over_m + height_m * height_m) / sonar.bin_m();
  };
  const bool one_each = columns.per_side == static_cast<std::size_t>(sonar.bins);
  // The bins that a column shows. Columns and bins are counted from nadir outwards.
  const auto shown_bins = [&](double column) -> ShownColumns {
    if (!one_each) return {bin_at(column), bin_at(column + 1.0)};
    const double bin = columns.over_ground ? std::floor(bin_at(column + 0.5)) : column;
    return {bin, bin + 1.0};
  };
  const LineLayout made = columns.layout(sonar), layout = waterfall.layout();
  std::vector<ShownColumns> shown;
  shown.reserve(made.columns());
  for (std::size_t column = 0; column < made.columns(); ++column) {
    const auto [sector, bin] = made.place(column);
    auto [from, until] = shown_bins(static_cast<double>(bin));
    from = std::min(from, bins);
    until = std::min(until, bins);
    const auto first = static_cast<double>(layout.first_column(sector));
    if (layout.mirrored(sector))
      shown.push_back({first + (bins - until), first + (bins - from)});
    else
      shown.push_back({first + from, first + until});
  }
  return shown;
}

std::ptrdiff_t labelled_column(const Waterfall& waterfall, std::size_t row, ShownColumns shown) {
  const BinLayers& layers = waterfall.pixels;
  const auto rank = [&](std::size_t column) {
    const std::size_t i = row * waterfall.columns() + column;
    return layers.instance[i] != 0 ? 2 : layers.shadow_instance[i] != 0 ? 1 : 0;
  };
  const double middle = 0.5 * (shown.from + shown.until) - 0.5;
  std::pair best{-1, 0.0};  // the rank, and minus the distance from the middle
  std::ptrdiff_t found = -1;
  for (std::size_t column = shown.first(); column < shown.end(); ++column) {
    const std::pair here{rank(column), -std::abs(static_cast<double>(column) - middle)};
    if (here <= best) continue;
    best = here;
    found = static_cast<std::ptrdiff_t>(column);
  }
  return found;
}

Waterfall truth_in_columns(PictureColumns columns, const Waterfall& waterfall) {
  Sonar sonar = waterfall.sonar;
  sonar.bins = static_cast<int>(columns.per_side);
  Waterfall made(sonar, 0);
  made.pings = waterfall.pings;
  for (std::size_t row = 0; row < waterfall.rows(); ++row)
    for (const ShownColumns& shown : shown_columns(waterfall, row, columns)) {
      const std::ptrdiff_t column = labelled_column(waterfall, row, shown);
      for_each_truth_layer([&](auto layer) {
        const auto& from = waterfall.pixels.*layer;
        (made.pixels.*layer)
            .push_back(column < 0
                           ? 0
                           : from[row * waterfall.columns() + static_cast<std::size_t>(column)]);
      });
    }
  return made;
}

}  // namespace ensonify::engine
