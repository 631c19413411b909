#include <ensonify/engine/seafloor/objects/scour.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/bed/points_near.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr double moat_widths = 4.0;   // to where it has faded
constexpr double tail_heights = 6.0;  // its length
constexpr double steepest = 0.62;     // slope at which sand stands, 32 degrees

bool is_scoured(const ObjectOptions& table) {
  return table.scour_ratio > 0.0 || table.tail_ratio > 0.0;
}

/// Whether an object is so long that its scour would lie beyond the bed's border, if anywhere.
bool is_much_longer(const refine::TriangleMesh& mesh, const Heightfield& bed) {
  const refine::Bounds box = refine::bounds(mesh);
  const double longest_m = (box.highest - box.lowest).head<2>().cast<double>().norm();
  return longest_m > 2.0 * std::hypot(bed.x_m(bed.columns - 1) - bed.x_m(0),
                                      bed.y_m(bed.rows - 1) - bed.y_m(0));
}

/// What one object stands on, and how high it is.
class Scour {
 public:
  /// `bed` must outlive this.
  Scour(const Heightfield& bed, const refine::TriangleMesh& mesh) : bed_(bed) { find_base(mesh); }

  void add_to(Heightfield& bed, const ObjectOptions& table, const RandomStream& draws) const {
    if (base_.empty()) return;
    const Vector2d down(std::sin(table.current_rad), std::cos(table.current_rad));
    const double depth_m = table.scour_ratio * height_m_;
    // The moat's wall is steepest at the object: e times its depth over its width.
    const double half_m = 0.5 * height_m_,
                 width_m = std::max(half_m, std::numbers::e * depth_m / steepest);
    // As far as the moat and the tail reach.
    const double reach_m = 1.5 * box_.diagonal().norm() +
                           std::max((tail_heights + 1.0) * height_m_, moat_widths * width_m);
    const int west = column_at(box_.min().x() - reach_m), south = row_at(box_.min().y() - reach_m);
    Heightfield near = bed_.window(west, south, column_at(box_.max().x() + reach_m) - west + 1,
                                   row_at(box_.max().y() + reach_m) - south + 1);
    near.z_m = SmoothField(draws, 4.0 * half_m, 20.0 * half_m).over(near);
    const auto share = [&](int column, int row) {
      constexpr double spread = 0.5;
      return std::exp(spread * near.at(column - west, row - south) - 0.5 * spread * spread);
    };
    if (depth_m > 0.0) dig(depth_m, width_m, down, share, bed);
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

  /// The bed's points under the object, and how high it stands over them.
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
          if (!(over_m > 0.0)) continue;
          double& top_m = tops_m[point];
          top_m = std::max(top_m, over_m);
        }
    }
    return tops_m;
  }

  /// The height is the median of the tops, so that masts do not count.
  void find_base(const refine::TriangleMesh& mesh) {
    std::vector<double> heights_m;
    const auto columns = static_cast<std::size_t>(bed_.columns);
    const std::unordered_map<std::size_t, double> tops_m = tops(mesh);
    for (const auto& [point, top_m] : tops_m) {
      heights_m.push_back(top_m);
      base_.emplace_back(bed_.x_m(static_cast<int>(point % columns)),
                         bed_.y_m(static_cast<int>(point / columns)));
      box_.extend(base_.back());
      if (!(tops_m.contains(point - 1) && tops_m.contains(point + 1) &&
            tops_m.contains(point - columns) && tops_m.contains(point + columns)))
        edge_.push_back(base_.back());
    }
    if (base_.empty()) return;
    const auto middle = heights_m.begin() + std::ssize(heights_m) / 2;
    std::ranges::nth_element(heights_m, middle);
    height_m_ = *middle;
  }

  /// Deepest a width from the object, and half as deep in the lee.
  template <class Share>
  void dig(double depth_m, double width_m, const Vector2d& down, const Share& share,
           Heightfield& bed) const {
    const double reach_m = moat_widths * width_m;
    const int west = column_at(box_.min().x() - reach_m), south = row_at(box_.min().y() - reach_m);
    const int columns = column_at(box_.max().x() + reach_m) - west + 1,
              rows = row_at(box_.max().y() + reach_m) - south + 1;
    std::vector<double> squares_m2(
        static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows),
        std::numeric_limits<double>::infinity());  // of distances
    const auto square_at = [&](int column, int row) -> double& {
      return squares_m2[static_cast<std::size_t>(row - south) * static_cast<std::size_t>(columns) +
                        static_cast<std::size_t>(column - west)];
    };
    for (const Vector2d& place : base_) square_at(column_at(place.x()), row_at(place.y())) = 0.0;
    // Of the points under the object, one at its edge is the nearest to a point outside.
    for (const Vector2d& place : edge_)
      for_each_point_near(bed_, place.x(), place.y(), reach_m,
                          [&](int column, int row, double dx, double dy) {
                            double& square_m2 = square_at(column, row);
                            square_m2 = std::min(square_m2, dx * dx + dy * dy);
                          });
    for (int row = south; row < south + rows; ++row)
      for (int column = west; column < west + columns; ++column) {
        const double widths = std::sqrt(square_at(column, row)) / width_m;
        if (!(widths < moat_widths)) continue;
        const Vector2d from = Vector2d(bed_.x_m(column), bed_.y_m(row)) - box_.center();
        const double open = 0.75 - 0.25 * from.normalized().dot(down);
        const double fading = std::min(1.0, 2.0 - 2.0 * widths / moat_widths);
        bed.at(column, row) -=
            depth_m * open * widths * std::exp(1.0 - widths) * fading * share(column, row);
      }
  }

  /// Adds a tail that is as wide as the object across the current.
  template <class Share>
  void leave_tail(double tail_m, const Vector2d& down, const Share& share, Heightfield& bed) const {
    const Vector2d across(down.y(), -down.x());
    Eigen::AlignedBox2d box;  // down the current and across it
    for (const Vector2d& place : base_) box.extend(Vector2d(place.dot(down), place.dot(across)));
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
  std::vector<Vector2d> base_;  // the bed's points under the object
  std::vector<Vector2d> edge_;  // those of them with a neighbour that is not
  Eigen::AlignedBox2d box_;
};

}  // namespace

std::optional<std::size_t> first_scoured(std::span<const ObjectOptions> tables) {
  const auto found = std::ranges::find_if(tables, is_scoured);
  if (found == tables.end()) return std::nullopt;
  return static_cast<std::size_t>(found - tables.begin());
}

void add_scours(Heightfield& bed, const PlacedObjects& placed,
                std::span<const ObjectOptions> tables, std::uint64_t seed) {
  // All are found on the bed as it was.
  std::vector<std::pair<std::size_t, Scour>> scours;  // by object
  for (std::size_t i = 0; i < placed.objects.size(); ++i)
    if (is_scoured(tables[placed.objects[i].record.table]) &&
        !is_much_longer(placed.objects[i].mesh, bed))
      scours.emplace_back(i, Scour(bed, placed.objects[i].mesh));
  for (const auto& [i, scour] : scours)
    scour.add_to(bed, tables[placed.objects[i].record.table],
                 RandomStream(seed, Purpose::object_scour, {i}));
}

}  // namespace ensonify::engine
