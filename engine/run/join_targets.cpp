#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/run/joined_files.h>
#include <ensonify/engine/run/json_record-inl.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t max_columns = 1 << 20;  // more than the picture of any scene has
constexpr std::size_t max_size = std::numeric_limits<std::size_t>::max();

/// The outline of a body or of a shadow in the whole run, joined from the outlines of the parts.
class JoinedOutline {
 public:
  JoinedOutline(std::size_t rows, std::size_t columns) : rows_(rows), columns_(columns) {}

  std::size_t area_px() const { return area_px_; }

  /// Adds an outline in the format of targets_json(). Its row 0 is row `first_row` of the run.
  void add(const Json& outline, std::size_t first_row) {
    if (outline.is_null()) return;
    area_px_ += whole_numbers(outline.at("area_px")).get<std::size_t>();
    const auto box = whole_numbers(outline.at("box")).get<std::array<std::size_t, 4>>();
    const Corner low{box[0], box[1] + first_row}, high{low[0] + box[2], low[1] + box[3]};
    for (std::size_t k : {0u, 1u}) {
      low_[k] = std::min(low_[k], low[k]);
      high_[k] = std::max(high_[k], high[k]);
    }
    const bool has_holes = outline.contains("rle");
    for (const Json& json : whole_numbers(outline.at("polygons"))) {
      auto polygon = json.get<Polygon>();
      if (polygon.size() % 2 != 0)
        throw std::out_of_range("a polygon with an odd number of coordinates");
      for (std::size_t i = 0; i < polygon.size(); i += 2) {
        if (polygon[i] > columns_ || polygon[i + 1] > rows_)
          throw std::out_of_range("a polygon outside its picture");
        polygon[i + 1] += first_row;
      }
      if (!has_holes) fill(polygon);
      polygons_.push_back(std::move(polygon));
    }
    if (has_holes) add_runs(outline.at("rle"), first_row);
    has_holes_ = has_holes_ || has_holes;
  }

  Json json() const {
    if (area_px_ == 0) return nullptr;
    std::vector<Polygon> polygons = polygons_;
    std::ranges::stable_sort(polygons, std::ranges::greater(), area_of);
    Json json = {{"box", {low_[0], low_[1], high_[0] - low_[0], high_[1] - low_[1]}},
                 {"area_px", area_px_},
                 {"polygons", polygons}};
    if (has_holes_) json["rle"] = {{"size", {rows_, columns_}}, {"counts", counts()}};
    return json;
  }

 private:
  using Corner = std::array<std::size_t, 2>;             // column, row
  using Polygon = std::vector<std::size_t>;              // column, row, column, ...
  using PixelRun = std::pair<std::size_t, std::size_t>;  // [begin, end), as in COCO's run lengths

  static std::size_t area_of(const Polygon& polygon) {
    std::uint64_t twice = 0;  // wraps around if the polygon turns in the other direction
    for (std::size_t i = 0; i < polygon.size(); i += 2) {
      const std::size_t next = (i + 2) % polygon.size();
      twice += polygon[i] * polygon[next + 1] - polygon[next] * polygon[i + 1];
    }
    return std::min(twice, -twice) / 2;
  }

  /// Adds the pixels inside a polygon, whose edges follow pixel edges. Ordered by row, the
  /// polygon's horizontal edges in a column alternately begin and end a run of these pixels.
  void fill(const Polygon& polygon) {
    std::map<std::size_t, std::vector<std::size_t>> edges;  // rows by column
    for (std::size_t i = 0; i < polygon.size(); i += 2) {
      const std::size_t next = (i + 2) % polygon.size();
      if (polygon[i + 1] != polygon[next + 1]) continue;
      const auto [from, to] = std::minmax(polygon[i], polygon[next]);
      for (std::size_t column = from; column < to; ++column)
        edges[column].push_back(polygon[i + 1]);
    }
    for (auto& [column, rows] : edges) {
      std::ranges::sort(rows);
      for (std::size_t i = 0; i + 1 < rows.size(); i += 2)
        runs_.emplace_back(column * rows_ + rows[i], column * rows_ + rows[i + 1]);
    }
  }

  void add_runs(const Json& rle, std::size_t first_row) {
    const auto part_rows = whole_numbers(rle.at("size").at(0)).get<std::size_t>();
    if (part_rows == 0 || part_rows > rows_)
      throw std::out_of_range("a picture without rows, or with too many");
    std::size_t at = 0;
    bool inside = false;
    for (const Json& count : whole_numbers(rle.at("counts"))) {
      const std::size_t end = at + count.get<std::size_t>();
      if (end < at || end > part_rows * columns_)
        throw std::out_of_range("runs outside their picture");
      while (inside && at < end) {  // a run may continue in the next column
        const std::size_t column = at / part_rows, row = at % part_rows;
        const std::size_t rows = std::min(end - at, part_rows - row);
        const std::size_t begin = column * rows_ + first_row + row;
        runs_.emplace_back(begin, begin + rows);
        at += rows;
      }
      at = end;
      inside = !inside;
    }
  }

  std::vector<std::size_t> counts() const {
    std::vector<PixelRun> runs = runs_;
    std::ranges::sort(runs);
    std::vector<std::size_t> counts;
    std::size_t counted = 0;
    for (const auto& [begin, end] : runs) {
      if (begin > counted || counts.empty()) {
        counts.push_back(begin - counted);
        counts.push_back(0);
      }
      counts.back() += end - begin;
      counted = end;
    }
    if (counted < rows_ * columns_) counts.push_back(rows_ * columns_ - counted);
    return counts;
  }

  std::size_t rows_, columns_;
  std::size_t area_px_ = 0;
  Corner low_{max_size, max_size}, high_{};
  std::vector<Polygon> polygons_;
  std::vector<PixelRun> runs_;
  bool has_holes_ = false;
};

/// A target's values. Range, ping and contrast are means over the parts, weighted by area. All
/// other values are from the part with the largest area.
class TargetMeans {
 public:
  void add(const Json& target, double area_px) {
    if (area_px > largest_px_) {
      largest_px_ = area_px;
      largest_ = target;
    }
    area_px_ += area_px;
    range_m_ += area_px * target.at("range_m").get<double>();
    ping_ += area_px * target.at("ping").get<double>();
    if (const Json& db = target.at("contrast_db"); !db.is_null()) {
      contrast_px_ += area_px;
      contrast_ += area_px * scatter::from_db(db.get<double>());
    }
  }
  Json json() const {
    Json json = largest_;
    json["range_m"] = range_m_ / area_px_;
    json["ping"] = ping_ / area_px_;
    json["contrast_db"] =
        contrast_px_ > 0.0 ? Json(scatter::to_db(contrast_ / contrast_px_)) : Json(nullptr);
    return json;
  }

 private:
  Json largest_;
  double largest_px_ = 0.0, area_px_ = 0.0, range_m_ = 0.0, ping_ = 0.0;
  double contrast_px_ = 0.0, contrast_ = 0.0;
};

/// A target of the whole run, joined from the targets of the parts.
class JoinedTarget {
 public:
  /// `sights` are of the whole run.
  JoinedTarget(std::size_t rows, std::size_t columns, const TargetSights& sights)
      : body_(rows, columns), shadow_(rows, columns), sights_(sights) {}

  void add(const Json& target, std::size_t first_row) {
    const Json &body = target.at("body"), &shadow = target.at("shadow");
    body_.add(body, first_row);
    shadow_.add(shadow, first_row);
    // Means over the shadow are used only for targets without a body.
    TargetMeans& means = body.is_null() ? of_shadow_ : of_body_;
    means.add(target, (body.is_null() ? shadow : body).at("area_px").get<double>());
  }

  Json json(std::span<const ObjectVisibility> visibility) const {
    const bool seen = body_.area_px() > 0;
    Json json = (seen ? of_body_ : of_shadow_).json();
    const Sight& sight = seen ? sights_.body : sights_.shadow;
    json["side"] = sight.sector();
    if (json.contains("aspect_deg"))  // of an object
      json["aspect_deg"] =
          turned_deg(sight.direction_rad() - json.at("heading_deg").get<double>() * degree);
    if (json.contains("visible_fraction")) {
      const std::size_t object = whole_numbers(json.at("instance")).get<std::size_t>() - 1;
      const bool counted = object < visibility.size() && visibility[object].alone > 0;
      json["visible_fraction"] = counted ? Json(visibility[object].share()) : Json(nullptr);
    }
    json["body"] = body_.json();
    json["shadow"] = shadow_.json();
    return json;
  }

 private:
  JoinedOutline body_, shadow_;
  TargetSights sights_;
  TargetMeans of_body_, of_shadow_;
};

}  // namespace

std::string join_targets(const fs::path& folder, const RunParts& parts, const std::string& sonar,
                         std::span<const ObjectVisibility> visibility,
                         const std::map<std::uint32_t, TargetSights>& sights) {
  std::map<std::uint32_t, JoinedTarget> targets;
  Json whole;
  std::size_t beams = 1;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const auto add = [&](const Json& json) {
      const auto columns = whole_numbers(json.at("picture").at("columns"), max_columns);
      if (part == 0) {
        whole = json;
        beams = whole_numbers(json.at("picture").at("rows")).get<std::size_t>() /
                parts.range(part).count;
        whole["picture"]["rows"] = beams * parts.pings();
        if (const std::size_t group = pings_per_row(beams * parts.pings()); group > 1)
          whole["picture"]["pings_per_row"] = group;
      }
      for (const Json& target : json.at("targets")) {
        const auto instance = whole_numbers(target.at("instance"), max_labels).get<std::uint32_t>();
        targets
            .try_emplace(instance, beams * parts.pings(), columns.get<std::size_t>(),
                         sights.at(instance))
            .first->second.add(target, beams * (parts.pings() - parts.range(part).end()));
      }
    };
    read_json_record(folder / parts.file(part, sonar, "_targets.json"), "targets of a part",
                     make_part_again, add);
  }
  Json& list = whole["targets"] = Json::array();
  for (const auto& [instance, target] : targets) list.push_back(target.json(visibility));
  return json_text(whole, 1) + "\n";
}

}  // namespace ensonify::engine
