#include <ensonify/engine/seafloor/layers/area.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>
#include <ensonify/engine/seafloor/layers/area_files.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;

/// The sides of a polygon that cross a strip low_m <= y <= high_m. They decide which places of the
/// strip are inside the polygon.
class SidesInStrip {
 public:
  SidesInStrip(const Polygon& polygon, double low_m, double high_m) {
    for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
      const auto [below_m, above_m] = std::minmax(polygon[i].y(), polygon[j].y());
      if (below_m <= high_m && above_m > low_m) sides_.push_back({polygon[i], polygon[j]});
    }
  }
  bool empty() const { return sides_.empty(); }
  /// Appends the x at which the sides cross this y.
  void add_crossings(double y_m, std::vector<double>& x_m) const {
    for (const auto& [a, b] : sides_)
      if ((a.y() > y_m) != (b.y() > y_m))
        x_m.push_back(a.x() + (b.x() - a.x()) * (y_m - a.y()) / (b.y() - a.y()));
  }
  bool inside(const Vector2d& p) const {
    bool odd = false;
    for (const auto& [a, b] : sides_)
      if ((a.y() > p.y()) != (b.y() > p.y()) &&
          p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()))
        odd = !odd;
    return odd;
  }

 private:
  std::vector<std::array<Vector2d, 2>> sides_;
};

double side_of(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
}

bool touch(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto within = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    return (r.array() >= p.array().min(q.array())).all() &&
           (r.array() <= p.array().max(q.array())).all();
  };
  const double abc = side_of(a, b, c), abd = side_of(a, b, d);
  const double cda = side_of(c, d, a), cdb = side_of(c, d, b);
  if (((abc > 0.0) != (abd > 0.0)) && ((cda > 0.0) != (cdb > 0.0)) && abc != 0.0 && abd != 0.0 &&
      cda != 0.0 && cdb != 0.0)
    return true;
  return (abc == 0.0 && within(a, b, c)) || (abd == 0.0 && within(a, b, d)) ||
         (cda == 0.0 && within(c, d, a)) || (cdb == 0.0 && within(c, d, b));
}

/// The parts of outlines that cross a strip, so a row of a grid tests few polygons of a file.
class OutlinesInStrip {
 public:
  OutlinesInStrip(const std::vector<PolygonWithHoles>& outlines, double low_m, double high_m) {
    for (const PolygonWithHoles& outline : outlines) {
      SidesInStrip border(outline.border, low_m, high_m);
      if (border.empty()) continue;
      outlines_.push_back({std::move(border), {}});
      for (const Polygon& hole : outline.holes)
        if (SidesInStrip sides(hole, low_m, high_m); !sides.empty())
          outlines_.back().holes.push_back(std::move(sides));
    }
  }
  bool hold(const Vector2d& p) const {
    return std::ranges::any_of(outlines_, [&](const Outline& outline) {
      return outline.border.inside(p) &&
             std::ranges::none_of(outline.holes,
                                  [&](const SidesInStrip& hole) { return hole.inside(p); });
    });
  }
  void add_crossings(double y_m, std::vector<double>& x_m) const {
    for (const Outline& outline : outlines_) {
      outline.border.add_crossings(y_m, x_m);
      for (const SidesInStrip& hole : outline.holes) hole.add_crossings(y_m, x_m);
    }
  }

 private:
  struct Outline {
    SidesInStrip border;
    std::vector<SidesInStrip> holes;
  };
  std::vector<Outline> outlines_;
};

/// The polygons and the disc of an area, for places in a strip.
class PlacesInStrip {
 public:
  PlacesInStrip(const Area& area, const std::vector<PolygonWithHoles>& outlines, double low_m,
                double high_m)
      : area_(area),
        middle_(area.middle_east_m, area.middle_north_m),
        any_outlines_(!outlines.empty()),
        polygon_(area.polygon_m, low_m, high_m),
        outlines_(outlines, low_m, high_m) {}
  bool hold(const Vector2d& p) const {
    return (area_.polygon_m.empty() || polygon_.inside(p)) &&
           (!any_outlines_ || outlines_.hold(p)) &&
           (area_.radius_m == 0.0 || (p - middle_).norm() <= area_.radius_m);
  }
  /// Every x at which, on the line with this y from west to east, the inside may begin.
  std::vector<double> begins(double y_m) const {
    std::vector<double> x_m{-std::numeric_limits<double>::infinity()};
    polygon_.add_crossings(y_m, x_m);
    outlines_.add_crossings(y_m, x_m);
    const double off_m = y_m - middle_.y();
    if (const double half2 = area_.radius_m * area_.radius_m - off_m * off_m; half2 >= 0.0)
      x_m.push_back(middle_.x() - std::sqrt(half2));
    return x_m;
  }

 private:
  const Area& area_;
  Vector2d middle_;
  bool any_outlines_;
  SidesInStrip polygon_;
  OutlinesInStrip outlines_;
};

/// Whether a point of the grid that is in the box is within the polygons and the disc of an area.
bool hold_a_point(const Area& area, const std::vector<PolygonWithHoles>& outlines,
                  const Heightfield& grid, const Eigen::AlignedBox2d& box) {
  for (int row = 0; row < grid.rows; ++row) {
    const double y_m = grid.y_m(row);
    if (y_m < box.min().y() || y_m > box.max().y()) continue;
    const PlacesInStrip places(area, outlines, y_m, y_m);
    for (const double from_m : places.begins(y_m)) {
      const double first = std::ceil((from_m - grid.x_m(0)) / grid.cell_east_m);
      if (first > grid.columns) continue;
      // Three points, because rounding may move the border to either side of a point.
      const int column = static_cast<int>(std::max(first, 1.0)) - 1;
      for (int i = column; i < std::min(column + 3, grid.columns); ++i)
        if (places.hold({grid.x_m(i), y_m})) return true;
    }
  }
  return false;
}

/// The sum and the number of the values that are not NaN.
struct KnownSum {
  double sum = 0.0, count = 0.0;
  void add(double value, double times) {
    const bool known = value == value;
    sum += known ? times * value : 0.0;
    count += known ? times : 0.0;
  }
  /// The mean, or `otherwise` without values. The mean is rounded to a multiple of 2^-30, so
  /// running sums are exact, and a mask is exactly 0 outside.
  double mean_or(double otherwise) const {
    // Numbers of this magnitude are multiples of 2^-30.
    constexpr double rounding = 1.5 * 0x1p22;
    return count > 0.5 ? (sum / count + rounding) - rounding : otherwise;
  }
};

/// Replaces each value by the mean over the 2 half + 1 rows around it. NaN does not count.
void mean_across_rows(std::vector<double>& values, std::size_t rows, std::size_t columns,
                      std::size_t half) {
  const std::size_t kept_rows = std::min(half, rows) + 1;
  std::vector<double> kept(kept_rows * columns);  // copies of the last rows before their change
  std::vector<KnownSum> sums(columns);
  const auto add = [&](const double* from, double times) {
    for (std::size_t i = 0; i < columns; ++i) sums[i].add(from[i], times);
  };
  for (std::size_t row = 0; row < std::min(half, rows); ++row) add(&values[row * columns], 1.0);
  for (std::size_t row = 0; row < rows; ++row) {
    double* const to = &values[row * columns];
    double* const before = &kept[row % kept_rows * columns];
    if (row + half < rows) add(to + half * columns, 1.0);
    if (row > half) add(before, -1.0);  // row - half - 1
    std::copy_n(to, columns, before);
    for (std::size_t i = 0; i < columns; ++i) to[i] = sums[i].mean_or(to[i]);
  }
}

/// Replaces each value by the mean over the 2 half + 1 columns around it. NaN does not count.
void mean_across_columns(std::vector<double>& values, std::size_t rows, std::size_t columns,
                         std::size_t half) {
  std::vector<double> from(columns);
  for (std::size_t row = 0; row < rows; ++row) {
    double* const to = values.data() + row * columns;
    std::copy_n(to, columns, from.begin());
    KnownSum sum;
    for (std::size_t i = 0; i < std::min(half, columns); ++i) sum.add(from[i], 1.0);
    for (std::size_t i = 0; i < columns; ++i) {
      if (i + half < columns) sum.add(from[i + half], 1.0);
      if (i > half) sum.add(from[i - half - 1], -1.0);
      to[i] = sum.mean_or(from[i]);
    }
  }
}

/// Three sliding means in each direction, nearly a Gaussian that is `width_m` wide from end to end.
std::vector<double> blurred(std::vector<double> values, const Heightfield& grid, double width_m) {
  const auto columns = static_cast<std::size_t>(grid.columns);
  const auto rows = static_cast<std::size_t>(grid.rows);
  for (std::size_t pass = 0; pass < 3; ++pass) {
    const auto half = [&](double cell_m) {  // the three halves add up to half the width
      const auto all = static_cast<std::size_t>(std::min(3e6, std::round(0.5 * width_m / cell_m)));
      return (all + pass) / 3;
    };
    if (half(grid.cell_east_m) > 0)
      mean_across_columns(values, rows, columns, half(grid.cell_east_m));
    if (half(grid.cell_north_m) > 0)
      mean_across_rows(values, rows, columns, half(grid.cell_north_m));
  }
  return values;
}

/// The value that a normal variable of variance 1 exceeds with this probability.
double normal_exceeded_by(double probability) {
  double low = -8.0, high = 8.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return low;
}

constexpr double fine_rms = 0.15;  // rms of the fine part of ragged_field(); the smooth part has 1
constexpr double finest_wave_m = 0.5;

/// A smooth field plus a fine field whose waves are down to a sixteenth of shortest_m long, so
/// contours are ragged at all scales. The variance is 1 + fine_rms^2.
std::vector<double> ragged_field(const Heightfield& grid, const LayerDraws& draws,
                                 std::uint64_t number, double shortest_m, double longest_m) {
  const int threads = draws.control.threads;
  std::vector<double> values =
      SmoothField(draws.of(number), shortest_m, longest_m).over(grid, threads);
  const double finest_m = std::max(shortest_m / 16.0, finest_wave_m);
  if (finest_m >= shortest_m) return values;
  const std::vector<double> fine =
      SmoothField(draws.of(number + layer_stream::finer), finest_m, shortest_m).over(grid, threads);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += fine_rms * fine[i];
  return values;
}

std::string fault_outside(const Heightfield& grid) {
  return fmt::format(
      "an area lies outside the seabed, which spans {:.1f} to {:.1f} m east and {:.1f} to {:.1f} m "
      "north of its middle",
      grid.x_m(0), grid.x_m(grid.columns - 1), grid.y_m(0), grid.y_m(grid.rows - 1));
}

/// Makes the mask of an area: begins with all points, and each limit sets points to 0.
class MaskMaker {
 public:
  MaskMaker(const Area& area, const AreaGround& ground, const LayerDraws& draws)
      : area_(area), ground_(ground), grid_(ground.base), draws_(draws) {
    values_.assign(grid_.z_m.size(), 1.0);
  }

  std::vector<double> make() {
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (std::isnan(grid_.z_m[i])) values_[i] = 0.0;
    limit_places();
    limit_heights();
    if (!area_.on.empty())
      for (std::size_t i = 0; i < values_.size(); ++i)
        if (!ground_.has_material(i, area_.on)) values_[i] = 0.0;
    if (area_.share < 1.0) keep_share();
    return std::move(values_);
  }

 private:
  void limit_places() {
    const std::vector<PolygonWithHoles> outlines = area_.outline.path.empty()
                                                       ? std::vector<PolygonWithHoles>()
                                                       : read_outlines(area_.outline.path, grid_);
    std::optional<AreaImage> image;
    if (area_.pixels)
      image.emplace(image_over(grid_, *area_.pixels, area_.image_value));
    else if (!area_.image.path.empty())
      image.emplace(read_area_image(area_.image.path, grid_, area_.image_value));
    if (area_.polygon_m.empty() && outlines.empty() && !image && area_.radius_m == 0.0) return;
    std::vector<double> shift_east, shift_north;
    if (area_.ragged_m > 0.0) {
      shift_east = ragged_field(grid_, draws_, layer_stream::border_shift_east,
                                2.5 * area_.ragged_m, 20.0 * area_.ragged_m);
      shift_north = ragged_field(grid_, draws_, layer_stream::border_shift_north,
                                 2.5 * area_.ragged_m, 20.0 * area_.ragged_m);
    }
    bool any = false;
    std::vector<Vector2d> points(static_cast<std::size_t>(grid_.columns));  // of a row
    for (int row = 0; row < grid_.rows; ++row) {
      draws_.control.check_stop();
      double low_m = grid_.y_m(row), high_m = low_m;  // the y that the points span
      for (int column = 0; column < grid_.columns; ++column) {
        const std::size_t point = grid_.index(column, row);
        Vector2d& p = points[static_cast<std::size_t>(column)];
        p = {grid_.x_m(column), grid_.y_m(row)};
        if (area_.ragged_m > 0.0)
          p += area_.ragged_m * Vector2d(shift_east[point], shift_north[point]);
        low_m = std::min(low_m, p.y());
        high_m = std::max(high_m, p.y());
      }
      const PlacesInStrip places(area_, outlines, low_m, high_m);
      for (int column = 0; column < grid_.columns; ++column) {
        const std::size_t point = grid_.index(column, row);
        const Vector2d& p = points[static_cast<std::size_t>(column)];
        const bool in = places.hold(p) && (!image || image->holds(p));
        any = any || in;
        if (!in) values_[point] = 0.0;
      }
    }
    if (!any && !grid_.is_window()) throw std::invalid_argument(fault_outside(grid_));
  }

  void limit_heights() {
    if (area_.shallowest_m || area_.deepest_m)
      keep_between(area_.shallowest_m, area_.deepest_m, Quantity{"depths", "m", 1.0},
                   [&](int column, int row) { return -grid_.at(column, row); });
    if (!area_.gentlest_rad && !area_.steepest_rad) return;
    const std::vector<double> smooth =
        blurred(grid_.z_m, grid_, std::max(area_.border_m, 6.0 * grid_.cell_east_m));
    keep_between(area_.gentlest_rad, area_.steepest_rad, Quantity{"slopes", "degrees", degree},
                 [&](int column, int row) {
                   const auto rise = [&](int dc, int dr, double cell_m) {
                     const int c0 = std::max(column - dc, 0),
                               c1 = std::min(column + dc, grid_.columns - 1);
                     const int r0 = std::max(row - dr, 0), r1 = std::min(row + dr, grid_.rows - 1);
                     return (smooth[grid_.index(c1, r1)] - smooth[grid_.index(c0, r0)]) /
                            ((c1 - c0 + r1 - r0) * cell_m);
                   };
                   return std::atan(
                       std::hypot(rise(1, 0, grid_.cell_east_m), rise(0, 1, grid_.cell_north_m)));
                 });
  }

  struct Quantity {
    std::string_view name, unit;
    double per_unit;
  };
  /// Keeps the points whose value_at(column, row) is from `least` to `most`.
  void keep_between(const std::optional<double>& least, const std::optional<double>& most,
                    const Quantity& quantity, const auto& value_at) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    bool any = false;
    double lowest = infinity, highest = -infinity;
    for (int row = 0; row < grid_.rows; ++row)
      for (int column = 0; column < grid_.columns; ++column) {
        const std::size_t point = grid_.index(column, row);
        if (std::isnan(grid_.z_m[point])) continue;  // a hole is in no area
        const double value = value_at(column, row);
        const bool in = value >= least.value_or(-infinity) && value <= most.value_or(infinity);
        any = any || in;
        lowest = std::min(lowest, value);
        highest = std::max(highest, value);
        if (!in) values_[point] = 0.0;
      }
    if (!any && !grid_.is_window())
      throw std::invalid_argument(fmt::format(
          "an area has {} that the seabed has nowhere: those of the bed without its "
          "layers are {:.2f} to {:.2f} {}",
          quantity.name, lowest / quantity.per_unit, highest / quantity.per_unit, quantity.unit));
  }

  // Keeps the points where a random field is highest. Its contours are the borders of the patches.
  void keep_share() {
    const std::vector<double> heights = ragged_field(grid_, draws_, layer_stream::patches,
                                                     0.25 * area_.patch_m, 4.0 * area_.patch_m);
    // A window does not have the whole field, so the threshold follows from the field's
    // distribution, not from its sorted values.
    if (grid_.is_window())
      return keep_above(std::hypot(1.0, fine_rms) * normal_exceeded_by(area_.share), heights);
    std::vector<double> within;
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (values_[i] > 0.0) within.push_back(heights[i]);
    if (within.empty()) return;
    const auto kept =
        static_cast<std::size_t>(std::llround(area_.share * static_cast<double>(within.size())));
    const auto border =
        within.begin() + static_cast<std::ptrdiff_t>(within.size() - std::min(kept, within.size()));
    if (border == within.end()) {
      values_.assign(values_.size(), 0.0);
      return;
    }
    std::nth_element(within.begin(), border, within.end());
    keep_above(*border, heights);
  }
  void keep_above(double least, const std::vector<double>& heights) {
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (heights[i] < least) values_[i] = 0.0;
  }

  const Area& area_;
  const AreaGround& ground_;
  const Heightfield& grid_;
  const LayerDraws& draws_;
  std::vector<double> values_;
};

}  // namespace

std::vector<double> area_mask(const Area& area, const AreaGround& ground, const LayerDraws& draws) {
  return MaskMaker(area, ground, draws).make();
}

std::string fault_of_place(const Area& area, const Heightfield& grid) {
  using Box = Eigen::AlignedBox2d;
  Box place(Vector2d(grid.x_m(0), grid.y_m(0)),
            Vector2d(grid.x_m(grid.columns - 1), grid.y_m(grid.rows - 1)));
  const auto keep_within = [&](const Box& limit) {
    const Vector2d ragged = Vector2d::Constant(6.0 * area.ragged_m);  // 6 standard deviations
    place = place.intersection(Box(limit.min() - ragged, limit.max() + ragged));
  };
  const auto box_of = [](const Polygon& polygon) {
    Box box;
    for (const Vector2d& point : polygon) box.extend(point);
    return box;
  };
  if (!area.polygon_m.empty()) keep_within(box_of(area.polygon_m));
  std::vector<PolygonWithHoles> outlines;
  if (!area.outline.path.empty()) {
    outlines = read_outlines(area.outline.path, grid);
    Box all;
    for (const PolygonWithHoles& outline : outlines) all.extend(box_of(outline.border));
    keep_within(all);
  }
  if (area.radius_m > 0.0) {
    const Vector2d middle(area.middle_east_m, area.middle_north_m);
    const Vector2d radius = Vector2d::Constant(area.radius_m);
    keep_within(Box(middle - radius, middle + radius));
  }
  // A ragged border may enclose points outside the polygons.
  const bool may_hold =
      !place.isEmpty() && (area.ragged_m > 0.0 || hold_a_point(area, outlines, grid, place));
  return may_hold ? std::string() : fault_outside(grid);
}

std::vector<double> softened(std::vector<double> mask, const Heightfield& grid, double width_m) {
  // A hole is not a border of the area, so the means leave holes out.
  bool any_inside = false, any_outside = false;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (!std::isnan(grid.z_m[i])) (mask[i] > 0.0 ? any_inside : any_outside) = true;
  if (!any_inside || !any_outside) return mask;
  const auto set_holes = [&](double value) {
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (std::isnan(grid.z_m[i])) mask[i] = value;
  };
  set_holes(std::numeric_limits<double>::quiet_NaN());
  mask = blurred(std::move(mask), grid, width_m);
  set_holes(0.0);
  return mask;
}

std::optional<std::pair<std::size_t, std::size_t>> crossing_sides(const Polygon& polygon) {
  const bool repeats_first = polygon.size() > 1 && polygon.front() == polygon.back();
  const std::size_t n = polygon.size() - (repeats_first ? 1 : 0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;  // neighbours share a point
      if (touch(polygon[i], polygon[i + 1], polygon[j], polygon[(j + 1) % n])) return {{i, j}};
    }
  return std::nullopt;
}

}  // namespace ensonify::engine
