#include <ensonify/engine/dataset/products.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/output/masks.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/random.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

/// Refuses a seafloor's name that the dataset has no number for.
void check_named(const std::vector<std::string>& own, const std::vector<std::string>& names,
                 std::string_view what) {
  for (std::size_t i = 1; i < own.size(); ++i)
    if (std::ranges::count(names, own[i]) == 0)
      throw std::invalid_argument(fmt::format(
          "the recipe cannot draw the {} '{}' of this sample; name it there", what, own[i]));
}

/// What counts as the target's picture: its body, or where that does not show its shadow.
const Outline& shown_part(const Target& target) {
  return target.body.area_px > 0 ? target.body : target.shadow;
}

/// Columns, rows of the box about a target and its shadow, as {first column, first row, end, end}.
std::array<std::size_t, 4> extent(const Target& target) {
  std::array<std::size_t, 4> all{~std::size_t{0}, ~std::size_t{0}, 0, 0};
  for (const Outline* part : {&target.body, &target.shadow}) {
    if (part->area_px == 0) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      all[i] = std::min(all[i], static_cast<std::size_t>(part->low[i]));
      all[i + 2] = std::max(all[i + 2], static_cast<std::size_t>(part->high[i]));
    }
  }
  return all;
}

class Products {
 public:
  Products(const DatasetOptions& options, const SampleScene& sample, const Seafloor& seafloor,
           const std::filesystem::path& folder)
      : options_(options),
        sample_(sample),
        classes_(sample.scene.output.class_names),
        seafloor_(seafloor),
        folder_(folder) {
    check_named(seafloor.classes, classes_, "class");
    check_named(seafloor.materials, sample.scene.output.sediment_names, "material");
  }

  void add_line(const Waterfall& line, const Calibration& calibration,
                std::span<const ObjectView> views, std::size_t sonar) {
    std::vector<Picture> pictures;
    for (const Display& display : sample_.renders)
      pictures.push_back(render(line, display, calibration));
    const LabelledImage slant = slant_view(line, std::move(pictures));
    for (std::size_t r = 1; r < slant.pictures.size(); ++r)
      write(fmt::format("{}.r{}.png", slant.name, r), encode_png(slant.pictures[r]));
    if (options_.slant) add_view(slant, views, sonar, 0);
    if (options_.ground_px_m > 0.0)
      add_view(ground_view(slant, options_.ground_px_m), views, sonar, 1);
  }

  double disk_s() const { return disk_s_; }

 private:
  void write(const std::string& name, std::span<const std::byte> content) {
    const Clock::time_point start = Clock::now();
    const std::filesystem::path file = folder_ / name;
    std::filesystem::create_directories(file.parent_path());
    refine::write_staged(file, content);
    disk_s_ += seconds_since(start);
  }

  void add_view(const LabelledImage& view, std::span<const ObjectView> views, std::size_t sonar,
                std::size_t geometry) {
    whole_.clear();
    for (TargetRecord& record : target_records(view.labels, seafloor_, views)) {
      const std::uint32_t instance = record.target.instance;
      whole_.emplace(instance, std::move(record));
    }
    add_image(view, view.whole(), view.name, "line");
    add_tiles(view);
    add_chips(view, sonar, geometry);
  }

  void add_tiles(const LabelledImage& view) {
    const TileOptions& tiles = options_.tiles;
    if (!tiles.any()) return;
    const auto [columns, rows] =
        tiles.width_px > 0
            ? std::pair(pixels(tiles.width_px, 1.0), pixels(tiles.height_px, 1.0))
            : std::pair(pixels(tiles.width_m, view.across_m), pixels(tiles.height_m, view.along_m));
    check_fits("dataset.tiles", view, columns, rows);
    std::size_t number = 0;
    for (const std::size_t row : starts(view.labels.rows(), rows))
      for (const std::size_t column : starts(view.labels.columns(), columns))
        add_image(view, {column, row, columns, rows},
                  fmt::format("tiles/{}_{:04}", view.name, number++), "tile");
  }

  static std::size_t pixels(double length, double pixel) {
    return static_cast<std::size_t>(std::max(1.0, std::round(length / pixel)));
  }

  static void check_fits(std::string_view key, const LabelledImage& view, std::size_t columns,
                         std::size_t rows) {
    if (columns > view.labels.columns() || rows > view.labels.rows())
      throw std::invalid_argument(
          fmt::format("'{}' takes {} x {} pixels of {}, which has {} x {}; make them smaller or "
                      "the line longer",
                      key, columns, rows, view.name, view.labels.columns(), view.labels.rows()));
  }

  /// Where tiles begin; the last ends with the line.
  std::vector<std::size_t> starts(std::size_t whole, std::size_t tile) const {
    const auto stride = static_cast<std::size_t>(
        std::max(1.0, std::round(options_.tiles.stride * static_cast<double>(tile))));
    std::vector<std::size_t> all;
    for (std::size_t at = 0; at + tile <= whole; at += stride) all.push_back(at);
    if (all.back() + tile < whole && stride <= tile) all.push_back(whole - tile);
    return all;
  }

  void add_chips(const LabelledImage& view, std::size_t sonar, std::size_t geometry) {
    const ChipOptions& chips = options_.chips;
    if (!chips.any()) return;
    const std::size_t columns =
        chips.size_px > 0 ? pixels(chips.size_px, 1.0) : pixels(chips.size_m, view.across_m);
    const std::size_t rows = chips.size_px > 0 ? columns : pixels(chips.size_m, view.along_m);
    check_fits("dataset.chips", view, columns, rows);
    const std::size_t last_column = view.labels.columns() - columns,
                      last_row = view.labels.rows() - rows;
    std::size_t number = 0;
    for (const auto& [instance, record] : whole_) {
      const auto [left, top, right, bottom] = extent(record.target);
      // The middle of a long trawl mark's box is nowhere.
      if (!record.is_object() && (right - left > columns || bottom - top > rows)) continue;
      const auto start = [](std::size_t begin, std::size_t end, std::size_t size,
                            std::size_t last) {
        const std::size_t middle = (begin + end) / 2, half = size / 2;
        return std::min(last, middle > half ? middle - half : 0);
      };
      add_image(view,
                {start(left, right, columns, last_column), start(top, bottom, rows, last_row),
                 columns, rows},
                fmt::format("chips/{}_{:04}", view.name, number++), "chip");
    }
    constexpr int tries = 200;
    for (int n = 0; n < chips.backgrounds; ++n) {
      const RandomStream stream(sample_.scene.seed, Purpose::background_chip,
                                {sonar, geometry, static_cast<std::uint64_t>(n)});
      for (int t = 0; t < tries; ++t) {
        std::array<double, 2> u{};
        stream.uniform(u, 2 * static_cast<std::uint64_t>(t));
        const auto at = [](double share, std::size_t last) {
          return std::min(last, static_cast<std::size_t>(share * static_cast<double>(last + 1)));
        };
        const Rectangle part{at(u[0], last_column), at(u[1], last_row), columns, rows};
        if (std::ranges::any_of(whole_, [&](const auto& entry) {
              return entry.second.is_object() && meet(part, extent(entry.second.target));
            }))
          continue;
        add_image(view, part, fmt::format("chips/{}_background_{:04}", view.name, n), "background");
        break;
      }
    }
  }

  static bool meet(const Rectangle& part, const std::array<std::size_t, 4>& box) {
    return part.column < box[2] && box[0] < part.column + part.columns && part.row < box[3] &&
           box[1] < part.row + part.rows;
  }

  void add_image(const LabelledImage& view, const Rectangle& part, const std::string& stem,
                 std::string_view kind) {
    const bool whole = kind == "line";
    const LabelledImage own =
        whole ? LabelledImage{"", "", Waterfall(view.labels.sonar, 0), {}, 0, 0} : cut(view, part);
    const LabelledImage& piece = whole ? view : own;
    // The whole lines in slant range are the run's own pictures.
    if (!whole || view.geometry != "slant")
      for (std::size_t r = 0; r < piece.pictures.size(); ++r)
        write(r == 0 ? stem + ".png" : fmt::format("{}.r{}.png", stem, r),
              encode_png(piece.pictures[r]));

    ImageLabels labels{.image = stem,
                       .pictures = {stem + ".png"},
                       .kind = std::string(kind),
                       .geometry = view.geometry,
                       .sonar = view.labels.sonar.name,
                       .column = part.column,
                       .row = part.row,
                       .columns = part.columns,
                       .rows = part.rows,
                       .pixel_across_m = view.across_m,
                       .pixel_along_m = view.along_m,
                       .split = sample_.split};
    for (std::size_t r = 1; r < piece.pictures.size(); ++r)
      labels.pictures.push_back(fmt::format("{}.r{}.png", stem, r));
    std::vector<std::uint32_t> left_out;
    std::string yolo;
    for (Target& target : find_targets(piece.labels)) {
      TargetLabel label = label_of(std::move(target));
      if (label.ignored)
        left_out.push_back(label.record.target.instance);
      else if (label.record.target.body.area_px > 0)
        yolo += yolo_line(label, part);
      labels.targets.push_back(std::move(label));
    }
    for (const Mask& mask : encode_masks(piece.labels, left_out)) {
      write(fmt::format("{}.{}.png", stem, mask.name), mask.png);
      if (mask.name != "class") continue;
      for (const std::uint16_t number : mask.numbers)
        if (number > 0 && number != ignored_class) labels.classes.push_back(classes_[number - 1u]);
    }
    write_text(stem + ".json", labels_json(labels));
    for (const std::string& picture : labels.pictures)
      write_text(picture.substr(0, picture.size() - std::string(".png").size()) + ".txt", yolo);
  }

  /// Of a target as a part of the line shows it: its place and contrast are those of the whole
  /// line, the outlines those of the part.
  TargetLabel label_of(Target shown) const {
    const TargetRecord& whole = whole_.at(shown.instance);
    TargetLabel label{.record = whole, .category_id = category(whole.class_name)};
    Target& target = label.record.target;
    target.body = std::move(shown.body);
    target.shadow = std::move(shown.shadow);
    const bool body_lost = whole.target.body.area_px > 0 && target.body.area_px == 0;
    label.shown_fraction = body_lost ? 0.0
                                     : static_cast<double>(shown_part(target).area_px) /
                                           static_cast<double>(shown_part(whole.target).area_px);
    // The bed is never ignored.
    label.ignored = whole.is_object() && label.shown_fraction < options_.min_visible;
    return label;
  }

  void write_text(const std::string& name, const std::string& text) {
    write(name, std::as_bytes(std::span(text)));
  }

  std::size_t category(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(classes_, name) - classes_.begin()) + 1;
  }

  /// Class from 0, then the body's middle and size in shares of the picture.
  static std::string yolo_line(const TargetLabel& label, const Rectangle& part) {
    const Outline& body = label.record.target.body;
    const auto middle_and_size = [&](std::size_t i, std::size_t pixels) {
      const double low = body.low[i], size = body.high[i] - body.low[i],
                   all = static_cast<double>(pixels);
      return std::pair((low + 0.5 * size) / all, size / all);
    };
    const auto [x, width] = middle_and_size(0, part.columns);
    const auto [y, height] = middle_and_size(1, part.rows);
    return fmt::format("{} {:.6f} {:.6f} {:.6f} {:.6f}\n", label.category_id - 1, x, y, width,
                       height);
  }

  const DatasetOptions& options_;
  const SampleScene& sample_;
  const std::vector<std::string>& classes_;  // by their numbers, from 1
  const Seafloor& seafloor_;
  const std::filesystem::path& folder_;
  std::map<std::uint32_t, TargetRecord> whole_;  // targets of the view at hand, by instance
  double disk_s_ = 0.0;
};

}  // namespace

ProductTimes write_products(const DatasetOptions& options, const SampleScene& sample,
                            const RunOutputs& outputs, const std::filesystem::path& folder) {
  const Clock::time_point start = Clock::now();
  const Simulator& simulator = outputs.simulator;
  Products products(options, sample, simulator.seafloor(), folder);
  for (std::size_t i = 0; i < outputs.lines.size(); ++i)
    products.add_line(outputs.lines[i], simulator.calibration(i), outputs.object_visibility[i], i);
  const double all_s = seconds_since(start);
  return {all_s - products.disk_s(), products.disk_s()};
}

}  // namespace ensonify::engine
