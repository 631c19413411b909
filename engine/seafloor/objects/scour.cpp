#include <ensonify/engine/seafloor/objects/scour.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/points_near.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::ArrayXf, Eigen::ArrayXXf, Eigen::Vector2d, Eigen::Vector3d;

constexpr double moat_widths = 4.0;   // distance at which a moat ends / its width
constexpr double tail_heights = 6.0;  // length of a tail / height of the object
constexpr double steepest = 0.62;     // slope at which sand stands, 32 degrees

bool is_scoured(const ObjectOptions& table) {
  return table.scour_ratio > 0.0 || table.tail_ratio > 0.0;
}

/// Whether an object is longer than twice the bed's diagonal, so that it needs no scour.
bool is_much_longer(const refine::TriangleMesh& mesh, const Heightfield& bed) {
  const refine::Bounds box = refine::bounds(mesh);
  const double longest_m = (box.highest - box.lowest).head<2>().cast<double>().norm();
  return longest_m > 2.0 * std::hypot(bed.x_m(bed.columns - 1) - bed.x_m(0),
                                      bed.y_m(bed.rows - 1) - bed.y_m(0));
}

/// The bed's points under an object.
struct Footprint {
  std::vector<Vector2d> all;
  std::vector<Vector2d> edge;  ///< points with a neighbour that is not under the object
  Eigen::AlignedBox2d box;
};

/// The part of the bed on which one object stands, and the object's height.
class Footing {
 public:
  /// `bed` must outlive this object.
  Footing(const Heightfield& bed, const refine::TriangleMesh& mesh) : bed_(bed) { find_base(mesh); }

  /// Adds the scour of the object to the bed. The bed under the objects `standing`, which may
  /// include this object, stays.
  void scour(Heightfield& bed, const ObjectOptions& table, const RandomStream& draws,
             std::span<const Footing* const> standing, const WorkControl& control) const {
    if (base_.all.empty()) return;
    const Vector2d down(std::sin(table.current_rad), std::cos(table.current_rad));
    const double depth_m = table.scour_ratio * height_m_;
    // The moat's wall is steepest at the object: e * depth / width.
    const double half_m = 0.5 * height_m_,
                 width_m = std::max(half_m, std::numbers::e * depth_m / steepest);
    // The greatest distance of moat and tail from the object.
    const double reach_m = 1.5 * base_.box.diagonal().norm() +
                           std::max((tail_heights + 1.0) * height_m_, moat_widths * width_m);
    Heightfield near = around_base(reach_m);
    near.z_m = SmoothField(draws, 4.0 * half_m, 20.0 * half_m).over(near, control.threads);
    const auto share = [&](int column, int row) {
      constexpr double spread = 0.5;
      return std::exp(spread * near.at(column - near.first_column, row - near.first_row) -
                      0.5 * spread * spread);
    };
    if (depth_m > 0.0) dig(depth_m, width_m, down, share, standing, control, bed);
    if (table.tail_ratio > 0.0) leave_tail(table.tail_ratio * height_m_, down, share, bed);
  }

 private:
  static int nearest(double at_m, double cell_m, int count) {
    return static_cast<int>(
        std::clamp(std::round(at_m / cell_m + 0.5 * (count - 1)), 0.0, count - 1.0));
  }
  int column_at(double x_m) const { return nearest(x_m, bed_.cell_east_m, bed_.columns); }
  int row_at(double y_m) const { return nearest(y_m, bed_.cell_north_m, bed_.rows); }
  bool is_over_bed(const Vector2d& place) const {
    return std::abs(place.x()) <= -bed_.x_m(0) && std::abs(place.y()) <= -bed_.y_m(0);
  }
  std::size_t point_at(const Vector2d& place) const {
    return bed_.index(column_at(place.x()), row_at(place.y()));
  }
  /// The part of the bed's grid within this distance of the base, without heights.
  Heightfield around_base(double reach_m) const {
    const Vector2d low = base_.box.min().array() - reach_m,
                   high = base_.box.max().array() + reach_m;
    const int west = column_at(low.x()), south = row_at(low.y());
    return bed_.window(west, south, column_at(high.x()) - west + 1, row_at(high.y()) - south + 1);
  }

  /// The bed's points under the object, and the height of the object's top over each point;
  /// negative if the top is under the bed.
  std::unordered_map<std::size_t, double> tops(const refine::TriangleMesh& mesh) const {
    std::unordered_map<std::size_t, double> tops_m;
    const double cell_m = std::min(bed_.cell_east_m, bed_.cell_north_m);
    for (const refine::Face& face : mesh.faces) {
      const Vector3d a = mesh.positions[face[0]].cast<double>(),
                     b = mesh.positions[face[1]].cast<double>(),
                     c = mesh.positions[face[2]].cast<double>();
      const double longest_m =
          std::max({(b - a).head<2>().norm(), (c - a).head<2>().norm(), (c - b).head<2>().norm()});
      const int steps = static_cast<int>(std::ceil(longest_m / cell_m)) + 1;
      for (int i = 0; i <= steps; ++i)
        for (int k = 0; i + k <= steps; ++k) {
          const Vector3d p = a + (b - a) * i / steps + (c - a) * k / steps;
          if (!is_over_bed(p.head<2>())) continue;
          const std::size_t point = point_at(p.head<2>());
          const double over_m = p.z() - bed_.z_m[point];
          if (std::isnan(over_m)) continue;
          double& top_m = tops_m.try_emplace(point, over_m).first->second;
          top_m = std::max(top_m, over_m);
        }
    }
    return tops_m;
  }

  /// The points at which the top of the object is higher than over_m.
  Footprint footprint(const std::unordered_map<std::size_t, double>& tops_m, double over_m) const {
    std::vector<std::size_t> points;
    for (const auto& [point, top_m] : tops_m)
      if (top_m > over_m) points.push_back(point);
    std::ranges::sort(points);  // so sums do not depend on the order in the map
    const auto has = [&](std::size_t point) {
      const auto found = tops_m.find(point);
      return found != tops_m.end() && found->second > over_m;
    };
    const auto columns = static_cast<std::size_t>(bed_.columns);
    Footprint found;
    for (const std::size_t point : points) {
      const Vector2d place(bed_.x_m(static_cast<int>(point % columns)),
                           bed_.y_m(static_cast<int>(point / columns)));
      found.all.push_back(place);
      found.box.extend(place);
      if (!(has(point - 1) && has(point + 1) && has(point - columns) && has(point + columns)))
        found.edge.push_back(place);
    }
    return found;
  }

  /// Finds the points under the object, and its height: the median of its tops, to ignore masts.
  void find_base(const refine::TriangleMesh& mesh) {
    const std::unordered_map<std::size_t, double> tops_m = tops(mesh);
    base_ = footprint(tops_m, 0.0);
    whole_ = footprint(tops_m, -std::numeric_limits<double>::infinity());
    if (base_.all.empty()) return;
    std::vector<double> heights_m;
    for (const auto& [point, top_m] : tops_m)
      if (top_m > 0.0) heights_m.push_back(top_m);
    const auto middle = heights_m.begin() + std::ssize(heights_m) / 2;
    std::ranges::nth_element(heights_m, middle);
    height_m_ = *middle;
  }

  /// Vectors from the object to the points of a part of the bed's grid. Each is a weighted mean
  /// over the object's edge points, and nearer points have larger weights. The vector from the
  /// nearest point alone, and with it the moat's depth, would jump in corners such as between a
  /// wing and a fuselage. Values are floats, because most of the time of a scour is spent here.
  struct Ways {
    ArrayXXf square_m2;  // squared distance from the nearest edge point; infinite beyond the reach
    ArrayXXf weights, sum_east_m, sum_north_m;

    Ways(int columns, int rows)
        : square_m2(ArrayXXf::Constant(columns, rows, std::numeric_limits<float>::infinity())),
          weights(ArrayXXf::Zero(columns, rows)),
          sum_east_m(weights),
          sum_north_m(weights) {}
    Vector2d mean(int column, int row) const {
      return Vector2d(double(sum_east_m(column, row)), double(sum_north_m(column, row))) /
             double(weights(column, row));
    }
  };
  Ways ways_to(const Heightfield& part, double reach_m) const {
    Ways ways(part.columns, part.rows);
    const Vector2d middle = base_.box.center();  // floats near this place are precise enough
    ArrayXf x_m(part.columns), dx_m(part.columns), square_m2(part.columns), weight(part.columns);
    for (int column = 0; column < part.columns; ++column)
      x_m[column] = static_cast<float>(part.x_m(column) - middle.x());
    // Edge points are enough, because the nearest point to a place outside is an edge point.
    for (const Vector2d& place : base_.edge) {
      const GridRange near = points_near(part, place.x(), place.y(), reach_m);
      const int count = near.east - near.west + 1;
      if (count <= 0) continue;
      const auto add = [&](ArrayXXf& sums, int row, const auto& terms) {
        sums.col(row).segment(near.west, count) += terms;
      };
      auto dx = dx_m.head(count), square = square_m2.head(count), w = weight.head(count);
      dx = x_m.segment(near.west, count) - static_cast<float>(place.x() - middle.x());
      for (int row = near.south; row <= near.north; ++row) {
        const auto dy = static_cast<float>(part.y_m(row) - place.y());
        square = dx * dx + dy * dy;
        auto nearest = ways.square_m2.col(row).segment(near.west, count);
        nearest = nearest.min(square);
        w = 1.0f / (square * square);
        w *= w;
        add(ways.weights, row, w);
        add(ways.sum_east_m, row, w * dx);
        add(ways.sum_north_m, row, w * dy);
      }
    }
    const double cell_m = std::min(part.cell_east_m, part.cell_north_m);
    for (const Vector2d& place : base_.all)
      for_each_point_near(
          part, place.x(), place.y(), 0.1 * cell_m,
          [&](int column, int row, double, double) { ways.square_m2(column, row) = 0.0f; });
    return ways;
  }

  /// Digs the moat, which is deepest at width_m from the object, and half as deep in the lee.
  template <class Share>
  void dig(double depth_m, double width_m, const Vector2d& down, const Share& share,
           std::span<const Footing* const> standing, const WorkControl& control,
           Heightfield& bed) const {
    const double reach_m = moat_widths * width_m;
    Heightfield dug_m = around_base(reach_m);
    dug_m.z_m.resize(static_cast<std::size_t>(dug_m.points()));
    constexpr int strip_rows = 4;  // so the fastest cache can hold the Ways of a strip
    const auto strips = static_cast<std::size_t>((dug_m.rows + strip_rows - 1) / strip_rows);
    refine::parallel_for(strips, control.threads, [&](std::size_t strip, int) {
      control.check_stop();
      const int first = static_cast<int>(strip) * strip_rows;
      const Heightfield part = bed_.window(dug_m.first_column, dug_m.first_row + first,
                                           dug_m.columns, std::min(strip_rows, dug_m.rows - first));
      const Ways ways = ways_to(part, reach_m);
      for (int row = 0; row < part.rows; ++row)
        for (int column = 0; column < part.columns; ++column) {
          const double distance_m = std::sqrt(double(ways.square_m2(column, row)));
          const double widths = distance_m / width_m;
          if (!(widths > 0.0 && widths < moat_widths)) continue;
          const Vector2d from = ways.mean(column, row);
          const double open = 0.75 - 0.25 * from.dot(down) / std::max(from.norm(), distance_m);
          const double fading = std::min(1.0, 2.0 - 2.0 * widths / moat_widths);
          dug_m.at(column, first + row) = depth_m * open * widths * std::exp(1.0 - widths) *
                                          fading *
                                          share(part.first_column + column, part.first_row + row);
        }
    });
    const double deepest_m = std::ranges::max(dug_m.z_m);
    for (const Footing* other : standing)
      if (other != this) other->keep_base(dug_m, deepest_m);
    for (int row = 0; row < dug_m.rows; ++row)
      for (int column = 0; column < dug_m.columns; ++column)
        bed.at(dug_m.first_column + column, dug_m.first_row + row) -= dug_m.at(column, row);
  }

  /// Fills a moat under this object, with walls around it as steep as sand can be.
  void keep_base(Heightfield& dug_m, double deepest_m) const {
    const double cell_m = std::hypot(bed_.cell_east_m, bed_.cell_north_m);  // from corner to corner
    const double reach_m = deepest_m / steepest + cell_m;
    const Vector2d reach(reach_m, reach_m);
    const Eigen::AlignedBox2d dug(
        Vector2d(dug_m.x_m(0), dug_m.y_m(0)) - reach,
        Vector2d(dug_m.x_m(dug_m.columns - 1), dug_m.y_m(dug_m.rows - 1)) + reach);
    if (whole_.all.empty() || !dug.intersects(whole_.box)) return;
    const auto keep = [&](int column, int row, double dx, double dy) {
      double& depth_m = dug_m.at(column, row);
      depth_m = std::min(depth_m, steepest * std::max(0.0, std::sqrt(dx * dx + dy * dy) - cell_m));
    };
    for (const Vector2d& place : whole_.all)
      for_each_point_near(dug_m, place.x(), place.y(), cell_m, keep);
    for (const Vector2d& place : whole_.edge)
      for_each_point_near(dug_m, place.x(), place.y(), reach_m, keep);
  }

  /// Adds a tail that is as wide as the object across the current.
  template <class Share>
  void leave_tail(double tail_m, const Vector2d& down, const Share& share, Heightfield& bed) const {
    const Vector2d across(down.y(), -down.x());
    Eigen::AlignedBox2d box;  // along and across the current
    for (const Vector2d& place : base_.all)
      box.extend(Vector2d(place.dot(down), place.dot(across)));
    const double half_m = 0.5 * box.sizes().y() + 0.3 * height_m_;
    const double long_m = tail_heights * height_m_;
    const Vector2d place = box.center().x() * down + box.center().y() * across;
    for_each_point_near(bed_, place.x(), place.y(), 0.5 * box.sizes().x() + long_m + 2.0 * half_m,
                        [&](int column, int row, double dx, double dy) {
                          const double behind_m =
                              Vector2d(dx, dy).dot(down) - 0.5 * box.sizes().x();
                          const double aside = Vector2d(dx, dy).dot(across) / half_m;
                          if (!(behind_m > 0.0 && behind_m < long_m && std::abs(aside) < 2.0))
                            return;
                          const double along = 4.0 * behind_m / long_m;  // highest at 1
                          const double fading = std::min(1.0, 2.0 - 0.5 * along);
                          bed.at(column, row) += tail_m * along * std::exp(1.0 - along) * fading *
                                                 std::exp(-aside * aside) * share(column, row);
                        });
  }

  const Heightfield& bed_;
  double height_m_ = 0.0;
  Footprint base_;   // where the object rises above the bed
  Footprint whole_;  // also where the object is buried
};

}  // namespace

std::optional<std::size_t> first_scoured(std::span<const ObjectOptions> tables) {
  const auto found = std::ranges::find_if(tables, is_scoured);
  if (found == tables.end()) return std::nullopt;
  return static_cast<std::size_t>(found - tables.begin());
}

void add_scours(Heightfield& bed, const PlacedObjects& placed,
                std::span<const ObjectOptions> tables, std::uint64_t seed,
                const WorkControl& control) {
  // All footings are found before any scour changes the bed.
  std::vector<std::pair<std::size_t, Footing>> footings;  // by object
  for (std::size_t i = 0; i < placed.objects.size(); ++i)
    if (!is_much_longer(placed.objects[i].mesh, bed))
      footings.emplace_back(i, Footing(bed, placed.objects[i].mesh));
  std::vector<const Footing*> standing;
  for (const auto& [i, footing] : footings)
    if (const auto& table = tables[placed.objects[i].record.table];
        !(table.height_m.value_or(0.0) > 0.0))
      standing.push_back(&footing);
  for (const auto& [i, footing] : footings)
    if (const auto& table = tables[placed.objects[i].record.table]; is_scoured(table))
      footing.scour(bed, table, RandomStream(seed, Purpose::object_scour, {i}), standing, control);
}

}  // namespace ensonify::engine
