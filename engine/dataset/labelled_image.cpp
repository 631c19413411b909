#include <ensonify/engine/dataset/labelled_image.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
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

/// Copies pixels of labels: pixel i of `to` is pixel map[i] of `from`, or stays empty if map[i] is
/// `none`. Both count from the oldest ping.
void gather_labels(const LabelledImage& from, const std::vector<std::size_t>& map,
                   LabelledImage& to) {
  // In blocks, so that the map is read from the cache for each layer.
  constexpr std::size_t block = 2048;
  for (std::size_t begin = 0; begin < map.size(); begin += block)
    BinLayers::for_each([&](std::string_view, auto layer) {
      const auto* source = (from.labels.pixels.*layer).data();
      auto* target = (to.labels.pixels.*layer).data();
      for (std::size_t i = begin; i < std::min(begin + block, map.size()); ++i)
        if (map[i] != none) target[i] = source[map[i]];
    });
}

/// The same for labels and pictures. Pictures have the oldest ping at the bottom.
void gather(const LabelledImage& from, const std::vector<std::size_t>& map, LabelledImage& to) {
  gather_labels(from, map, to);
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

/// A pixel of a picture with other pixels along one axis: the pixels that it covers, and how much
/// of each.
struct Covered {
  std::size_t first = 0;
  std::vector<double> shares;  // their sum is 1
};

std::vector<Covered> covered(std::size_t from, std::size_t to) {
  std::vector<Covered> all(to);
  const double step = static_cast<double>(from) / static_cast<double>(to);
  for (std::size_t i = 0; i < to; ++i) {
    const double low = static_cast<double>(i) * step, high = low + step;
    all[i].first = std::min(from - 1, static_cast<std::size_t>(low));
    for (std::size_t k = all[i].first; k < from && (k == all[i].first || double(k) < high); ++k)
      all[i].shares.push_back((std::min(high, double(k + 1)) - std::max(low, double(k))) / step);
  }
  return all;
}

Picture averaged(const Picture& from, std::size_t columns, std::size_t rows) {
  const auto channels = static_cast<std::size_t>(from.channels);
  const std::vector<Covered> across = covered(from.width, columns),
                             along = covered(from.height, rows);
  Picture to{columns, rows, from.channels, {}};
  to.pixels.reserve(columns * rows * channels);
  for (const Covered& row : along)
    for (const Covered& column : across)
      for (std::size_t c = 0; c < channels; ++c) {
        double sum = 0.0;
        for (std::size_t y = 0; y < row.shares.size(); ++y)
          for (std::size_t x = 0; x < column.shares.size(); ++x)
            sum += row.shares[y] * column.shares[x] *
                   from.pixels[((row.first + y) * from.width + column.first + x) * channels + c];
        to.pixels.push_back(static_cast<std::uint8_t>(std::min(255.0, std::round(sum))));
      }
  return to;
}

/// An empty view like another one, with a number of pixels.
LabelledImage empty_like(const LabelledImage& view, std::size_t columns, std::size_t rows) {
  Sonar sonar = view.labels.sonar;
  sonar.sides = Sides::port;  // one side can have any number of columns
  sonar.bins = static_cast<int>(columns);
  return {.name = view.name,
          .geometry = view.geometry,
          .labels = Waterfall(sonar, rows),
          .pings = std::vector<std::size_t>(rows),
          .pictures = {},
          .across_m = view.across_m,
          .along_m = view.along_m};
}

}  // namespace

LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures) {
  const double length_m = way_m(line).back();
  std::vector<std::size_t> pings(line.rows());
  std::iota(pings.begin(), pings.end(), line.first_ping);
  return {.name = line.sonar.name,
          .geometry = "slant",
          .labels = line,
          .pings = std::move(pings),
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
                     .pings = std::vector<std::size_t>(rows),
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
    view.pings[row] = slant.pings[ping];
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
  LabelledImage piece = empty_like(view, part.columns, part.rows);
  const std::size_t lowest = view.labels.rows() - part.row - part.rows;  // oldest ping
  std::vector<std::size_t> map(part.rows * part.columns);
  for (std::size_t row = 0; row < part.rows; ++row) {
    piece.labels.pings[row] = view.labels.pings[lowest + row];
    piece.pings[row] = view.pings[lowest + row];
    for (std::size_t column = 0; column < part.columns; ++column)
      map[row * part.columns + column] =
          (lowest + row) * view.labels.columns() + part.column + column;
  }
  gather(view, map, piece);
  return piece;
}

LabelledImage resampled(const LabelledImage& view, std::size_t columns, std::size_t rows) {
  LabelledImage result = empty_like(view, columns, rows);
  const std::size_t from_columns = view.labels.columns(), from_rows = view.labels.rows();
  result.across_m *= static_cast<double>(from_columns) / static_cast<double>(columns);
  result.along_m *= static_cast<double>(from_rows) / static_cast<double>(rows);
  // The pixel at the middle of pixel i.
  const auto nearest = [](std::size_t i, std::size_t from, std::size_t to) {
    return (2 * i + 1) * from / (2 * to);
  };
  std::vector<std::size_t> map(rows * columns);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t from_row = nearest(row, from_rows, rows);
    result.labels.pings[row] = view.labels.pings[from_row];
    result.pings[row] = view.pings[from_row];
    for (std::size_t column = 0; column < columns; ++column)
      map[row * columns + column] =
          from_row * from_columns + nearest(column, from_columns, columns);
  }
  gather_labels(view, map, result);
  for (const Picture& picture : view.pictures)
    result.pictures.push_back(averaged(picture, columns, rows));
  return result;
}

}  // namespace ensonify::engine
