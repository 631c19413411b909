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

/// Throws std::invalid_argument if the dataset has no number for a class or material in use.
void check_numbered(const std::vector<std::string>& of_seafloor,
                    const std::vector<std::string>& of_dataset, std::string_view what) {
  for (std::size_t i = 1; i < of_seafloor.size(); ++i)
    if (std::ranges::count(of_dataset, of_seafloor[i]) == 0)
      throw std::invalid_argument(
          fmt::format("this sample has the {0} '{1}', but no {0} key of the recipe has that "
                      "value; add it to one",
                      what, of_seafloor[i]));
}

/// The target's body; if the picture does not show the body, the target's shadow.
const Outline& shown_part(const Target& target) {
  return target.body.area_px > 0 ? target.body : target.shadow;
}

/// The bounding box of body and shadow: {first column, first row, end column, end row}.
std::array<std::size_t, 4> bounding_box(const Target& target) {
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
    check_numbered(seafloor.classes, classes_, "class");
    check_numbered(seafloor.materials, sample.scene.output.sediment_names, "material");
  }

  void add_line(const Waterfall& line, const Calibration& calibration,
                std::span<const ObjectVisibility> visibility, std::size_t sonar) {
    std::vector<Picture> pictures;
    for (const Display& display : sample_.renders)
      pictures.push_back(render(line, display, calibration));
    const LabelledImage slant = slant_view(line, std::move(pictures));
    for (std::size_t r = 1; r < slant.pictures.size(); ++r)
      write(fmt::format("{}.r{}.png", slant.name, r), encode_png(slant.pictures[r]));
    if (options_.slant) add_geometry(slant, visibility, sonar, 0);
    if (options_.ground_px_m > 0.0)
      add_geometry(ground_view(slant, options_.ground_px_m), visibility, sonar, 1);
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

  /// Adds all images of a line in one geometry: 0 is slant range, 1 is ground range.
  void add_geometry(const LabelledImage& line, std::span<const ObjectVisibility> visibility,
                    std::size_t sonar, std::size_t geometry) {
    line_targets_.clear();
    for (TargetRecord& record : target_records(line.labels, seafloor_, visibility)) {
      const std::uint32_t instance = record.target.instance;
      line_targets_.emplace(instance, std::move(record));
    }
    add_image(line, line.whole(), line.name, "line");
    add_tiles(line);
    add_chips(line, sonar, geometry);
  }

  void add_tiles(const LabelledImage& line) {
    const TileOptions& tiles = options_.tiles;
    if (!tiles.any()) return;
    const auto [columns, rows] =
        tiles.width_px > 0
            ? std::pair(pixels(tiles.width_px, 1.0), pixels(tiles.height_px, 1.0))
            : std::pair(pixels(tiles.width_m, line.across_m), pixels(tiles.height_m, line.along_m));
    check_fits("dataset.tiles", line, columns, rows);
    std::size_t number = 0;
    for (const std::size_t row : starts(line.labels.rows(), rows))
      for (const std::size_t column : starts(line.labels.columns(), columns))
        add_image(line, {column, row, columns, rows},
                  fmt::format("tiles/{}_{:04}", line.name, number++), "tile");
  }

  /// The number of pixels of a length; the length and the pixel's size have the same unit.
  static std::size_t pixels(double length, double pixel_size) {
    return static_cast<std::size_t>(std::max(1.0, std::round(length / pixel_size)));
  }

  static void check_fits(std::string_view key, const LabelledImage& line, std::size_t columns,
                         std::size_t rows) {
    if (columns > line.labels.columns() || rows > line.labels.rows())
      throw std::invalid_argument(
          fmt::format("'{}' needs {} x {} pixels, but {} has {} x {}; make the tiles or chips "
                      "smaller or the line longer",
                      key, columns, rows, line.name, line.labels.columns(), line.labels.rows()));
  }

  /// The first pixels of the tiles. The last tile ends with the line, unless tiles have gaps.
  std::vector<std::size_t> starts(std::size_t whole, std::size_t tile) const {
    const auto stride = static_cast<std::size_t>(
        std::max(1.0, std::round(options_.tiles.stride * static_cast<double>(tile))));
    std::vector<std::size_t> all;
    for (std::size_t at = 0; at + tile <= whole; at += stride) all.push_back(at);
    if (all.back() + tile < whole && stride <= tile) all.push_back(whole - tile);
    return all;
  }

  void add_chips(const LabelledImage& line, std::size_t sonar, std::size_t geometry) {
    const ChipOptions& chips = options_.chips;
    if (!chips.any()) return;
    const std::size_t columns =
        chips.size_px > 0 ? pixels(chips.size_px, 1.0) : pixels(chips.size_m, line.across_m);
    const std::size_t rows = chips.size_px > 0 ? columns : pixels(chips.size_m, line.along_m);
    check_fits("dataset.chips", line, columns, rows);
    const std::size_t last_column = line.labels.columns() - columns,
                      last_row = line.labels.rows() - rows;
    std::size_t number = 0;
    for (const auto& [instance, record] : line_targets_) {
      const auto [left, top, right, bottom] = bounding_box(record.target);
      // The middle of a large box may not lie on its feature, for example a long trawl mark.
      if (!record.is_object() && (right - left > columns || bottom - top > rows)) continue;
      const auto start = [](std::size_t begin, std::size_t end, std::size_t size,
                            std::size_t last) {
        const std::size_t middle = (begin + end) / 2, half = size / 2;
        return std::min(last, middle > half ? middle - half : 0);
      };
      add_image(line,
                {start(left, right, columns, last_column), start(top, bottom, rows, last_row),
                 columns, rows},
                fmt::format("chips/{}_{:04}", line.name, number++), "chip");
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
        if (std::ranges::any_of(line_targets_, [&](const auto& entry) {
              return entry.second.is_object() && overlap(part, bounding_box(entry.second.target));
            }))
          continue;
        add_image(line, part, fmt::format("chips/{}_background_{:04}", line.name, n), "background");
        break;
      }
    }
  }

  static bool overlap(const Rectangle& part, const std::array<std::size_t, 4>& box) {
    return part.column < box[2] && box[0] < part.column + part.columns && part.row < box[3] &&
           box[1] < part.row + part.rows;
  }

  void add_image(const LabelledImage& line, const Rectangle& part, const std::string& stem,
                 std::string_view kind) {
    const bool whole = kind == "line";
    const LabelledImage cut_out =
        whole ? LabelledImage{"", "", Waterfall(line.labels.sonar, 0), {}, 0, 0} : cut(line, part);
    const LabelledImage& image = whole ? line : cut_out;
    // The run and add_line() have already written the pictures of whole lines in slant range.
    if (!whole || line.geometry != "slant")
      for (std::size_t r = 0; r < image.pictures.size(); ++r)
        write(r == 0 ? stem + ".png" : fmt::format("{}.r{}.png", stem, r),
              encode_png(image.pictures[r]));

    ImageLabels labels{.image = stem,
                       .pictures = {stem + ".png"},
                       .kind = std::string(kind),
                       .geometry = line.geometry,
                       .sonar = line.labels.sonar.name,
                       .column = part.column,
                       .row = part.row,
                       .columns = part.columns,
                       .rows = part.rows,
                       .pixel_across_m = line.across_m,
                       .pixel_along_m = line.along_m,
                       .split = sample_.split};
    for (std::size_t r = 1; r < image.pictures.size(); ++r)
      labels.pictures.push_back(fmt::format("{}.r{}.png", stem, r));
    std::vector<std::uint32_t> left_out;
    std::string yolo;
    for (Target& target : find_targets(image.labels)) {
      TargetLabel label = label_of(std::move(target));
      if (label.ignored)
        left_out.push_back(label.record.target.instance);
      else if (label.record.target.body.area_px > 0)
        yolo += yolo_line(label, part);
      labels.targets.push_back(std::move(label));
    }
    for (const Mask& mask : encode_masks(image.labels, left_out)) {
      write(fmt::format("{}.{}.png", stem, mask.name), mask.png);
      if (mask.name != "class") continue;
      for (const std::uint16_t number : mask.numbers)
        if (number > 0 && number != ignored_class) labels.classes.push_back(classes_[number - 1u]);
    }
    write_text(stem + ".json", labels_json(labels));
    for (const std::string& picture : labels.pictures)
      write_text(picture.substr(0, picture.size() - std::string(".png").size()) + ".txt", yolo);
  }

  /// The label of a target in a part of the line. Position and contrast are measured in the whole
  /// line; the outlines are those in the part.
  TargetLabel label_of(Target shown) const {
    const TargetRecord& whole = line_targets_.at(shown.instance);
    TargetLabel label{.record = whole, .category_id = category(whole.class_name)};
    Target& target = label.record.target;
    target.body = std::move(shown.body);
    target.shadow = std::move(shown.shadow);
    const bool body_lost = whole.target.body.area_px > 0 && target.body.area_px == 0;
    label.shown_fraction = body_lost ? 0.0
                                     : static_cast<double>(shown_part(target).area_px) /
                                           static_cast<double>(shown_part(whole.target).area_px);
    // A feature of the bed is never ignored.
    label.ignored = whole.is_object() && label.shown_fraction < options_.min_visible;
    return label;
  }

  void write_text(const std::string& name, const std::string& text) {
    write(name, std::as_bytes(std::span(text)));
  }

  std::size_t category(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(classes_, name) - classes_.begin()) + 1;
  }

  /// A row of YOLO: class number from 0, then middle and size of the body over the image's size.
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
  const std::vector<std::string>& classes_;  // class number n is classes_[n - 1]
  const Seafloor& seafloor_;
  const std::filesystem::path& folder_;
  std::map<std::uint32_t, TargetRecord> line_targets_;  // in this geometry, by instance
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
