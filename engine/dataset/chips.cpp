#include <ensonify/engine/dataset/chips.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/dataset/piece_sizes.h>

namespace ensonify::engine {
namespace {

/// Columns and rows [low, high) of the picture.
struct Box {
  std::array<std::size_t, 2> low{~std::size_t{0}, ~std::size_t{0}}, high{0, 0};

  void extend(const Outline& part) {
    if (part.area_px == 0) return;
    for (std::size_t i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], static_cast<std::size_t>(part.low[i]));
      high[i] = std::max(high[i], static_cast<std::size_t>(part.high[i]));
    }
  }
  void extend(std::size_t column, std::size_t row) {
    low = {std::min(low[0], column), std::min(low[1], row)};
    high = {std::max(high[0], column + 1), std::max(high[1], row + 1)};
  }
  std::size_t columns() const { return high[0] - low[0]; }
  std::size_t rows() const { return high[1] - low[1]; }
};

/// What resembles a target: a target of a class that is not chosen, or connected pixels of the bed.
struct Lookalike {
  const Target* target = nullptr;
  Box box;
  std::size_t area_px = 0;
  std::vector<std::size_t> pixels;  ///< row * columns + column of the picture; empty for a target
};

/// The first pixel of a chip with `length` pixels, on one axis of a line with `line` pixels. The
/// chip's middle is as near as possible to the middle of [low, high), with two conditions: the chip
/// shows all of [must_low, must_high), which is not longer than the chip, and it lies in the line.
std::size_t start_of(std::size_t low, std::size_t high, std::size_t must_low, std::size_t must_high,
                     std::size_t length, std::size_t line) {
  const auto number = [](std::size_t pixels) { return static_cast<std::ptrdiff_t>(pixels); };
  const std::ptrdiff_t centred = number((low + high) / 2) - number(length / 2);
  const std::ptrdiff_t showing =
      std::clamp(centred, number(must_high) - number(length), number(must_low));
  return static_cast<std::size_t>(
      std::clamp(showing, std::ptrdiff_t{0}, number(line) - number(length)));
}

/// Numbers that are added to the line's geometry (0 or 1), so that each use has separate streams.
enum StreamUse : std::size_t { for_backgrounds = 0, for_margins = 2, for_hard_negatives = 4 };

/// In each stream the numbers before this index are for places. The number at this index is for a
/// margin or for the choice of a size.
constexpr std::uint64_t margin_draw = 1000;

constexpr std::size_t smallest_lookalike_px = 8;
/// Candidates are the largest lookalikes of each class: this many for each hard negative.
constexpr std::size_t lookalikes_per_chip = 4;

/// The index from 0 to count - 1 that a number in (0, 1] chooses.
std::size_t index(double share, std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(share * static_cast<double>(count)));
}

class Chooser {
 public:
  Chooser(const LabelledImage& line, const std::map<std::uint32_t, TargetRecord>& targets,
          const std::vector<std::string>& classes, const DatasetOptions& dataset,
          const ImageNumber& image)
      : line_(line), targets_(targets), classes_(classes), dataset_(dataset), image_(image) {}

  std::vector<Chip> choose() {
    for (const auto& [instance, record] : targets_) add_target(instance, record);
    const std::size_t targets = chips_.size();
    for (int n = 0; n < options_.backgrounds; ++n) add_background(targets, n);
    add_hard_negatives();
    return std::move(chips_);
  }

 private:
  RandomStream stream(StreamUse use, std::uint64_t number) const {
    return {image_.seed, Purpose::background_chip, {image_.sonar, image_.geometry + use, number}};
  }

  std::string class_name(std::uint32_t number) const { return classes_.at(number - 1); }

  bool is_chosen(const TargetRecord& record) const {
    return options_.classes.empty() || std::ranges::count(options_.classes, record.class_name) > 0;
  }

  Box box_of(const Target& target) const {
    Box box;
    box.extend(target.body);
    if (options_.with_shadow || target.body.area_px == 0) box.extend(target.shadow);
    return box;
  }

  /// The size of the chip about a box. If the size is relative to the box, the chip is a square in
  /// metres and not larger than the line, and `number` chooses the margin.
  Rectangle size_about(const Box& box, StreamUse use, std::uint64_t number) const {
    if (fixed_) return {0, 0, fixed_->columns, fixed_->rows};
    std::array<double, 1> u{};
    stream(use, number).uniform(u, margin_draw);
    const double least = options_.margin.front(), most = options_.margin.back();
    const double margin = least + (most - least) * u[0];
    const double longer_m = std::max(static_cast<double>(box.columns()) * line_.across_m,
                                     static_cast<double>(box.rows()) * line_.along_m);
    const double edge_m =
        std::min({(1.0 + 2.0 * margin) * longer_m, static_cast<double>(columns_) * line_.across_m,
                  static_cast<double>(rows_) * line_.along_m});
    return {0, 0, std::min(columns_, pixels_of(edge_m, line_.across_m)),
            std::min(rows_, pixels_of(edge_m, line_.along_m))};
  }

  /// A chip of this size about a box. It shows all of `must`, which is not larger than the chip.
  Rectangle about(const Box& box, const Box& must, Rectangle size) const {
    size.column =
        start_of(box.low[0], box.high[0], must.low[0], must.high[0], size.columns, columns_);
    size.row = start_of(box.low[1], box.high[1], must.low[1], must.high[1], size.rows, rows_);
    return size;
  }

  /// A chip of this size about a target, with the whole body and as much of the shadow as there is
  /// room for. On an axis on which the body is longer than the chip, the chip's middle is the
  /// body's pixel that is nearest to the middle of the body's box. (The middle of the box itself
  /// may be outside a bent body.)
  Rectangle about_target(const Target& target, const Rectangle& size) const {
    Box whole = box_of(target), body;
    body.extend(shown_part(target));
    const std::array<std::size_t, 2> length{size.columns, size.rows};
    if (is_larger(body, size)) {
      const std::array<std::size_t, 2> pixel = middle_pixel(target, body);
      for (std::size_t i = 0; i < 2; ++i)
        if (body.high[i] - body.low[i] > length[i]) {
          whole.low[i] = body.low[i] = pixel[i];
          whole.high[i] = body.high[i] = pixel[i] + 1;
        }
    }
    return about(whole, body, size);
  }

  /// Whether a box needs more columns or rows than a chip has.
  static bool is_larger(const Box& box, const Rectangle& size) {
    return box.columns() > size.columns || box.rows() > size.rows;
  }

  /// Column and row of the pixel of shown_part(target) that is nearest to the middle of its box.
  std::array<std::size_t, 2> middle_pixel(const Target& target, const Box& box) const {
    const BinLayers& layers = line_.labels.pixels;
    const bool of_shadow = target.body.area_px == 0;
    const auto shows_it = [&](std::size_t i) {
      const bool in_shadow = static_cast<Region>(layers.region[i]) == Region::shadow;
      return in_shadow == of_shadow &&
             (of_shadow ? layers.shadow_instance : layers.instance)[i] == target.instance;
    };
    const auto off = [&](std::size_t at,
                         std::size_t i) {  // distance from the middle in half pixels
      return static_cast<double>(2 * at + 1) - static_cast<double>(box.low[i] + box.high[i]);
    };
    std::array<std::size_t, 2> nearest = box.low;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t row = box.low[1]; row < box.high[1]; ++row)
      for (std::size_t column = box.low[0]; column < box.high[0]; ++column) {
        const double distance = std::hypot(off(column, 0), off(row, 1));
        if (distance >= least || !shows_it(line_.flipped(row, column))) continue;
        least = distance;
        nearest = {column, row};
      }
    return nearest;
  }

  void add_target(std::uint32_t instance, const TargetRecord& record) {
    if (!is_chosen(record) || is_too_small(record, dataset_) ||
        record.target.body.area_px < static_cast<std::size_t>(options_.least_px))
      return;
    const Rectangle size = size_about(box_of(record.target), for_margins, instance);
    Box body;
    body.extend(shown_part(record.target));
    // A feature larger than the chip, for example a trawl mark, cannot be recognised in it.
    if (!record.is_object() && is_larger(body, size)) return;
    chips_.push_back({about_target(record.target, size), "chip", record.class_name, instance});
  }

  /// Whether the rectangle contains no pixel of a target or its shadow. If `of_any` is false, only
  /// targets of the chosen classes count.
  bool is_free(const Rectangle& part, bool of_any) const {
    const BinLayers& layers = line_.labels.pixels;
    const auto matters = [&](std::uint32_t instance) {
      if (instance == 0) return false;
      const auto found = targets_.find(instance);
      return found != targets_.end() && (of_any || is_chosen(found->second));
    };
    for (std::size_t row = part.row; row < part.row + part.rows; ++row)
      for (std::size_t column = part.column; column < part.column + part.columns; ++column) {
        const std::size_t i = line_.flipped(row, column);
        if (matters(layers.instance[i]) || matters(layers.shadow_instance[i])) return false;
      }
    return true;
  }

  /// Adds a chip at a random place, with the fixed size or that of one of the first `targets`
  /// chips.
  void add_background(std::size_t targets, int number) {
    constexpr int tries = 200;
    const RandomStream places = stream(for_backgrounds, static_cast<std::uint64_t>(number));
    for (int t = 0; t < tries; ++t) {
      std::array<double, 2> u{};
      places.uniform(u, 2 * static_cast<std::uint64_t>(t));
      Rectangle part;
      if (fixed_) {
        part = {0, 0, fixed_->columns, fixed_->rows};
      } else {
        if (targets == 0) return;
        std::array<double, 1> which{};
        places.uniform(which, margin_draw);
        part = chips_[index(which[0], targets)].part;
      }
      part.column = index(u[0], columns_ - part.columns + 1);
      part.row = index(u[1], rows_ - part.rows + 1);
      constexpr double least_bed = 0.5;
      if (!is_free(part, true) || bed_share(line_, part) < least_bed) continue;
      chips_.push_back({part, "background", "", 0});
      return;
    }
  }

  void add_hard_negatives() {
    const auto wanted = static_cast<std::size_t>(options_.hard_negatives);
    if (wanted == 0) return;
    std::map<std::string, std::vector<Lookalike>> kinds = lookalikes(lookalikes_per_chip * wanted);
    std::size_t made = 0;
    for (std::uint64_t draw = 0; made < wanted && !kinds.empty(); ++draw) {
      std::array<double, 3> u{};
      stream(for_hard_negatives, draw).uniform(u);
      const auto kind = std::next(kinds.begin(), std::ptrdiff_t(index(u[0], kinds.size())));
      auto& [of, alike] = *kind;
      const auto chosen = alike.begin() + std::ptrdiff_t(index(u[1], alike.size()));
      const Rectangle part = about_lookalike(*chosen, draw, u[2]);
      if (is_free(part, false)) {
        chips_.push_back(
            {part, "hard_negative", of, chosen->target ? chosen->target->instance : 0});
        ++made;
      }
      alike.erase(chosen);
      if (alike.empty()) kinds.erase(kind);
    }
  }

  /// A chip about a lookalike: a target as in about_target(); pixels of the bed with their middle,
  /// or with one of them if they do not fit into the chip (`share` chooses it).
  Rectangle about_lookalike(const Lookalike& alike, std::uint64_t number, double share) const {
    const Rectangle size = size_about(alike.box, for_hard_negatives, number);
    if (alike.target) return about_target(*alike.target, size);
    if (!is_larger(alike.box, size)) return about(alike.box, alike.box, size);
    const std::size_t pixel = alike.pixels[index(share, alike.pixels.size())];
    Box one_pixel;
    one_pixel.extend(pixel % columns_, pixel / columns_);
    return about(one_pixel, one_pixel, size);
  }

  /// By class, or "shadow": the largest lookalikes, at most `most`.
  std::map<std::string, std::vector<Lookalike>> lookalikes(std::size_t most) const {
    std::map<std::string, std::vector<Lookalike>> kinds;
    const std::size_t least =
        std::max(smallest_lookalike_px, static_cast<std::size_t>(options_.least_px));
    for (const auto& [instance, record] : targets_) {
      const std::size_t area = record.target.body.area_px;
      if (!is_chosen(record) && !is_too_small(record, dataset_) && area >= least)
        kinds[record.class_name].push_back({&record.target, box_of(record.target), area, {}});
    }
    for (auto& [of, group] : groups_of_bed())
      if (group.area_px >= least) kinds[of].push_back(std::move(group));
    for (auto& [of, alike] : kinds) {
      std::ranges::stable_sort(alike, std::greater{}, &Lookalike::area_px);
      alike.resize(std::min(alike.size(), most));
    }
    return kinds;
  }

  /// Each group of connected pixels that are shadows of the relief, or ground of a class other than
  /// "seabed"; with "shadow" or the class.
  std::vector<std::pair<std::string, Lookalike>> groups_of_bed() const {
    const BinLayers& layers = line_.labels.pixels;
    constexpr std::uint32_t nothing = ~0u, shadow = ~0u - 1;
    const auto what = [&](std::size_t pixel) {
      const std::size_t i = line_.flipped(pixel / columns_, pixel % columns_);
      if (static_cast<Region>(layers.region[i]) == Region::shadow)
        return layers.shadow_instance[i] == 0 ? shadow : nothing;
      const bool is_bed =
          static_cast<Region>(layers.region[i]) == Region::seabed && layers.instance[i] == 0;
      return is_bed && class_name(layers.class_id[i]) != "seabed" ? layers.class_id[i] : nothing;
    };
    std::vector<std::pair<std::string, Lookalike>> groups;
    std::vector<bool> done(rows_ * columns_);
    for (std::size_t first = 0; first < done.size(); ++first) {
      const std::uint32_t kind = done[first] ? nothing : what(first);
      if (kind == nothing) continue;
      Lookalike& group =
          groups.emplace_back(kind == shadow ? "shadow" : class_name(kind), Lookalike{}).second;
      std::vector<std::size_t> open{first};
      done[first] = true;
      while (!open.empty()) {
        const std::size_t pixel = open.back(), column = pixel % columns_, row = pixel / columns_;
        open.pop_back();
        group.pixels.push_back(pixel);
        ++group.area_px;
        group.box.extend(column, row);
        const auto visit = [&](std::size_t neighbour) {
          if (done[neighbour] || what(neighbour) != kind) return;
          done[neighbour] = true;
          open.push_back(neighbour);
        };
        if (column > 0) visit(pixel - 1);
        if (column + 1 < columns_) visit(pixel + 1);
        if (row > 0) visit(pixel - columns_);
        if (row + 1 < rows_) visit(pixel + columns_);
      }
    }
    return groups;
  }

  const LabelledImage& line_;
  const std::map<std::uint32_t, TargetRecord>& targets_;
  const std::vector<std::string>& classes_;
  const DatasetOptions& dataset_;
  const ChipOptions& options_ = dataset_.chips;
  const ImageNumber image_;
  const std::size_t columns_ = line_.labels.columns(), rows_ = line_.labels.rows();
  // The size of all chips; none: sizes are relative to boxes.
  const std::optional<PieceSize> fixed_ = chip_size(options_, line_.size());
  std::vector<Chip> chips_;
};

}  // namespace

bool is_too_small(const TargetRecord& record, const DatasetOptions& options) {
  return record.is_object() &&
         record.target.body.area_px < static_cast<std::size_t>(options.least_px);
}

std::vector<Chip> choose_chips(const LabelledImage& line,
                               const std::map<std::uint32_t, TargetRecord>& targets,
                               const std::vector<std::string>& classes,
                               const DatasetOptions& options, const ImageNumber& image) {
  return Chooser(line, targets, classes, options, image).choose();
}

}  // namespace ensonify::engine
