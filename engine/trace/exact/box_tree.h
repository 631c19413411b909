#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/work_control.h>

namespace ensonify::engine {

/// An axis-aligned box; its corners have vertices' coordinates, so a box around boxes is exact.
struct Box {
  std::array<Eigen::Vector3f, 2> corner;  ///< the lowest, the highest

  void take(const Eigen::Vector3f& point) { take(Box{{point, point}}); }
  void take(const Box& other) {
    corner[0] = corner[0].cwiseMin(other.corner[0]);
    corner[1] = corner[1].cwiseMax(other.corner[1]);
  }
};
constexpr float no_end = std::numeric_limits<float>::infinity();
inline const Box no_box{{Eigen::Vector3f::Constant(no_end), Eigen::Vector3f::Constant(-no_end)}};

/// A line prepared for cuts with boxes. The largest component of its direction is at least 2^-100;
/// those of origin and direction are within 1e18.
class BoxLine {
 public:
  BoxLine(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

  struct Cut {
    double enter, leave;
    /// Whether a line that starts at 0 runs through the box.
    bool ahead() const { return enter <= leave && leave >= 0.0; }
  };

  /// Where the line enters and leaves the box, widened by 8u, u = 2^-53, so that no t inside the
  /// box is left out. A bound has three roundings (difference, reciprocal and product), 3.01u in
  /// all. If the product underflows, its error is 2^-1074, which the 2^-1000 covers.
  ///
  /// Every operation is monotone in the box: a box within another is never entered before it or
  /// left after it, rounding included. This is why the tree changes no answer.
  Cut cut(const Box& box) const {
    double enter = -std::numeric_limits<double>::infinity();
    double leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      // NaN where the line runs within the side's plane (0 * inf) or the axis is left out: the
      // order of these comparisons then ignores the bound.
      const double near = (box.corner[backwards_[axis]][axis] - origin_[axis]) * inverse_[axis];
      const double far = (box.corner[1 - backwards_[axis]][axis] - origin_[axis]) * inverse_[axis];
      enter = near > enter ? near : enter;
      leave = far < leave ? far : leave;
    }
    return {enter - std::abs(enter) * 0x1p-50, leave + std::abs(leave) * 0x1p-50 + 0x1p-1000};
  }

 private:
  Eigen::Vector3d origin_;
  Eigen::Vector3d inverse_;
  std::array<unsigned, 3> backwards_;
};

/// A bounding volume hierarchy. It splits at the median of the boxes' middles along the axis of
/// their largest spread.
class BoxTree {
 public:
  /// Over boxes 0 to count - 1; `box_of` returns the box of a number. `stop_check` is called now
  /// and then; what it throws ends the building.
  template <class BoxOf>
  void build(std::uint32_t count, BoxOf&& box_of, const std::function<void()>& stop_check) {
    RareStopCheck check_stop(stop_check);
    std::vector<Item> items;
    items.reserve(count);
    for (std::uint32_t number = 0; number < count; ++number) {
      check_stop();
      items.push_back({box_of(number), number});
    }
    grow_over(items, check_stop);
  }

  /// Calls meet(number) for every box that the line cuts ahead of 0 and enters no farther than
  /// `limit`, which meet may lower. Nearer boxes come first, approximately.
  template <class Meet>
  void walk(const BoxLine& line, const double& limit, Meet&& meet) const {
    if (order_.empty()) return;
    struct Later {
      const Branch* branch;
      double enter;
    };
    std::array<Later, deepest + 2> stack;
    std::size_t height = 0;
    stack[height++] = {&root_, 0.0};
    while (height > 0) {
      const auto [branch, enter] = stack[--height];
      if (enter > limit) continue;
      if (branch->count > 0) {
        for (std::uint32_t i = 0; i < branch->count; ++i) meet(order_[branch->first + i]);
        continue;
      }
      const auto& [one, other] = forks_[branch->first];
      const BoxLine::Cut a = line.cut(one.box), b = line.cut(other.box);
      const bool other_first = b.enter < a.enter;
      if (other_first && a.ahead()) stack[height++] = {&one, a.enter};
      if (b.ahead()) stack[height++] = {&other, b.enter};
      if (!other_first && a.ahead()) stack[height++] = {&one, a.enter};
    }
  }

 private:
  static constexpr std::size_t leaf = 4;
  static constexpr std::size_t deepest = 32;  // halving 2^32 boxes

  /// A leaf holds order_[first] and the next `count`; if count is 0, its children are
  /// forks_[first].
  struct Branch {
    Box box = no_box;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  struct Item {
    Box box;
    std::uint32_t number;
  };
  void grow_over(std::span<Item> items, RareStopCheck& check_stop);
  Branch grow(std::span<Item> items, RareStopCheck& check_stop);

  Branch root_;
  std::vector<std::array<Branch, 2>> forks_;
  std::vector<std::uint32_t> order_;
};

}  // namespace ensonify::engine
