#include <ensonify/engine/seafloor/objects/spacing.h>

#include <algorithm>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;

constexpr double cell_m = 2.0;
// A larger disc is compared with all other discs instead of being put into cells, because it could
// have many more cells than there are discs (a mesh may be a million metres long).
constexpr double max_cells_across = 64.0;
bool is_large(double reach_m) { return 2.0 * reach_m > max_cells_across * cell_m; }

double distance_m(const Vector2d& place, const Vector2d& a, const Vector2d& b) {
  const Vector2d way = b - a;
  const double length2 = way.squaredNorm();
  const double along = length2 > 0.0 ? std::clamp((place - a).dot(way) / length2, 0.0, 1.0) : 0.0;
  return (place - a - along * way).norm();
}

}  // namespace

PlacementArea::PlacementArea(std::vector<Vector2d> polygon) : polygon_(std::move(polygon)) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& corner : polygon_) box.extend(corner);
  low_ = box.min();
  size_ = box.sizes();
}

PlacementArea::PlacementArea(const Disc& disc)
    : disc_(disc),
      low_(disc.middle.array() - disc.radius_m),
      size_(Vector2d::Constant(2.0 * disc.radius_m)) {}

bool PlacementArea::holds(const Disc& disc, double margin_m) const {
  const double reach_m = disc.radius_m + margin_m;
  if (polygon_.empty()) return (disc.middle - disc_.middle).norm() + reach_m <= disc_.radius_m;
  bool inside = false;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    const Vector2d &a = polygon_[i], &b = polygon_[(i + 1) % polygon_.size()];
    nearest_m = std::min(nearest_m, distance_m(disc.middle, a, b));
    if ((a.y() > disc.middle.y()) != (b.y() > disc.middle.y()) &&
        disc.middle.x() < a.x() + (disc.middle.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  }
  return inside && nearest_m >= reach_m;
}

template <class F>
void Layout::for_each_cell(const Disc& disc, double more_m, F&& f) {
  const double reach_m = std::max(0.0, disc.radius_m + more_m);
  const auto low = ((disc.middle.array() - reach_m) / cell_m).floor().cast<std::int64_t>().eval();
  const auto high = ((disc.middle.array() + reach_m) / cell_m).floor().cast<std::int64_t>().eval();
  for (std::int64_t y = low[1]; y <= high[1]; ++y)
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      f((static_cast<std::uint64_t>(y) << 32) ^ (static_cast<std::uint64_t>(x) & 0xffffffffu));
}

bool Layout::is_free(std::span<const Disc> discs, double gap_m) const {
  for (const Disc& disc : discs) {
    const auto is_apart = [&](const Disc& other) {
      return (disc.middle - other.middle).norm() >= disc.radius_m + other.radius_m + gap_m;
    };
    if (is_large(disc.radius_m + gap_m)) {
      if (!std::ranges::all_of(discs_, is_apart)) return false;
      continue;
    }
    bool free =
        std::ranges::all_of(large_, [&](std::uint32_t other) { return is_apart(discs_[other]); });
    for_each_cell(disc, gap_m, [&](std::uint64_t cell) {
      const auto found = cells_.find(cell);
      if (!free || found == cells_.end()) return;
      for (const std::uint32_t other : found->second) free = free && is_apart(discs_[other]);
    });
    if (!free) return false;
  }
  return true;
}

void Layout::take(std::span<const Disc> discs) {
  for (const Disc& disc : discs) {
    const auto number = static_cast<std::uint32_t>(discs_.size());
    discs_.push_back(disc);
    if (is_large(disc.radius_m))
      large_.push_back(number);
    else
      for_each_cell(disc, 0.0, [&](std::uint64_t cell) { cells_[cell].push_back(number); });
  }
}

}  // namespace ensonify::engine
