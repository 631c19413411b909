#include <ensonify/engine/dataset/products.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/dataset/chips.h>
#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/dataset/piece_sizes.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/fan_picture.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/output/masks.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
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

class Products {
 public:
  Products(const DatasetOptions& options, const SampleScene& sample, const Seafloor& seafloor,
           const std::filesystem::path& folder, const ProductsControl& control)
      : options_(options),
        sample_(sample),
        seafloor_(seafloor),
        folder_(folder),
        control_(control) {
    check_numbered(seafloor.classes, classes_, "class");
    check_numbered(seafloor.materials, sample.scene.output.sediment_names, "material");
    for (std::vector<std::string>* list : {&names_.classes, &names_.materials})
      list->insert(list->begin(), "none");
  }

  /// Writes the products of one sonar's line. The run's picture of it has the scene's display,
  /// which is the first of the sample's displays. The line of an imaging sonar is a clip: its
  /// products are those of its frames.
  void add_line(const RunOutputs& run, std::size_t sonar) {
    const Waterfall& line = run.lines[sonar];
    std::vector<Picture> pictures{run.pictures[sonar]};
    for (std::size_t r = 1; r < sample_.renders.size(); ++r)
      pictures.push_back(render(line, sample_.renders[r], run.simulator.calibration(sonar)));
    if (line.sonar.steers()) return add_frames(line, pictures);
    const LabelledImage slant = slant_view(line, std::move(pictures));
    for (std::size_t r = 1; r < slant.pictures.size(); ++r)
      write(fmt::format("{}.r{}.png", slant.name, r), encode_png(slant.pictures[r]));
    cut_ = targets_at_edges(slant.labels);
    if (options_.slant) add_geometry(slant, run.targets[sonar], sonar, 0);
    if (options_.ground_px_m > 0.0) {
      const LabelledImage ground =
          ground_view(slant, options_.ground_px_m, control_.memory, control_.stop_check);
      add_geometry(ground, target_records(ground.labels, seafloor_, run.object_visibility[sonar]),
                   sonar, 1);
    }
  }

  double disk_s() const { return disk_s_; }

 private:
  void check_stop() const {
    if (control_.stop_check) control_.stop_check();
  }

  void write(const std::string& name, std::span<const std::byte> content) {
    check_stop();
    const Clock::time_point start = Clock::now();
    const std::filesystem::path file = folder_ / name;
    std::filesystem::create_directories(file.parent_path());
    refine::write_staged(file, content);
    disk_s_ += seconds_since(start);
  }

  /// Writes all images of a line in one geometry: 0 is slant range, 1 is ground range.
  void add_geometry(const LabelledImage& line, std::span<const TargetRecord> targets,
                    std::size_t sonar, std::size_t geometry) {
    set_targets(targets);
    write_image(line, line.whole(), line, line.name, "line");
    add_tiles(line);
    add_chips(line, sonar, geometry);
  }

  /// Writes each frame in both geometries.
  void add_frames(const Waterfall& line, const std::vector<Picture>& pictures) {
    const FanPicture fan(line.sonar);
    const std::size_t frames = line.rows() / static_cast<std::size_t>(line.sonar.beams);
    for (std::size_t ping = 0; ping < frames; ++ping) {
      const LabelledImage frame = frame_view(line, ping, pictures);
      cut_ = targets_at_edges(frame.labels);
      set_targets(target_records(frame.labels, seafloor_));
      write_image(frame, frame.whole(), frame, "frames/" + frame.name, "frame");
      write_image(frame, frame.whole(), fan_view(frame, fan), "frames/" + frame.name + "_fan",
                  "frame");
    }
  }

  void set_targets(std::span<const TargetRecord> targets) {
    line_targets_.clear();
    for (const TargetRecord& record : targets)
      line_targets_.emplace(record.target.instance, record);
  }

  void add_tiles(const LabelledImage& line) {
    const TileOptions& tiles = options_.tiles;
    const std::optional<PieceSize> tile = tile_size(tiles, line.size());
    if (!tile) return;
    const auto [columns, rows] = *tile;
    std::size_t number = 0;
    for (const std::size_t row : starts(line.labels.rows(), rows))
      for (const std::size_t column : starts(line.labels.columns(), columns)) {
        check_stop();  // tiles may be left out by the million
        const Rectangle part{column, row, columns, rows};
        if (tiles.least_bed > 0.0 && bed_share(line, part) < tiles.least_bed) continue;
        add_image(line, part, fmt::format("tiles/{}_{:04}", line.name, number++), "tile");
      }
  }

  /// The first pixel of each tile on one axis. Without gaps the last tile ends with the line.
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
    const bool relative = !chips.margin.empty() || chips.size_m > 0.0;
    std::map<std::string, std::size_t> numbers;
    for (const Chip& chip : choose_chips(line, line_targets_, classes_, options_,
                                         {sample_.scene.seed, sonar, geometry})) {
      const std::string stem =
          fmt::format("chips/{}_{}{:04}", line.name, chip.kind == "chip" ? "" : chip.kind + "_",
                      numbers[chip.kind]++);
      add_image(line, chip.part, stem, chip.kind,
                relative ? static_cast<std::size_t>(chips.size_px) : 0, chip);
    }
  }

  /// Writes the pictures and labels of a part of a line. With edge_px > 0 they are resampled to a
  /// square of edge_px x edge_px pixels.
  void add_image(const LabelledImage& line, const Rectangle& part, const std::string& stem,
                 std::string_view kind, std::size_t edge_px = 0, const Chip& chip = {}) {
    const LabelledImage cut_out = cut(line, part);
    if (edge_px > 0)
      write_image(line, part, resampled(cut_out, edge_px, edge_px), stem, kind, &cut_out, chip);
    else
      write_image(line, part, cut_out, stem, kind, &cut_out, chip);
  }

  /// Writes an image that shows a part of a line, perhaps with other pixels. `cut_out` has the
  /// part's own pixels; null: the part is the whole line.
  void write_image(const LabelledImage& line, const Rectangle& part, const LabelledImage& image,
                   const std::string& stem, std::string_view kind,
                   const LabelledImage* cut_out = nullptr, const Chip& chip = {}) {
    const LabelledImage& shown = cut_out ? *cut_out : line;
    ImageLabels labels{.image = stem,
                       .pictures = {stem + ".png"},
                       .kind = std::string(kind),
                       .of = chip.of,
                       .of_instance = chip.instance,
                       .geometry = image.geometry,
                       .sonar = line.labels.sonar.name,
                       .column = part.column,
                       .row = part.row,
                       .columns = part.columns,
                       .rows = part.rows,
                       .width = image.labels.columns(),
                       .height = image.labels.rows(),
                       .pixel_across_m = image.across_m,
                       .pixel_along_m = image.along_m,
                       .seen_from = geometry_of(line, part),
                       .split = sample_.split};
    if (kind == "frame") describe_frame(image, labels);
    for (std::size_t r = 1; r < image.pictures.size(); ++r)
      labels.pictures.push_back(fmt::format("{}.r{}.png", stem, r));
    // The run and add_line() have already written the pictures of whole lines in slant range.
    if (kind != "line" || line.geometry != "slant")
      for (std::size_t r = 0; r < image.pictures.size(); ++r)
        write(labels.pictures[r], encode_png(image.pictures[r]));
    std::map<std::uint32_t, TargetLabel> labels_shown;
    if (!cut_out)
      for (const auto& [instance, record] : line_targets_)
        labels_shown.emplace(instance,
                             label_of(instance, static_cast<const TargetOutlines&>(record.target)));
    else
      for (auto& [instance, outlines] : find_outlines(shown.labels))
        labels_shown.emplace(instance, label_of(instance, std::move(outlines)));
    if (&image != &shown) labels_shown = with_outlines_in(image.labels, std::move(labels_shown));
    write_labels(image, labels, std::move(labels_shown));
  }

  /// Writes the masks of an image and the files of its labels.
  void write_labels(const LabelledImage& image, ImageLabels& labels,
                    std::map<std::uint32_t, TargetLabel> labels_shown) {
    MaskOptions masks{.shadow_class = static_cast<std::uint16_t>(shadow_class_), .names = names_};
    std::string yolo;
    for (auto& [instance, label] : labels_shown) {
      if (label.ignored) {
        masks.ignored.push_back(instance);
      } else {
        yolo += yolo_line(label.category_id, label.record.target.body, labels);
        if (shadow_class_ > 0) yolo += yolo_line(shadow_class_, label.record.target.shadow, labels);
      }
      if (labels.frame) label.bearing_rad = bearing_of(label.record.target, image.labels);
      labels.targets.push_back(std::move(label));
    }
    const Masks encoded = encode_masks(image.labels, masks);
    for (const Mask& mask : encoded.files)
      write(fmt::format("{}.{}.png", labels.image, mask.name), mask.png);
    for (const std::uint16_t number : encoded.class_numbers)
      if (number > 0 && number != ignored_class) labels.classes.push_back(classes_[number - 1u]);
    write_text(labels.image + ".json", labels_json(labels));
    for (const std::string& picture : labels.pictures)
      write_text(picture.substr(0, picture.size() - std::string(".png").size()) + ".txt", yolo);
  }

  /// What the labels of a frame have of their own.
  static void describe_frame(const LabelledImage& image, ImageLabels& labels) {
    const Sonar& sonar = image.labels.sonar;
    labels.frame = image.labels.pings.front().number / static_cast<std::size_t>(sonar.beams);
    labels.seen_from.sides = sonar.sectors().front().name;
    if (image.geometry != "fan") return;
    labels.seen_from.right_m = 0.5 * static_cast<double>(labels.width) * image.across_m;
    labels.seen_from.left_m = -labels.seen_from.right_m;
  }

  /// The bearing of a target of a frame, from -pi to pi.
  static double bearing_of(const Target& target, const Waterfall& frame) {
    const double ahead_rad = mounted(frame.pings.front().pose, frame.sonar.mounting).heading_rad;
    return std::remainder(target.sight.direction_rad() - ahead_rad, 2.0 * std::numbers::pi);
  }

  /// The place of the sonar, and the part of its swath that a part of a line shows.
  static ImageGeometry geometry_of(const LabelledImage& line, const Rectangle& part) {
    const Waterfall& labels = line.labels;
    const std::size_t lowest = labels.rows() - part.row - part.rows;  // oldest ping
    double altitude_sum_m = 0.0;
    int with_altitude = 0;
    std::size_t first = labels.pings[lowest].number, last = first;  // rows of beams may overlap
    for (std::size_t row = lowest; row < lowest + part.rows; ++row) {
      if (const double altitude_m = labels.sonar_altitude_m(row); !std::isnan(altitude_m)) {
        altitude_sum_m += altitude_m;
        ++with_altitude;
      }
      first = std::min(first, labels.pings[row].number);
      last = std::max(last, labels.pings[row].number);
    }
    const Sides sides = labels.sonar.sides;
    const LineLayout layout = labels.layout();
    const auto nadir = static_cast<double>(layout.mirrored(0) ? layout.bins() : 0);
    const auto across_m = [&](std::size_t column) {
      return (static_cast<double>(column) - nadir) * line.across_m;
    };
    return {.frequency_hz = labels.sonar.frequency_hz,
            .range_m = labels.sonar.range_m,
            .sides = std::string(name_of(sides)),
            .left_m = across_m(part.column),
            .right_m = across_m(part.column + part.columns),
            .first_ping = first,
            .last_ping = last,
            .altitude_m = altitude_sum_m / with_altitude,  // not a number over a hole alone
            .middle = labels.pings[lowest + part.rows / 2].pose};
  }

  /// The label of a target in a part of the line. Position and contrast are of the whole line;
  /// `shown` are the outlines in the part.
  TargetLabel label_of(std::uint32_t instance, TargetOutlines shown) const {
    const TargetRecord& whole = line_targets_.at(instance);
    TargetLabel label{.record = whole, .category_id = category(whole.class_name)};
    Target& target = label.record.target;
    static_cast<TargetOutlines&>(target) = std::move(shown);
    const bool body_lost = whole.target.body.area_px > 0 && target.body.area_px == 0;
    label.shown_fraction = body_lost ? 0.0
                                     : static_cast<double>(shown_part(target).area_px) /
                                           static_cast<double>(shown_part(whole.target).area_px);
    label.truncated = label.shown_fraction < 1.0 || cut_.contains(instance);
    label.ignored = (whole.is_object() && label.shown_fraction < options_.min_visible) ||
                    is_too_small(label.record, options_);
    return label;
  }

  void write_text(const std::string& name, const std::string& text) {
    write(name, std::as_bytes(std::span(text)));
  }

  /// The labels of those targets that the resampled image shows, with their outlines in it.
  std::map<std::uint32_t, TargetLabel> with_outlines_in(
      const Waterfall& resampled, std::map<std::uint32_t, TargetLabel> labels) const {
    std::map<std::uint32_t, TargetLabel> seen;
    for (auto& [instance, outlines] : find_outlines(resampled)) {
      TargetLabel& label = seen[instance] = std::move(labels.at(instance));
      static_cast<TargetOutlines&>(label.record.target) = std::move(outlines);
      label.ignored = label.ignored || is_too_small(label.record, options_);
    }
    return seen;
  }

  std::size_t category(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(classes_, name) - classes_.begin()) + 1;
  }

  /// A row of YOLO's box format: class number from 0, then middle and size of the box, divided by
  /// the image's size. Empty for an outline without pixels.
  static std::string yolo_line(std::size_t category, const Outline& shown,
                               const ImageLabels& image) {
    if (shown.area_px == 0) return "";
    const auto middle_and_size = [&](std::size_t i, std::size_t pixels) {
      const double low = shown.low[i], size = shown.high[i] - shown.low[i],
                   all = static_cast<double>(pixels);
      return std::pair((low + 0.5 * size) / all, size / all);
    };
    const auto [x, width] = middle_and_size(0, image.width);
    const auto [y, height] = middle_and_size(1, image.height);
    return fmt::format("{} {:.6f} {:.6f} {:.6f} {:.6f}\n", category - 1, x, y, width, height);
  }

  const DatasetOptions& options_;
  const SampleScene& sample_;
  // Class number n is classes_[n - 1].
  const std::vector<std::string>& classes_ = sample_.scene.output.class_names;
  // The constructor adds "none" in front of both lists.
  LabelNames names_{classes_, sample_.scene.output.sediment_names};
  // Number of the class of shadows; 0: none.
  const std::size_t shadow_class_ = options_.shadow_class ? category(std::string(shadow_name)) : 0;
  const Seafloor& seafloor_;
  const std::filesystem::path& folder_;
  const ProductsControl& control_;
  std::map<std::uint32_t, TargetRecord> line_targets_;  // of the line in this geometry, by instance
  std::set<std::uint32_t> cut_;                         // targets_at_edges() of the line
  double disk_s_ = 0.0;
};

}  // namespace

double write_products(const DatasetOptions& options, const SampleScene& sample,
                      const RunOutputs& outputs, const std::filesystem::path& folder,
                      const ProductsControl& control) {
  Products products(options, sample, outputs.simulator.seafloor(), folder, control);
  for (std::size_t i = 0; i < outputs.lines.size(); ++i) products.add_line(outputs, i);
  return products.disk_s();
}

}  // namespace ensonify::engine
