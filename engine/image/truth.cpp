#include <ensonify/engine/image/truth.h>

#include <algorithm>
#include <span>
#include <utility>

#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// A mark per pixel: 2 * instance for a body, 2 * instance + 1 for a shadow, 0 for neither.
class Marks {
 public:
  explicit Marks(const Waterfall& image)
      : columns_(static_cast<int>(image.columns())), rows_(static_cast<int>(image.rows())) {
    const BinLayers& layers = image.pixels;
    marks_.resize(layers.region.size());
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const auto region = static_cast<Region>(layers.region[i]);
      if (region == Region::object || region == Region::seabed)
        marks_[i] = 2 * std::uint64_t{layers.instance[i]};
      else if (region == Region::shadow && layers.shadow_instance[i] != 0)
        marks_[i] = 2 * std::uint64_t{layers.shadow_instance[i]} + 1;
    }
    parts_.assign(marks_.size(), 0);
  }

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// Index into the layers, whose first row is the oldest ping.
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(rows_ - 1 - row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  std::uint64_t mark(int column, int row) const { return marks_[index(column, row)]; }
  bool is_new(int column, int row) const { return parts_[index(column, row)] == 0; }

  /// Numbers the part that contains a pixel and adds the part to an outline. The pixel must be the
  /// part's first pixel in row order, so that the pixel's upper left corner lies on the part's
  /// outer border. Returns the part's area in pixels.
  std::size_t add_part(int column, int row, Outline& outline) {
    const std::uint64_t mine = mark(column, row);
    const std::uint32_t part = ++count_;
    std::size_t area = 0;
    std::vector<Corner> open{{column, row}};
    parts_[index(column, row)] = part;
    while (!open.empty()) {
      const auto [c, r] = open.back();
      open.pop_back();
      ++area;
      extend(outline, c, r);
      for (const auto& [dc, dr] : {Corner{1, 0}, Corner{0, 1}, Corner{-1, 0}, Corner{0, -1}}) {
        const int nc = c + dc, nr = r + dr;
        if (nc < 0 || nr < 0 || nc >= columns_ || nr >= rows_ || mark(nc, nr) != mine ||
            !is_new(nc, nr))
          continue;
        parts_[index(nc, nr)] = part;
        open.push_back({nc, nr});
      }
    }
    outline.area_px += area;
    outline.polygons.push_back(border(column, row, part));
    return area;
  }

  /// Sets the run lengths of an outline if its polygons also enclose other pixels (holes).
  void find_holes(std::uint64_t mine, Outline& outline) const {
    std::size_t enclosed = 0;
    for (const std::vector<Corner>& polygon : outline.polygons) enclosed += area_of(polygon);
    if (enclosed == outline.area_px) return;
    const auto rows = static_cast<std::size_t>(rows_);
    std::size_t counted = 0;  // pixels in runs
    for (int column = outline.low[0]; column < outline.high[0]; ++column)
      for (int row = outline.low[1]; row < outline.high[1]; ++row) {
        if (mark(column, row) != mine) continue;
        const std::size_t at =
            static_cast<std::size_t>(column) * rows + static_cast<std::size_t>(row);
        if (at > counted || outline.runs.empty()) {
          outline.runs.push_back(at - counted);
          outline.runs.push_back(0);
        }
        ++outline.runs.back();
        counted = at + 1;
      }
    const std::size_t pixels = rows * static_cast<std::size_t>(columns_);
    if (counted < pixels) outline.runs.push_back(pixels - counted);
  }

 private:
  static std::size_t area_of(const std::vector<Corner>& polygon) {
    std::int64_t twice = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      twice += std::int64_t{a[0]} * b[1] - std::int64_t{b[0]} * a[1];
    }
    return static_cast<std::size_t>(twice / 2);
  }

  static void extend(Outline& outline, int c, int r) {
    if (outline.area_px == 0 && outline.high == Corner{}) {
      outline.low = {c, r};
      outline.high = {c + 1, r + 1};
    }
    outline.low = {std::min(outline.low[0], c), std::min(outline.low[1], r)};
    outline.high = {std::max(outline.high[0], c + 1), std::max(outline.high[1], r + 1)};
  }

  /// The corners of a part's outer border. The border is followed along pixel edges with the part
  /// on the right, from an upper left corner back to it. Where two pixels of the part touch only in
  /// a corner it turns right, so that it stays on pixels that share an edge.
  std::vector<Corner> border(int column, int row, std::uint32_t part) const {
    const auto inside = [&](int c, int r) {
      return c >= 0 && r >= 0 && c < columns_ && r < rows_ && parts_[index(c, r)] == part;
    };
    const Corner start{column, row};
    Corner at = start, way{1, 0};
    std::vector<Corner> corners{start};
    do {
      at = {at[0] + way[0], at[1] + way[1]};
      // The pixels ahead, on the left (-1) and on the right (1).
      const auto ahead = [&](int side) {
        const int x2 = 2 * at[0] + way[0] - side * way[1], y2 = 2 * at[1] + way[1] + side * way[0];
        return inside((x2 - 1) / 2, (y2 - 1) / 2);
      };
      const bool left = ahead(-1), right = ahead(1);
      const Corner before = way;
      if (!right)
        way = {-before[1], before[0]};
      else if (left)
        way = {before[1], -before[0]};
      if (way != before && at != start) corners.push_back(at);
    } while (at != start || way != Corner{1, 0});
    return corners;
  }

  int columns_, rows_;
  std::vector<std::uint64_t> marks_;
  std::vector<std::uint32_t> parts_;
  std::uint32_t count_ = 0;
};

void largest_first(Outline& outline, const std::vector<std::size_t>& areas) {
  std::vector<std::size_t> order(areas.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(order, [&](auto a, auto b) { return areas[a] > areas[b]; });
  std::vector<std::vector<Corner>> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(outline.polygons[i]));
  outline.polygons = std::move(sorted);
}

std::map<std::uint32_t, TargetOutlines> find_outlines(Marks& marks) {
  std::map<std::uint32_t, TargetOutlines> found;
  std::map<std::uint64_t, std::vector<std::size_t>> areas;  // by mark, one per polygon
  const auto outline_of = [&](std::uint64_t mark) -> Outline& {
    TargetOutlines& target = found[static_cast<std::uint32_t>(mark / 2)];
    return mark % 2 == 1 ? target.shadow : target.body;
  };
  for (int row = 0; row < marks.rows(); ++row)
    for (int column = 0; column < marks.columns(); ++column)
      if (const std::uint64_t mark = marks.mark(column, row);
          mark != 0 && marks.is_new(column, row))
        areas[mark].push_back(marks.add_part(column, row, outline_of(mark)));
  for (const auto& [mark, of_parts] : areas) {
    Outline& outline = outline_of(mark);
    largest_first(outline, of_parts);
    marks.find_holes(mark, outline);
  }
  return found;
}

/// The sum of the directions (north, east) from the sonar to the pixels of a target in one row. The
/// beam of the row looks ahead by its bearing, or abeam.
Eigen::Vector2d directions_of(const Sonar& sonar, std::size_t row, double ahead_rad,
                              std::size_t pixels, double to_starboard) {
  if (!sonar.steers())
    return to_starboard * Eigen::Vector2d(-std::sin(ahead_rad), std::cos(ahead_rad));
  const auto beam = static_cast<int>(row % static_cast<std::size_t>(sonar.beams));
  const double sight_rad = ahead_rad + sonar.bearing_rad(beam);
  return static_cast<double>(pixels) * Eigen::Vector2d(std::cos(sight_rad), std::sin(sight_rad));
}

/// Sets range, ping, sight and contrast of a target that has its outlines.
void measure(const Waterfall& image, const Marks& marks, Target& target) {
  constexpr int min_border_px = 8;
  const bool seen = target.body.area_px > 0;
  const Outline& shown = seen ? target.body : target.shadow;
  const std::uint64_t mark = 2 * std::uint64_t{target.instance} + (seen ? 0 : 1);
  const int more_columns = std::max(min_border_px, shown.high[0] - shown.low[0]);
  const int more_rows = std::max(min_border_px, shown.high[1] - shown.low[1]);
  double body = 0.0, bed = 0.0, range_m = 0.0, ping = 0.0;
  std::size_t bed_pixels = 0;
  const LineLayout layout = image.layout();
  const std::span<const Sector> sectors = image.sonar.sectors();
  std::array<std::size_t, most_sectors> pixels{};
  for (int row = std::max(0, shown.low[1] - more_rows);
       row < std::min(marks.rows(), shown.high[1] + more_rows); ++row) {
    std::size_t of_row = 0;     // pixels of the target in this row
    double to_starboard = 0.0;  // of a sidescan: their number to starboard minus that to port
    for (int column = std::max(0, shown.low[0] - more_columns);
         column < std::min(marks.columns(), shown.high[0] + more_columns); ++column) {
      const std::size_t i = marks.index(column, row);
      if (marks.mark(column, row) == mark) {
        const std::size_t sector = layout.place(static_cast<std::size_t>(column)).sector;
        ++pixels[sector];
        ++of_row;
        to_starboard += sectors[sector].out;
        body += image.pixels.intensity_mean[i];
        range_m += image.pixels.range_m[i];
      } else if (marks.mark(column, row) == 0 &&
                 image.pixels.region[i] == static_cast<std::uint32_t>(Region::seabed)) {
        ++bed_pixels;
        bed += image.pixels.intensity_mean[i];
      }
    }
    if (of_row == 0) continue;
    const auto from_oldest = static_cast<std::size_t>(marks.rows() - 1 - row);
    const PingRow& its_ping = image.pings[from_oldest];
    ping += static_cast<double>(of_row) * static_cast<double>(its_ping.number);
    const double ahead_rad = mounted(its_ping.pose, image.sonar.mounting).heading_rad;
    target.sight.directions +=
        directions_of(image.sonar, from_oldest, ahead_rad, of_row, to_starboard);
  }
  for (std::size_t sector = 0; sector < sectors.size(); ++sector)
    if (pixels[sector] > 0)
      target.sight.sector_px[std::string(sectors[sector].name)] = pixels[sector];
  const auto n = static_cast<double>(target.sight.pixels());
  target.range_m = range_m / n;
  target.ping = ping / n;
  if (seen && body > 0.0 && bed > 0.0)
    target.contrast_db = scatter::to_db((body / n) / (bed / static_cast<double>(bed_pixels)));
}

}  // namespace

Sight& Sight::operator+=(const Sight& more) {
  for (const auto& [sector, pixels] : more.sector_px) sector_px[sector] += pixels;
  directions += more.directions;
  return *this;
}

std::size_t Sight::pixels() const {
  std::size_t sum = 0;
  for (const auto& [sector, pixels] : sector_px) sum += pixels;
  return sum;
}

std::string Sight::sector() const {
  std::string name;
  std::size_t most = 0;
  for (const auto& [sector, pixels] : sector_px)
    if (pixels >= most) {
      name = sector;
      most = pixels;
    }
  return name;
}

std::map<std::uint32_t, TargetOutlines> find_outlines(const Waterfall& waterfall) {
  Marks marks(waterfall);
  return find_outlines(marks);
}

std::vector<Target> find_targets(const Waterfall& waterfall) {
  Marks marks(waterfall);
  std::vector<Target> targets;
  for (auto& [instance, outlines] : find_outlines(marks)) {
    Target& target = targets.emplace_back();
    static_cast<TargetOutlines&>(target) = std::move(outlines);
    target.instance = instance;
    measure(waterfall, marks, target);
  }
  return targets;
}

std::set<std::uint32_t> targets_at_edges(const Waterfall& line) {
  std::set<std::uint32_t> found;
  const LineLayout layout = line.layout();
  const std::size_t columns = layout.columns(), rows = line.rows();
  const auto look_at = [&](std::size_t row, std::size_t column) {
    const std::size_t i = row * columns + column;
    const auto region = static_cast<Region>(line.pixels.region[i]);
    if (line.pixels.instance[i] != 0 && (region == Region::object || region == Region::seabed))
      found.insert(line.pixels.instance[i]);
  };
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t sector = 0; sector < layout.sectors(); ++sector)
      look_at(row, layout.column({sector, layout.bins() - 1}));
    if (row == 0 || row + 1 == rows)
      for (std::size_t column = 0; column < columns; ++column) look_at(row, column);
  }
  return found;
}

}  // namespace ensonify::engine
