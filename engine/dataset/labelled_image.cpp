#include <ensonify/engine/dataset/labelled_image.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

/// Distance over ground from the first ping to each ping.
std::vector<double> way_m(const Waterfall& line) {
  std::vector<double> way(line.rows(), 0.0);
  for (std::size_t i = 1; i < way.size(); ++i)
    way[i] = way[i - 1] +
             (line.pings[i].pose.position - line.pings[i - 1].pose.position).head<2>().norm();
  return way;
}

/// Copies pixels of labels and pictures: pixel i of `to` is pixel map[i] of `from`, or stays empty
/// if map[i] is `none`. Both count in the labels' order, oldest ping first; pictures have the
/// oldest ping at the bottom.
void gather(const LabelledImage& from, const std::vector<std::size_t>& map, LabelledImage& to) {
  BinLayers::for_each([&](std::string_view, auto layer) {
    const auto& source = from.labels.pixels.*layer;
    auto& target = to.labels.pixels.*layer;
    for (std::size_t i = 0; i < map.size(); ++i)
      if (map[i] != none) target[i] = source[map[i]];
  });
  const std::size_t columns = to.labels.columns(), rows = to.labels.rows();
  const std::size_t from_columns = from.labels.columns(), from_rows = from.labels.rows();
  for (const Picture& source : from.pictures) {
    const auto channels = static_cast<std::size_t>(source.channels);
    Picture& target = to.pictures.emplace_back(Picture{columns, rows, source.channels, {}});
    target.pixels.assign(columns * rows * channels, 0);
    for (std::size_t i = 0; i < map.size(); ++i) {
      if (map[i] == none) continue;
      const std::size_t row = rows - 1 - i / columns,
                        from_row = from_rows - 1 - map[i] / from_columns;
      const std::size_t pixel = row * columns + i % columns;
      const std::size_t from_pixel = from_row * from_columns + map[i] % from_columns;
      std::copy_n(source.pixels.begin() + static_cast<std::ptrdiff_t>(from_pixel * channels),
                  channels, target.pixels.begin() + static_cast<std::ptrdiff_t>(pixel * channels));
    }
  }
}

}  // namespace

LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures) {
  const double length_m = way_m(line).back();
  return {.name = line.sonar.name,
          .geometry = "slant",
          .labels = line,
          .pictures = std::move(pictures),
          .across_m = line.sonar.bin_m(),
          .along_m = line.rows() > 1 ? length_m / static_cast<double>(line.rows() - 1) : 0.0};
}

LabelledImage ground_view(const LabelledImage& slant, double pixel_m) {
  const Waterfall& line = slant.labels;
  const std::vector<double> way = way_m(line);
  Sonar sonar = line.sonar;
  sonar.bins = static_cast<int>(line.sonar.range_m / pixel_m);
  if (sonar.bins < 1)
    throw std::invalid_argument(fmt::format(
        "ground range: pixels of {} m are longer than the range of {} m; use smaller pixels",
        pixel_m, line.sonar.range_m));
  sonar.range_m = sonar.bins * pixel_m;
  const auto rows = static_cast<std::size_t>(way.back() / pixel_m) + 1;
  LabelledImage view{.name = slant.name + "_ground",
                     .geometry = "ground",
                     .labels = Waterfall(sonar, rows),
                     .pictures = {},
                     .across_m = pixel_m,
                     .along_m = pixel_m};
  const std::size_t columns = view.labels.columns(), from_columns = line.columns();
  const auto bins = static_cast<std::size_t>(sonar.bins),
             from_bins = static_cast<std::size_t>(line.sonar.bins);
  const bool port = sonar.sides != Sides::starboard;
  std::vector<std::size_t> map(rows * columns, none);
  std::size_t ping = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    const double at_m = static_cast<double>(row) * pixel_m;
    while (ping + 1 < way.size() && std::abs(way[ping + 1] - at_m) <= std::abs(way[ping] - at_m))
      ++ping;
    view.labels.pings[row] = line.pings[ping];
    const double height_m = line.sonar_altitude_m(ping);
    if (!(height_m >= 0.0)) continue;  // over a hole
    for (std::size_t column = 0; column < columns; ++column) {
      const bool to_port = port && column < bins;
      const std::size_t from_nadir = to_port ? bins - 1 - column : column - (port ? bins : 0);
      const double slant_m =
          std::hypot((static_cast<double>(from_nadir) + 0.5) * pixel_m, height_m);
      const auto bin = static_cast<std::size_t>(slant_m / line.sonar.bin_m());
      if (bin >= from_bins) continue;
      map[row * columns + column] =
          ping * from_columns + (to_port ? from_bins - 1 - bin : bin + (port ? from_bins : 0));
    }
  }
  gather(slant, map, view);
  return view;
}

LabelledImage cut(const LabelledImage& view, const Rectangle& part) {
  Sonar sonar = view.labels.sonar;
  sonar.sides = Sides::port;  // one side can have any number of columns
  sonar.bins = static_cast<int>(part.columns);
  LabelledImage piece{.name = view.name,
                      .geometry = view.geometry,
                      .labels = Waterfall(sonar, part.rows),
                      .pictures = {},
                      .across_m = view.across_m,
                      .along_m = view.along_m};
  const std::size_t lowest = view.labels.rows() - part.row - part.rows;  // oldest ping
  std::vector<std::size_t> map(part.rows * part.columns);
  for (std::size_t row = 0; row < part.rows; ++row) {
    piece.labels.pings[row] = view.labels.pings[lowest + row];
    for (std::size_t column = 0; column < part.columns; ++column)
      map[row * part.columns + column] =
          (lowest + row) * view.labels.columns() + part.column + column;
  }
  gather(view, map, piece);
  return piece;
}

}  // namespace ensonify::engine
