#include <ensonify/engine/run/join_targets.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/json_text.h>
#include <ensonify/engine/output/targets_json.h>
#include <ensonify/engine/run/join_pictures.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/units.h>
#include <ensonify/engine/untrusted.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t max_columns = 1 << 20;  // more than any scene's

/// Pixels [begin, end) of a picture, counted column by column from the top.
struct PixelRun {
  std::size_t begin = 0, end = 0;
};

/// A body or a shadow, put together from those of the parts, in the rows of the whole run.
class JoinedOutline {
 public:
  JoinedOutline(std::size_t rows, std::size_t columns) : rows_(rows), columns_(columns) {}

  std::size_t area_px() const { return area_px_; }

  /// Adds an outline of targets_json() whose rows begin at `first_row` of the run.
  void add(const Json& outline, std::size_t first_row) {
    if (outline.is_null()) return;
    const auto area = whole_numbers(outline.at("area_px")).get<std::size_t>();
    const auto box = whole_numbers(outline.at("box")).get<std::array<std::size_t, 4>>();
    const std::array<std::size_t, 4> its{box[0], box[1] + first_row, box[0] + box[2],
                                         box[1] + first_row + box[3]};
    if (area_px_ == 0) corners_ = its;
    for (std::size_t k : {0u, 1u}) corners_[k] = std::min(corners_[k], its[k]);
    for (std::size_t k : {2u, 3u}) corners_[k] = std::max(corners_[k], its[k]);
    area_px_ += area;
    std::vector<std::vector<std::size_t>> polygons;
    whole_numbers(outline.at("polygons")).get_to(polygons);
    for (std::vector<std::size_t>& polygon : polygons) {
      if (polygon.size() % 2 != 0)
        throw std::runtime_error("a polygon with an odd number of coordinates");
      for (std::size_t i = 0; i < polygon.size(); i += 2) {
        if (polygon[i] > columns_ || polygon[i + 1] > rows_)
          throw std::runtime_error("a polygon outside its picture");
        polygon[i + 1] += first_row;
      }
      if (!outline.contains("rle")) fill(polygon);
      polygons_.push_back(std::move(polygon));
    }
    if (outline.contains("rle")) {
      holes_ = true;
      add_runs(outline.at("rle"), first_row);
    }
  }

  Json json() const {
    if (area_px_ == 0) return nullptr;
    std::vector<std::vector<std::size_t>> polygons = polygons_;
    std::ranges::stable_sort(polygons, std::ranges::greater(), area_of);
    Json json = {
        {"box", {corners_[0], corners_[1], corners_[2] - corners_[0], corners_[3] - corners_[1]}},
        {"area_px", area_px_},
        {"polygons", polygons}};
    if (holes_) json["rle"] = {{"size", {rows_, columns_}}, {"counts", counts()}};
    return json;
  }

 private:
  static std::size_t area_of(const std::vector<std::size_t>& polygon) {
    std::uint64_t twice = 0;  // wraps around if the polygon turns in the other direction
    for (std::size_t i = 0; i < polygon.size(); i += 2) {
      const std::size_t next = (i + 2) % polygon.size();
      twice += polygon[i] * polygon[next + 1] - polygon[next] * polygon[i + 1];
    }
    return std::min(twice, -twice) / 2;
  }

  /// The pixels of a polygon along pixel edges: in each column between its horizontal edges.
  void fill(const std::vector<std::size_t>& polygon) {
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
        runs_.push_back({column * rows_ + rows[i], column * rows_ + rows[i + 1]});
    }
  }

  void add_runs(const Json& rle, std::size_t first_row) {
    const auto part_rows = whole_numbers(rle.at("size").at(0)).get<std::size_t>();
    if (part_rows == 0 || part_rows > rows_)
      throw std::runtime_error("a picture without rows, or with too many");
    std::size_t at = 0;
    bool inside = false;
    for (const Json& count : rle.at("counts")) {
      const std::size_t end = at + whole_numbers(count).get<std::size_t>();
      if (end < at || end > part_rows * columns_)
        throw std::runtime_error("runs outside their picture");
      while (inside && at < end) {  // a run may continue in the next column
        const std::size_t column = at / part_rows, row = at % part_rows;
        const std::size_t rows = std::min(end - at, part_rows - row);
        const std::size_t begin = column * rows_ + first_row + row;
        runs_.push_back({begin, begin + rows});
        at += rows;
      }
      at = end;
      inside = !inside;
    }
  }

  std::vector<std::size_t> counts() const {
    std::vector<PixelRun> runs = runs_;
    std::ranges::sort(runs, {}, &PixelRun::begin);
    std::vector<std::size_t> counts;
    std::size_t counted = 0;
    for (const PixelRun& run : runs) {
      if (run.begin > counted || counts.empty()) {
        counts.push_back(run.begin - counted);
        counts.push_back(0);
      }
      counts.back() += run.end - run.begin;
      counted = run.end;
    }
    if (counted < rows_ * columns_) counts.push_back(rows_ * columns_ - counted);
    return counts;
  }

  std::size_t rows_, columns_;
  std::size_t area_px_ = 0;
  std::array<std::size_t, 4> corners_{};  // low column and row, high column and row
  std::vector<std::vector<std::size_t>> polygons_;
  std::vector<PixelRun> runs_;
  bool holes_ = false;
};

/// A target, put together from those of the parts.
class JoinedTarget {
 public:
  /// `sights` are of the whole run.
  JoinedTarget(std::size_t rows, std::size_t columns, const TargetSights& sights)
      : body_(rows, columns), shadow_(rows, columns), sights_(sights) {}

  void add(const Json& target, std::size_t first_row) {
    if (target.contains("aspect_deg")) heading_deg_ = target.at("heading_deg").get<double>();
    const Json &body = target.at("body"), &shadow = target.at("shadow");
    body_.add(body, first_row);
    shadow_.add(shadow, first_row);
    // Means over the shadow are used only for targets without a body.
    Means& means = body.is_null() ? of_shadow_ : of_body_;
    means.add(target, (body.is_null() ? shadow : body).at("area_px").get<double>());
  }

  Json json(std::span<const ObjectVisibility> visibility) const {
    const bool seen = body_.area_px() > 0;
    Json json = (seen ? of_body_ : of_shadow_).json();
    const Sight& sight = seen ? sights_.body : sights_.shadow;
    json["side"] = sight.sector();
    if (heading_deg_)
      json["aspect_deg"] = turned_deg(sight.direction_rad() - *heading_deg_ * degree);
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
  /// Means over the parts, weighted by area.
  class Means {
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

  JoinedOutline body_, shadow_;
  TargetSights sights_;
  std::optional<double> heading_deg_;  // of an object
  Means of_body_, of_shadow_;
};

}  // namespace

std::string join_targets(const fs::path& folder, const RunParts& parts, const std::string& sonar,
                         std::span<const ObjectVisibility> visibility,
                         const std::map<std::uint32_t, TargetSights>& sights) {
  std::map<std::uint32_t, JoinedTarget> targets;
  Json whole;
  std::size_t beams = 1;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const fs::path file = folder / parts.file(part, sonar, "_targets.json");
    try {
      const Json json = json_of<Json>(refine::read_file(file, most_json_bytes));
      const auto columns = whole_numbers(json.at("picture").at("columns")).get<std::size_t>();
      if (columns > max_columns) throw std::out_of_range("more columns than any scene's");
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
        targets.try_emplace(instance, beams * parts.pings(), columns, sights.at(instance))
            .first->second.add(target, beams * (parts.pings() - parts.range(part).end()));
      }
    } catch (const std::exception& error) {
      throw SceneError(
          fmt::format("{}: not the targets of a part ({}); remove the part's folder and run it "
                      "again",
                      file.string(), fault_in_json(error)));
    }
  }
  Json& list = whole["targets"] = Json::array();
  for (const auto& [instance, target] : targets) list.push_back(target.json(visibility));
  return json_text(whole, 1) + "\n";
}

}  // namespace ensonify::engine
