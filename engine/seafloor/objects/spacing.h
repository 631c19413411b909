#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// A disc of the bed, local metres.
struct Disc {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
};

/// A horizontal area: a polygon, clockwise or counter-clockwise, or a disc.
class PlacementArea {
 public:
  explicit PlacementArea(std::vector<Eigen::Vector2d> polygon);
  explicit PlacementArea(const Disc& disc);

  /// Whether a disc is inside the area and at least margin_m away from its border.
  bool holds(const Disc& disc, double margin_m) const;
  /// The place in the bounding box for two numbers in (0, 1]: shares of its extents.
  Eigen::Vector2d at(double x, double y) const {
    return low_ + size_.cwiseProduct(Eigen::Vector2d(x, y));
  }

 private:
  std::vector<Eigen::Vector2d> polygon_;  // empty: the disc
  Disc disc_;
  Eigen::Vector2d low_, size_;
};

/// The discs of the bed that are occupied. Small discs are in a hashed grid, so a query visits only
/// neighbours and the few large discs.
class Layout {
 public:
  /// Whether these discs are at least gap_m away from all occupied discs.
  bool is_free(std::span<const Disc> discs, double gap_m) const;
  void take(std::span<const Disc> discs);

 private:
  template <class F>
  static void for_each_cell(const Disc& disc, double more_m, F&& f);

  std::vector<Disc> discs_;
  std::vector<std::uint32_t> large_;  // the large discs, which are in no cell
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace ensonify::engine
