#include <ensonify/engine/dataset/labelled_image.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/image/truth.h>

namespace ensonify::engine {
namespace {

/// `count` pixels of one row of the source are copied to one row of the target. `from` and `to` are
/// the indices of the first pixel.
struct Run {
  std::size_t to, from, count;
};

/// Which pixels of a source become which pixels of a target. Indices count from the oldest ping.
class PixelMap {
 public:
  void start_row() { in_row_ = false; }
  /// Adds a pixel of the target and the pixel of the source that it copies. For gather(), all
  /// pixels of a row of the target must come from one row of the source.
  void add(std::size_t to, std::size_t from) {
    if (in_row_ && runs_.back().to + runs_.back().count == to &&
        runs_.back().from + runs_.back().count == from)
      ++runs_.back().count;
    else
      runs_.push_back({to, from, 1});
    in_row_ = true;
  }
  void add_run(const Run& run) { runs_.push_back(run); }
  std::span<const Run> runs() const { return runs_; }

 private:
  std::vector<Run> runs_;
  bool in_row_ = false;
};

/// std::copy_n(), but without its call for a few numbers, for which the call takes longer.
template <class Value>
void copy_run(const Value* from, std::size_t count, Value* to) {
  constexpr std::size_t few = 8;
  if (count > few)
    std::copy_n(from, count, to);
  else
    for (std::size_t i = 0; i < count; ++i) to[i] = from[i];
}

/// Calls f for each layer that find_targets(), encode_masks() and choose_chips() read.
template <class F>
void for_each_label(F&& f) {
  for_each_truth_layer(f);
  f(&BinLayers::sediment);
  f(&BinLayers::class_id);
}

void gather_labels(const LabelledImage& from, const PixelMap& map, LabelledImage& to) {
  // In blocks of runs, so that the runs of a block are in the processor's cache for every layer.
  constexpr std::size_t block = 1024;
  for (std::size_t begin = 0; begin < map.runs().size(); begin += block) {
    const std::span<const Run> runs =
        map.runs().subspan(begin, std::min(block, map.runs().size() - begin));
    for_each_label([&](auto layer) {
      const auto* source = (from.labels.pixels.*layer).data();
      auto* target = (to.labels.pixels.*layer).data();
      for (const Run& run : runs) copy_run(source + run.from, run.count, target + run.to);
    });
  }
}

/// Copies labels and pictures. Pictures have the oldest ping at the bottom.
void gather(const LabelledImage& from, const PixelMap& map, LabelledImage& to) {
  gather_labels(from, map, to);
  const auto in_picture = [](std::size_t pixel, const LabelledImage& image) {
    const std::size_t columns = image.labels.columns();
    return image.flipped(pixel / columns, pixel % columns);
  };
  for (const Picture& source : from.pictures) {
    const auto channels = static_cast<std::size_t>(source.channels);
    Picture& target = to.pictures.emplace_back(
        Picture{to.labels.columns(), to.labels.rows(), source.channels, {}});
    target.pixels.assign(target.width * target.height * channels, 0);
    for (const Run& run : map.runs())
      copy_run(source.pixels.data() + in_picture(run.from, from) * channels, run.count * channels,
               target.pixels.data() + in_picture(run.to, to) * channels);
  }
}

/// A pixel of a resampled picture, along one axis: the source's pixels that it covers, and the part
/// of the new pixel that each has.
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

/// The bytes of a pixel while it is gathered: its labels, at most one Run, and the pictures.
double bytes_per_pixel(std::span<const Picture> pictures) {
  double bytes = sizeof(Run);
  const BinLayers layers;
  for_each_label([&](auto layer) { bytes += sizeof(*(layers.*layer).data()); });
  for (const Picture& picture : pictures) bytes += picture.channels;
  return bytes;
}

/// A waterfall with this number of rows, whose labels are all 0.
Waterfall unlabelled(const Sonar& sonar, std::size_t rows) {
  Waterfall waterfall(sonar, 0);
  waterfall.pings.resize(rows);
  for_each_label([&](auto layer) {
    (waterfall.pixels.*layer).assign(waterfall.rows() * waterfall.columns(), 0);
  });
  return waterfall;
}

/// An image like `view` without pictures, with this number of pixels, whose labels are all 0.
LabelledImage empty_like(const LabelledImage& view, std::size_t columns, std::size_t rows) {
  Sonar sonar = view.labels.sonar;
  sonar.sides = Sides::port;  // one side can have any number of columns
  sonar.bins = static_cast<int>(columns);
  return {.name = view.name,
          .geometry = view.geometry,
          .labels = unlabelled(sonar, rows),
          .pictures = {},
          .across_m = view.across_m,
          .along_m = view.along_m};
}

}  // namespace

std::vector<double> rows_along_m(const Waterfall& line) {
  const auto beams = static_cast<std::size_t>(line.sonar.beams);
  const auto step_m = [&](std::size_t row) {
    return (line.pings[row].pose.position - line.pings[row - beams].pose.position).head<2>().norm();
  };
  std::vector<double> along_m(line.rows());
  double way_m = 0.0;
  for (std::size_t row = 0; row < along_m.size(); ++row) {
    if (row >= beams && row % beams == 0) way_m += step_m(row);
    along_m[row] = way_m + line.sonar.beam_offset_m(static_cast<int>(row % beams));
  }
  return along_m;
}

double length_along_m(const Waterfall& line) {
  const std::vector<double> along_m = rows_along_m(line);
  return along_m.empty() ? 0.0 : std::ranges::max(along_m) - std::ranges::min(along_m);
}

ViewSize slant_size(const Waterfall& line) {
  return {.name = line.sonar.name,
          .columns = line.columns(),
          .rows = line.rows(),
          .across_m = line.sonar.bin_m(),
          .along_m =
              line.rows() > 1 ? length_along_m(line) / static_cast<double>(line.rows() - 1) : 0.0};
}

ViewSize ground_size(const Waterfall& line, double pixel_m) {
  // The factor is there because a quotient that should be whole may be rounded to less.
  const double bins = std::floor(line.sonar.range_m / pixel_m * (1.0 + 1e-9));
  if (bins < 1.0)
    throw std::invalid_argument(fmt::format(
        "ground range: pixels of {} m are longer than the range of {} m; use smaller pixels",
        pixel_m, line.sonar.range_m));
  // The limit keeps the numbers within integers; more pixels do not fit into any memory.
  const auto counted = [](double pixels) {
    return static_cast<std::size_t>(std::min(pixels, 1e9));
  };
  return {.name = line.sonar.name + "_ground",
          .columns = LineLayout(line.sonar.sectors(), counted(bins)).columns(),
          .rows = counted(std::floor(length_along_m(line) / pixel_m) + 1.0),
          .across_m = pixel_m,
          .along_m = pixel_m};
}

LabelledImage slant_view(const Waterfall& line, std::vector<Picture> pictures) {
  Waterfall labels(line.sonar, 0);
  labels.pings = line.pings;
  for_each_label([&](auto layer) { labels.pixels.*layer = line.pixels.*layer; });
  const ViewSize size = slant_size(line);
  return {.name = size.name,
          .geometry = "slant",
          .labels = std::move(labels),
          .pictures = std::move(pictures),
          .across_m = size.across_m,
          .along_m = size.along_m};
}

LabelledImage ground_view(const LabelledImage& slant, double pixel_m, const MemoryLimit& memory,
                          const std::function<void()>& stop_check) {
  const Waterfall& line = slant.labels;
  const std::vector<double> along_m = rows_along_m(line);
  std::vector<std::size_t> order(along_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t row) { return along_m[row]; });
  const double start_m = along_m[order.front()];
  const ViewSize size = ground_size(line, pixel_m);
  const std::size_t columns = size.columns, rows = size.rows, from_columns = line.columns();
  memory.require(
      static_cast<double>(rows) * static_cast<double>(columns) * bytes_per_pixel(slant.pictures),
      fmt::format("the {} x {} pixels of {} in ground range", columns, rows, slant.name),
      fmt::format("use pixels longer than {} m (dataset.ground_px_m)", pixel_m));
  Sonar sonar = line.sonar;
  sonar.bins = static_cast<int>(columns / sonar.sectors().size());
  sonar.range_m = sonar.bins * pixel_m;
  LabelledImage view{.name = size.name,
                     .geometry = "ground",
                     .labels = unlabelled(sonar, rows),
                     .pictures = {},
                     .across_m = size.across_m,
                     .along_m = size.along_m};
  const auto from_bins = static_cast<std::size_t>(line.sonar.bins);
  const LineLayout layout = view.labels.layout(), from_layout = line.layout();
  PixelMap map;
  std::size_t nearest = 0;  // in order
  for (std::size_t row = 0; row < rows; ++row) {
    if (stop_check) stop_check();
    const double at_m = start_m + static_cast<double>(row) * pixel_m;
    const auto off_m = [&](std::size_t n) { return std::abs(along_m[order[n]] - at_m); };
    while (nearest + 1 < order.size() && off_m(nearest + 1) <= off_m(nearest)) ++nearest;
    const std::size_t from_row = order[nearest];
    view.labels.pings[row] = line.pings[from_row];
    const double height_m = line.sonar_altitude_m(from_row);
    if (!(height_m >= 0.0)) continue;  // over a hole
    map.start_row();
    for (std::size_t column = 0; column < columns; ++column) {
      const auto [sector, from_nadir] = layout.place(column);
      const double slant_m =
          std::hypot((static_cast<double>(from_nadir) + 0.5) * pixel_m, height_m);
      const auto bin = static_cast<std::size_t>(slant_m / line.sonar.bin_m());
      if (bin >= from_bins) continue;
      map.add(row * columns + column, from_row * from_columns + from_layout.column({sector, bin}));
    }
  }
  gather(slant, map, view);
  return view;
}

LabelledImage frame_view(const Waterfall& line, std::size_t ping,
                         const std::vector<Picture>& pictures) {
  const auto beams = static_cast<std::size_t>(line.sonar.beams);
  const std::size_t columns = line.columns(), first = ping * beams;
  LabelledImage frame{
      .name = fmt::format("{}_{:06}", line.sonar.name, line.pings[first].number / beams),
      .geometry = "beams",
      .labels = unlabelled(line.sonar, beams),
      .pictures = {},
      .across_m = line.sonar.bin_m(),
      .along_m = 0.0};
  std::copy_n(line.pings.begin() + static_cast<std::ptrdiff_t>(first), beams,
              frame.labels.pings.begin());
  for_each_label([&](auto layer) {
    std::copy_n((line.pixels.*layer).data() + first * columns, beams * columns,
                (frame.labels.pixels.*layer).data());
  });
  for (const Picture& picture : pictures) {
    const std::size_t row_bytes = picture.pixels.size() / picture.height;
    const auto top = picture.pixels.begin() +
                     static_cast<std::ptrdiff_t>((line.rows() - first - beams) * row_bytes);
    Picture& its = frame.pictures.emplace_back(Picture{picture.width, beams, picture.channels, {}});
    its.bits = picture.bits;
    its.pixels.assign(top, top + static_cast<std::ptrdiff_t>(beams * row_bytes));
  }
  return frame;
}

LabelledImage fan_view(const LabelledImage& frame, const FanPicture& fan) {
  LabelledImage view = empty_like(frame, fan.width(), fan.height());
  view.geometry = "fan";
  view.across_m = view.along_m = fan.m_per_px();
  std::ranges::fill(view.labels.pings, frame.labels.pings.front());
  PixelMap map;
  for (std::size_t row = 0; row < fan.height(); ++row) {
    map.start_row();
    for (std::size_t column = 0; column < fan.width(); ++column)
      if (const std::optional<std::size_t> from = fan.nearest(column, row))
        map.add(view.flipped(row, column), *from);
  }
  gather_labels(frame, map, view);
  for (const Picture& picture : frame.pictures) view.pictures.push_back(fan.draw(picture, 0));
  return view;
}

std::size_t pixels_of(double length_m, double pixel_m) {
  if (!(pixel_m > 0.0))
    throw std::invalid_argument(
        "the line does not move, so that no number of its pings makes a length in metres: give "
        "tiles and chips a size in pixels (size_px, width_px, height_px)");
  return static_cast<std::size_t>(std::max(1.0, std::round(length_m / pixel_m)));
}

double bed_share(const LabelledImage& view, const Rectangle& part) {
  std::size_t bed = 0;
  for (std::size_t row = part.row; row < part.row + part.rows; ++row)
    for (std::size_t column = part.column; column < part.column + part.columns; ++column) {
      const auto region = static_cast<Region>(view.labels.pixels.region[view.flipped(row, column)]);
      bed += region == Region::seabed || region == Region::object || region == Region::shadow;
    }
  return static_cast<double>(bed) / static_cast<double>(part.columns * part.rows);
}

LabelledImage cut(const LabelledImage& view, const Rectangle& part) {
  LabelledImage piece = empty_like(view, part.columns, part.rows);
  const std::size_t lowest = view.labels.rows() - part.row - part.rows;  // oldest ping
  PixelMap map;
  for (std::size_t row = 0; row < part.rows; ++row) {
    piece.labels.pings[row] = view.labels.pings[lowest + row];
    map.add_run({.to = row * part.columns,
                 .from = (lowest + row) * view.labels.columns() + part.column,
                 .count = part.columns});
  }
  gather(view, map, piece);
  return piece;
}

LabelledImage resampled(const LabelledImage& view, std::size_t columns, std::size_t rows) {
  LabelledImage result = empty_like(view, columns, rows);
  const std::size_t from_columns = view.labels.columns(), from_rows = view.labels.rows();
  result.across_m *= static_cast<double>(from_columns) / static_cast<double>(columns);
  result.along_m *= static_cast<double>(from_rows) / static_cast<double>(rows);
  // The source's pixel at the middle of pixel i.
  const auto nearest = [](std::size_t i, std::size_t from, std::size_t to) {
    return (2 * i + 1) * from / (2 * to);
  };
  PixelMap map;
  for (std::size_t row = 0; row < rows; ++row) {
    map.start_row();
    const std::size_t from_row = nearest(row, from_rows, rows);
    result.labels.pings[row] = view.labels.pings[from_row];
    for (std::size_t column = 0; column < columns; ++column)
      map.add(row * columns + column,
              from_row * from_columns + nearest(column, from_columns, columns));
  }
  gather_labels(view, map, result);
  for (const Picture& picture : view.pictures)
    result.pictures.push_back(averaged(picture, columns, rows));
  return result;
}

}  // namespace ensonify::engine
