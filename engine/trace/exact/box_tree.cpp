#include <ensonify/engine/trace/exact/box_tree.h>

#include <algorithm>

namespace ensonify::engine {
namespace {

// Along an axis on which a line hardly moves, so that its reciprocal could overflow, boxes do not
// bound the line.
constexpr double slowest = 0x1p-900;

double inverse_of(double component) {
  if (component == 0.0) return std::copysign(std::numeric_limits<double>::infinity(), component);
  if (std::abs(component) < slowest) return std::numeric_limits<double>::quiet_NaN();
  return 1.0 / component;
}

}  // namespace

BoxLine::BoxLine(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)
    : origin_(origin), inverse_(direction.unaryExpr(&inverse_of)) {
  for (int axis = 0; axis < 3; ++axis) backwards_[axis] = std::signbit(direction[axis]);
}

void BoxTree::grow_over(std::span<Item> items, RareStopCheck& check_stop) {
  forks_.clear();
  order_.clear();
  order_.reserve(items.size());
  root_ = grow(items, check_stop);
}

BoxTree::Branch BoxTree::grow(std::span<Item> items, RareStopCheck& check_stop) {
  Branch branch;
  if (items.size() <= leaf) {
    branch.first = static_cast<std::uint32_t>(order_.size());
    branch.count = static_cast<std::uint32_t>(items.size());
    for (const Item& item : items) {
      order_.push_back(item.number);
      branch.box.take(item.box);
    }
    return branch;
  }
  const auto middle = [](const Item& item) -> Eigen::Vector3f {
    return item.box.corner[0] + item.box.corner[1];  // twice the middle
  };
  Box middles = no_box;
  for (const Item& item : items) middles.take(middle(item));
  int axis = 0;
  (middles.corner[1] - middles.corner[0]).maxCoeff(&axis);
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [&](const Item& a, const Item& b) {
                     check_stop();
                     return middle(a)[axis] < middle(b)[axis];
                   });
  branch.first = static_cast<std::uint32_t>(forks_.size());
  forks_.emplace_back();
  const Branch low = grow(items.first(half), check_stop),
               high = grow(items.subspan(half), check_stop);
  forks_[branch.first] = {low, high};
  branch.box.take(low.box);
  branch.box.take(high.box);
  return branch;
}

}  // namespace ensonify::engine
