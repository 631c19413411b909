#include <ensonify/engine/mosaic/mosaic.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/label_names.h>
#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/mosaic/mosaic_file.h>
#include <ensonify/engine/mosaic/ping_source.h>
#include <ensonify/engine/mosaic/range_levels.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Box = Eigen::AlignedBox2d;

constexpr std::size_t strip_pings = 64;
constexpr double joined_spacings = 4.0;  // most usual spacings between two joined pings
constexpr std::size_t max_lost = 16;     // most pings without data between two joined pings
constexpr std::int64_t tile_px = 256;
constexpr std::int64_t block_cells = 4096;  // usual cells along a side of a block
constexpr std::int64_t max_cells = 4;       // most cells along a side of a pixel
constexpr double max_pixels = 1e11;

/// One run of the mosaic.
struct Line {
  RecordedRun run;
  Vector2d offset_m = Vector2d::Zero();  // from the first run's world origin to this run's
  double spacing_m = 0.0;                // usual distance between rows
  double joined_m = 0.0;                 // rows farther apart are not joined
  std::vector<bool> recorded;            // by row: whether it shows any ground
  std::vector<std::string> names;        // of the shown labels, by their number in the run
  std::vector<std::uint32_t> numbers;    // of these labels in the mosaic
  RangeLevels levels;
};

/// Neighbouring pings of a line that are read together.
struct Strip {
  std::size_t line = 0, begin = 0, end = 0;
  Box reach;  // all ground that these pings can cover, local metres of the first run
};

/// The usual distance from a row to the row that is `rows` rows later: the median of these steps,
/// weighted by their lengths, so that a waiting vehicle does not make it short. A long step, for
/// example between the lines of a survey, has at most the weight of joined_spacings mean steps.
double usual_step_m(const std::vector<MosaicPing>& pings, std::size_t rows) {
  std::vector<double> steps_m;
  double way_m = 0.0;
  for (std::size_t i = rows; i < pings.size(); ++i) {
    steps_m.push_back((pings[i].place_m - pings[i - rows].place_m).norm());
    way_m += steps_m.back();
  }
  std::ranges::sort(steps_m);
  const double most_m = joined_spacings * way_m / static_cast<double>(steps_m.size());
  double half_m = 0.0;
  for (const double step_m : steps_m) half_m += 0.5 * std::min(step_m, most_m);
  for (const double step_m : steps_m)
    if ((half_m -= std::min(step_m, most_m)) <= 0.0) return step_m;
  return 0.0;
}

/// The nearest (by ratio) of 1, 2 and 5 times a power of ten.
double rounded(double size_m) {
  const double power = std::pow(10.0, std::floor(std::log10(size_m)));
  const auto error = [&](double factor) { return std::abs(std::log(factor * power / size_m)); };
  double nearest = 1.0;
  for (const double factor : {2.0, 5.0, 10.0})
    if (error(factor) < error(nearest)) nearest = factor;
  return power * nearest;
}

PixelType pixel_type(const std::string& layer) {
  if (layer == "brightness") return PixelType::brightness;
  const bool value = layer == "sample" || layer == "intensity" || layer == "intensity_mean";
  return value ? PixelType::value : PixelType::label;
}

/// The pixel, from 1 to 255, for a level that is divided by the mean level, as a picture shows it.
float brightness(float level) {
  const double amplitude = mid_amplitude * std::sqrt(static_cast<double>(level));
  return static_cast<float>(
      std::clamp(std::round(255.0 * std::pow(amplitude, Display().gamma)), 1.0, 255.0));
}

/// The attribute of a run's images with the names of a layer's labels; empty: the layer has none.
std::string attribute_of_names(const std::string& layer) {
  return layer == "class" || layer == "sediment" ? layer + "_names" : "";
}

/// Slant range of a bin divided by the sonar's height.
double ratio(const RecordedRun& run, const MosaicPing& ping, std::size_t bin) {
  return (static_cast<double>(bin) + 0.5) * run.sonar.bin_m() / ping.height_m;
}

class Mosaic {
 public:
  Mosaic(std::span<const fs::path> folders, const MosaicOptions& options)
      : options_(options),
        type_(pixel_type(options.layer)),
        source_(options.positions, options.layer) {
    if (std::ranges::find(mosaic_layers, options.layer) == mosaic_layers.end())
      throw std::invalid_argument(fmt::format("there is no layer '{}', expected one of: {}",
                                              options.layer, fmt::join(mosaic_layers, ", ")));
    if (type_ == PixelType::label && options.overlap == Overlap::mean)
      throw std::invalid_argument(fmt::format(
          "the labels of the layer '{}' have no mean; choose another overlap", options.layer));
    if (folders.empty()) throw std::invalid_argument("a mosaic needs a run, at least one");
    if (!(options.pixel_m >= 0.0 && std::isfinite(options.pixel_m)))
      throw std::invalid_argument(
          fmt::format("a mosaic's pixel_m is {}, expected 0 or more", options.pixel_m));
    if (options.block_px < 0)
      throw std::invalid_argument(
          fmt::format("a mosaic's block_px is {}, expected 0 or more", options.block_px));
    for (const fs::path& folder : folders) add(folder);
    number_labels();
    choose_sizes();
  }

  MosaicReport write(const fs::path& file) {
    read_once();
    lay_out();
    MosaicFile mosaic(file, report_.columns, report_.rows,
                      corner_m_ + lines_.front().run.world_origin.head<2>(), report_.pixel_m, type_,
                      options_.layer, lines_.front().run.reference, texts());
    draw(mosaic);
    const bool finished = mosaic.finish([&](double share) {
      return proceed("overviews", static_cast<std::size_t>(100.0 * share), 100);
    });
    if (!finished) stop();
    return report_;
  }

 private:
  void add(const fs::path& folder) {
    Line line;
    line.run = read_recorded_run(folder, options_.sonar, options_.positions);
    line.spacing_m = usual_step_m(line.run.pings, 1);
    const auto beams = static_cast<std::size_t>(line.run.sonar.beams);
    line.joined_m = joined_spacings * std::max(line.spacing_m, usual_step_m(line.run.pings, beams));
    if (!(line.spacing_m > 0.0))
      throw SceneError(fmt::format(
          "{}: its pings do not move, so they cover no ground; make a run along a track",
          folder.string()));
    line.recorded.resize(line.run.pings.size());
    if (!lines_.empty()) {
      const RecordedRun& first = lines_.front().run;
      line.offset_m = (line.run.world_origin - first.world_origin).head<2>();
      if (line.run.reference != first.reference)
        throw SceneError(fmt::format(
            "{}: its coordinate reference system is not that of the first run; make one mosaic "
            "for each system",
            folder.string()));
    }
    report_.has_reference = !line.run.reference.empty();
    const std::size_t pings = line.run.pings.size();
    report_.pings += pings;
    for (std::size_t begin = 0; begin < pings; begin += strip_pings)
      strips_.push_back({lines_.size(), begin, std::min(begin + strip_pings, pings), Box()});
    lines_.push_back(std::move(line));
  }

  /// Gives labels of the same name the same number in all runs. The first run keeps its numbers.
  void number_labels() {
    const std::string attribute = attribute_of_names(options_.layer);
    if (attribute.empty()) return;
    for (Line& line : lines_) {
      line.names = ImageReader(line.run.images.front()).names(attribute);
      names_ = names_.empty() ? line.names : joined_names(line.names, std::span(names_).subspan(1));
    }
    for (Line& line : lines_) line.numbers = new_numbers(line.names, names_);
  }

  std::map<std::string, std::string> texts() const {
    if (names_.empty()) return {};
    return {{attribute_of_names(options_.layer), nlohmann::json(names_).dump()}};
  }

  void choose_sizes() {
    double coarsest_m = 0.0, finest_m = std::numeric_limits<double>::infinity();
    for (const Line& line : lines_)
      for (const double size_m : {line.run.sonar.bin_m(), line.spacing_m}) {
        coarsest_m = std::max(coarsest_m, size_m);
        finest_m = std::min(finest_m, size_m);
      }
    report_.pixel_m = options_.pixel_m > 0.0 ? options_.pixel_m : rounded(coarsest_m);
    if (type_ != PixelType::label)
      cells_ = static_cast<std::int64_t>(std::clamp(std::ceil(report_.pixel_m / finest_m - 1e-6),
                                                    1.0, static_cast<double>(max_cells)));
    block_px_ =
        options_.block_px > 0 ? options_.block_px : block_cells / cells_ / tile_px * tile_px;
  }

  /// Reads all pings once, to find their places and mean levels.
  void read_once() {
    Box box_before;  // of the last ping before that shows ground
    std::size_t done = 0;
    for (std::size_t s = 0; s < strips_.size(); ++s) {
      Strip& strip = strips_[s];
      Line& line = lines_[strip.line];
      const std::vector<ShownPing> pings = source_.read(line.run, strip.begin, strip.end);
      for (std::size_t i = 0; i < pings.size(); ++i) {
        const Box box = box_of(line, pings[i]);
        if (box.isEmpty()) continue;
        const std::size_t number = strip.begin + i;
        line.recorded[number] = true;
        strip.reach.extend(box);
        if (const auto before = neighbour(line, number, false)) {
          strip.reach.extend(box_before);
          strips_[s + *before / strip_pings - number / strip_pings].reach.extend(box);
        }
        box_before = box;
        add_levels(line, line.run.pings[number], pings[i]);
      }
      done += pings.size();
      report("pings", done, report_.pings);
    }
    for (Line& line : lines_) line.levels.finish();
  }

  /// The box around all places of a ping, with a margin for pings at the end of a line. Extends the
  /// mosaic by the places that are shown.
  Box box_of(const Line& line, const ShownPing& ping) {
    const auto around = [&](const Vector2d& place) {
      const Vector2d margin = Vector2d::Constant(0.5 * line.spacing_m);
      return Box(place + line.offset_m - margin, place + line.offset_m + margin);
    };
    Box box;
    for (const ShownSide& side : ping) {
      const std::vector<Vector2d>& places = side.ground.places_m;
      for (const Vector2d& place : places) box.extend(around(place));
      for (std::size_t entry = 0; entry + 1 < places.size(); ++entry)
        if (side.ground.shown[entry / 2])
          extent_.extend(around(places[entry])).extend(around(places[entry + 1]));
    }
    return box;
  }

  void add_levels(Line& line, const MosaicPing& ping, const ShownPing& shown) {
    if (type_ != PixelType::brightness) return;
    for (std::size_t side = 0; side < shown.size(); ++side)
      for (std::size_t bin = 0; bin < shown[side].values.size(); ++bin)
        if (shown[side].lit[bin])
          line.levels.add(side, ratio(line.run, ping, bin), shown[side].values[bin]);
  }

  static bool joined(const Line& line, std::size_t a, std::size_t b) {
    const auto beams = static_cast<std::size_t>(line.run.sonar.beams);
    return std::max(a, b) / beams - std::min(a, b) / beams <= max_lost + 1 &&
           (line.run.pings[a].place_m - line.run.pings[b].place_m).norm() <= line.joined_m;
  }

  /// Chooses the grid: pixel edges are at multiples of the pixel's size in world coordinates.
  void lay_out() {
    if (extent_.isEmpty())
      throw SceneError(fmt::format("{}: no ping of '{}' shows the bed, so there is nothing to map",
                                   lines_.front().run.images.front().parent_path().string(),
                                   lines_.front().run.sonar.name));
    const double pixel_m = report_.pixel_m;
    const Vector2d origin = lines_.front().run.world_origin.head<2>();
    const Vector2d low = ((extent_.min() + origin) / pixel_m).array().floor();
    const Vector2d high = ((extent_.max() + origin) / pixel_m).array().ceil();
    const Vector2d size = high - low;
    if (!(size.prod() <= max_pixels && size.maxCoeff() < 1e9))
      throw SceneError(fmt::format(
          "a mosaic of {:.3g} x {:.3g} m has too many pixels of {:g} m; give larger ones with "
          "--pixel-m",
          size.x() * pixel_m, size.y() * pixel_m, pixel_m));
    report_.columns = static_cast<std::int64_t>(size.x());
    report_.rows = static_cast<std::int64_t>(size.y());
    corner_m_ = Vector2d(low.x(), high.y()) * pixel_m - origin;
  }

  void draw(MosaicFile& mosaic) {
    struct Block {
      std::int64_t left, top, columns, rows;
      std::vector<const Strip*> strips;
    };
    std::size_t done = 0, all = 0;
    std::vector<Block> blocks;
    for (std::int64_t top = 0; top < report_.rows; top += block_px_)
      for (std::int64_t left = 0; left < report_.columns; left += block_px_) {
        Block block{left,
                    top,
                    std::min(block_px_, report_.columns - left),
                    std::min(block_px_, report_.rows - top),
                    {}};
        const Box box(place_of(left, top + block.rows), place_of(left + block.columns, top));
        for (const Strip& strip : strips_)
          if (box.intersects(strip.reach)) block.strips.push_back(&strip);
        all += block.strips.size();
        if (!block.strips.empty()) blocks.push_back(std::move(block));
      }
    for (const Block& block : blocks) {
      Canvas canvas(block.left * cells_, block.top * cells_, block.columns * cells_,
                    block.rows * cells_, options_.overlap);
      for (const Strip* strip : block.strips) {
        draw(*strip, canvas);
        report("blocks", ++done, all);
      }
      mosaic.write(block.left, block.top, block.columns, block.rows,
                   pixels_of(canvas, block.columns, block.rows));
    }
  }

  Vector2d place_of(std::int64_t column, std::int64_t row) const {
    return corner_m_ +
           report_.pixel_m * Vector2d(static_cast<double>(column), -static_cast<double>(row));
  }

  /// The next (or previous) ping to which a ping is joined; unset at an end of a line.
  static std::optional<std::size_t> neighbour(const Line& line, std::size_t ping, bool next) {
    std::size_t other = ping;
    for (;;) {
      if (next ? other + 1 == line.recorded.size() : other == 0) return std::nullopt;
      other = next ? other + 1 : other - 1;
      if (!joined(line, ping, other)) return std::nullopt;
      if (line.recorded[other]) return other;
    }
  }

  void draw(const Strip& strip, Canvas& canvas) {
    const Line& line = lines_[strip.line];
    std::size_t begin = strip.begin, end = strip.end;
    while (begin < end && !line.recorded[begin]) ++begin;
    while (begin < end && !line.recorded[end - 1]) --end;
    if (begin == end) return;
    const std::size_t first = neighbour(line, begin, false).value_or(begin);
    const std::size_t last = neighbour(line, end - 1, true).value_or(end - 1);
    const std::vector<ShownPing> pings = source_.read(line.run, first, last + 1);
    for (std::size_t number = begin; number < end; ++number) {
      if (!line.recorded[number]) continue;
      for (std::size_t side = 0; side < pings.front().size(); ++side) {
        const ShownSide& shown = pings[number - first][side];
        if (shown.ground.empty()) continue;
        const std::vector<float> values = values_of(line, number, side, shown);
        for (const bool next : {false, true}) {
          const auto other = neighbour(line, number, next);
          const PlacedSide* ground = other ? &pings[*other - first][side].ground : nullptr;
          draw(line, number, shown.ground, ground && !ground->empty() ? ground : nullptr, next,
               values, canvas);
        }
      }
    }
  }

  std::vector<float> values_of(const Line& line, std::size_t number, std::size_t side,
                               const ShownSide& shown) const {
    std::vector<float> values = shown.values;
    if (!line.numbers.empty())
      for (float& value : values) value = number_of(value, line);
    if (type_ == PixelType::brightness)
      for (std::size_t bin = 0; bin < values.size(); ++bin)
        values[bin] /= static_cast<float>(
            line.levels.mean(side, ratio(line.run, line.run.pings[number], bin)));
    return values;
  }

  /// The mosaic's number of a label of a run.
  static float number_of(float label, const Line& line) {
    if (!(label >= 0.0f && label < static_cast<float>(line.numbers.size())))
      throw SceneError(fmt::format(
          "{}: label {} has no name there; copy the folder again, or make the run again",
          line.run.images.front().parent_path().string(), label));
    return static_cast<float>(line.numbers[static_cast<std::size_t>(label)]);
  }

  /// Draws one side of a ping, up to halfway to a neighbour ahead (`next`) or astern; without a
  /// neighbour, up to half of the usual spacing. Each bin is drawn as two parts, from its edges to
  /// its centre. So it covers its centre even if the places of neighbouring bins are not in order,
  /// as on an object or on a slope that faces the sonar. There nearer bins are higher, so they are
  /// drawn last: seen from above, the higher place hides the lower place.
  void draw(const Line& line, std::size_t number, const PlacedSide& ground,
            const PlacedSide* neighbour, bool next, const std::vector<float>& values,
            Canvas& canvas) const {
    const MosaicPing& ping = line.run.pings[number];
    const double half_m = (next ? 0.5 : -0.5) * line.spacing_m;
    const Vector2d ahead_m =
        half_m * Vector2d(std::sin(ping.heading_rad), std::cos(ping.heading_rad));
    const double cell_m = report_.pixel_m / static_cast<double>(cells_);
    const auto cell_of = [&](const Vector2d& place) {
      const Vector2d from_corner = (place + line.offset_m - corner_m_) / cell_m;
      return Vector2d(from_corner.x(), -from_corner.y());
    };
    // The inner edges of the first shown bins of both pings belong together, even if the bins have
    // different numbers: the edge with this number may lie far behind in the other ping.
    const auto inner_edge = [](const PlacedSide& of) {
      return 2 * static_cast<std::size_t>(std::ranges::find(of.shown, true) - of.shown.begin());
    };
    const std::size_t own_inner = inner_edge(ground);
    const auto halfway = [&](std::size_t entry) -> Vector2d {
      const Vector2d& place = ground.places_m[entry];
      if (!neighbour) return place + ahead_m;
      const std::size_t there =
          entry == own_inner ? std::min(entry, inner_edge(*neighbour)) : entry;
      return 0.5 * (place + neighbour->places_m[there]);
    };
    for (std::size_t entry = 2 * ground.shown.size(); entry-- > 0;) {
      const std::size_t bin = entry / 2;
      if (!ground.shown[bin] || std::isnan(values[bin])) continue;
      const Vector2d centre = ground.places_m[2 * bin + 1];
      canvas.fill({cell_of(ground.places_m[entry]), cell_of(ground.places_m[entry + 1]),
                   cell_of(halfway(entry + 1)), cell_of(halfway(entry))},
                  values[bin], static_cast<float>((centre - ping.place_m).norm()));
    }
  }

  /// The mean of the cells of each pixel.
  std::vector<float> pixels_of(const Canvas& canvas, std::int64_t columns,
                               std::int64_t rows) const {
    std::vector<float> pixels;
    pixels.reserve(static_cast<std::size_t>(columns * rows));
    for (std::int64_t row = 0; row < rows; ++row)
      for (std::int64_t column = 0; column < columns; ++column) {
        float sum = 0.0f, count = 0.0f;
        for (std::int64_t i = 0; i < cells_ * cells_; ++i) {
          const float value = canvas.at(column * cells_ + i % cells_, row * cells_ + i / cells_);
          if (std::isnan(value)) continue;
          sum += value;
          count += 1.0f;
        }
        const float mean = sum / count;  // NaN without data
        pixels.push_back(type_ == PixelType::brightness && count > 0.0f ? brightness(mean) : mean);
      }
    return pixels;
  }

  bool proceed(std::string_view stage, std::size_t done, std::size_t of) const {
    return !options_.progress || options_.progress(stage, done, of);
  }
  void report(std::string_view stage, std::size_t done, std::size_t of) const {
    if (!proceed(stage, done, of)) stop();
  }
  [[noreturn]] static void stop() { throw Stopped("stopped on request; nothing was written"); }

  const MosaicOptions& options_;
  PixelType type_;
  PingSource source_;
  std::vector<Line> lines_;
  std::vector<std::string> names_;  // of the labels, by their number in the mosaic
  std::vector<Strip> strips_;       // in the order of drawing
  std::int64_t cells_ = 1;          // along a side of a pixel
  std::int64_t block_px_ = 0;
  Box extent_;                            // of all shown places, local metres of the first run
  Vector2d corner_m_ = Vector2d::Zero();  // the grid's upper left corner, in these metres
  MosaicReport report_;
};

}  // namespace

MosaicReport make_mosaic(std::span<const fs::path> runs, const fs::path& file,
                         const MosaicOptions& options) {
  return Mosaic(runs, options).write(file);
}

}  // namespace ensonify::engine
