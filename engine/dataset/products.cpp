#include <ensonify/engine/dataset/products.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/output/masks.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/random.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

/// Refuses a seafloor's name that the dataset has no number for.
void check_named(const std::vector<std::string>& own, const std::vector<std::string>& names,
                 std::string_view what) {
  for (std::size_t i = 1; i < own.size(); ++i)
    if (std::ranges::count(names, own[i]) == 0)
      throw std::invalid_argument(
          fmt::format("the {} '{}' of this sample is none that the recipe can draw; name it there",
                      what, own[i]));
}

Json targets_of(const LabelledImage& view, const Seafloor& seafloor) {
  return Json::parse(targets_json(find_targets(view.labels), view.labels, seafloor)).at("targets");
}

/// An object, as against a feature of the bed, such as a trawl mark.
bool is_object(const Json& target) { return target.contains("table"); }

/// What counts as the target's picture: its body, or where that does not show its shadow.
const Json& shown_part(const Json& target) {
  return target.at("body").is_null() ? target.at("shadow") : target.at("body");
}

/// Columns, rows of the box about a target and its shadow, as {first column, first row, end, end}.
std::array<std::size_t, 4> extent(const Json& target) {
  std::array<std::size_t, 4> all{~std::size_t{0}, ~std::size_t{0}, 0, 0};
  for (const char* part : {"body", "shadow"}) {
    if (target.at(part).is_null()) continue;
    const auto box = target.at(part).at("box").get<std::array<std::size_t, 4>>();
    all = {std::min(all[0], box[0]), std::min(all[1], box[1]), std::max(all[2], box[0] + box[2]),
           std::max(all[3], box[1] + box[3])};
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

  void add_line(const Waterfall& line, const Calibration& calibration, std::size_t sonar) {
    read_visible_fractions(line.sonar.name);
    std::vector<Picture> pictures;
    for (const Display& display : sample_.renders)
      pictures.push_back(render(line, display, calibration));
    const LabelledImage slant = slant_view(line, std::move(pictures));
    for (std::size_t r = 1; r < slant.pictures.size(); ++r)
      write(fmt::format("{}.r{}.png", slant.name, r), encode_png(slant.pictures[r]));
    if (options_.slant) add_view(slant, sonar, 0);
    if (options_.ground_px_m > 0.0) add_view(ground_view(slant, options_.ground_px_m), sonar, 1);
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

  /// The run has looked how much of each object is seen, and has just written it.
  void read_visible_fractions(const std::string& sonar) {
    visible_.clear();
    std::ifstream file(folder_ / (sonar + "_targets.json"));
    if (!file) return;  // there are none
    const Json run = Json::parse(file);
    for (const Json& target : run.at("targets"))
      if (is_object(target))
        visible_[target.at("instance").get<int>()] = target.at("visible_fraction");
  }

  void add_view(const LabelledImage& view, std::size_t sonar, std::size_t geometry) {
    whole_.clear();
    for (Json& target : targets_of(view, seafloor_)) {
      const int instance = target.at("instance").get<int>();
      if (visible_.contains(instance)) target["visible_fraction"] = visible_.at(instance);
      whole_[instance] = std::move(target);
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
          fmt::format("'{}' wants {} x {} pixels of {}, which has {} x {}; make them smaller or "
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
    for (const auto& [instance, target] : whole_) {
      const auto [left, top, right, bottom] = extent(target);
      // The middle of a long trawl mark's box is nowhere.
      if (!is_object(target) && (right - left > columns || bottom - top > rows)) continue;
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
              return is_object(entry.second) && meet(part, extent(entry.second));
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

    std::vector<std::uint32_t> left_out;
    Json targets = Json::array();
    std::string yolo;
    for (Json& target : targets_of(piece, seafloor_)) {
      const int instance = target.at("instance").get<int>();
      const Json& all = whole_.at(instance);
      // Its place and contrast are those of the whole line; the outlines of this picture.
      Json label = all;
      for (const char* outline : {"body", "shadow"}) label[outline] = target.at(outline);
      const bool body_lost = !all.at("body").is_null() && label.at("body").is_null();
      const double visible = body_lost ? 0.0
                                       : shown_part(label).at("area_px").get<double>() /
                                             shown_part(all).at("area_px").get<double>();
      // The bed is never ignored.
      const bool ignored = is_object(all) && visible < options_.min_visible;
      label["shown_fraction"] = visible;
      label["truncated"] = visible < 1.0;
      label["ignored"] = ignored;
      label["category_id"] = category(label.at("class").get<std::string>());
      if (ignored)
        left_out.push_back(static_cast<std::uint32_t>(instance));
      else if (!label.at("body").is_null())
        yolo += yolo_line(label, part);
      targets.push_back(std::move(label));
    }
    Json classes = Json::array();
    for (const Mask& mask : encode_masks(piece.labels, left_out)) {
      write(fmt::format("{}.{}.png", stem, mask.name), mask.png);
      if (mask.name != "class") continue;
      for (const std::uint16_t number : mask.numbers)
        if (number > 0 && number != ignored_class) classes.push_back(classes_[number - 1u]);
    }

    std::vector<std::string> pictures{stem + ".png"};
    for (std::size_t r = 1; r < piece.pictures.size(); ++r)
      pictures.push_back(fmt::format("{}.r{}.png", stem, r));
    const Json image = {{"image", stem},
                        {"pictures", pictures},
                        {"kind", kind},
                        {"geometry", view.geometry},
                        {"sonar", view.labels.sonar.name},
                        {"width", part.columns},
                        {"height", part.rows},
                        {"of_line", {part.column, part.row, part.columns, part.rows}},
                        {"pixel_across_m", view.across_m},
                        {"pixel_along_m", view.along_m},
                        {"split", sample_.split},
                        {"classes", classes},
                        {"targets", targets}};
    write_text(stem + ".json", image.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
    for (const std::string& picture : pictures)
      write_text(picture.substr(0, picture.size() - std::string(".png").size()) + ".txt", yolo);
  }

  void write_text(const std::string& name, const std::string& text) {
    write(name, std::as_bytes(std::span(text)));
  }

  std::size_t category(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(classes_, name) - classes_.begin()) + 1;
  }

  /// Class from 0, then the body's middle and size in shares of the picture.
  static std::string yolo_line(const Json& label, const Rectangle& part) {
    const auto box = label.at("body").at("box").get<std::array<double, 4>>();
    const auto width = static_cast<double>(part.columns), height = static_cast<double>(part.rows);
    return fmt::format("{} {:.6f} {:.6f} {:.6f} {:.6f}\n", label.at("category_id").get<int>() - 1,
                       (box[0] + 0.5 * box[2]) / width, (box[1] + 0.5 * box[3]) / height,
                       box[2] / width, box[3] / height);
  }

  const DatasetOptions& options_;
  const SampleScene& sample_;
  const std::vector<std::string>& classes_;  // by their numbers, from 1
  const Seafloor& seafloor_;
  const std::filesystem::path& folder_;
  std::map<int, Json> visible_;  // share of each object that the line sees
  std::map<int, Json> whole_;    // targets of the view at hand, by instance
  double disk_s_ = 0.0;
};

}  // namespace

ProductTimes write_products(const DatasetOptions& options, const SampleScene& sample,
                            const Simulator& simulator, std::span<const Waterfall> lines,
                            const std::filesystem::path& folder) {
  const Clock::time_point start = Clock::now();
  Products products(options, sample, simulator.seafloor(), folder);
  for (std::size_t i = 0; i < lines.size(); ++i)
    products.add_line(lines[i], simulator.calibration(i), i);
  const double all_s = seconds_since(start);
  return {all_s - products.disk_s(), products.disk_s()};
}

}  // namespace ensonify::engine
