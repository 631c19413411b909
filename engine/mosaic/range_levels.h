#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace ensonify::engine {

/// The mean level of each side of a sonar over the ratio of slant range to height, which defines
/// the depression angle over a level bed. Dividing a level by the mean level removes the effects of
/// beam, grazing angle and a wrong gain over range (empirical gain normalisation).
class RangeLevels {
 public:
  RangeLevels();
  /// `side` is 0 or 1; `ratio` is slant range divided by height, infinite if the height is 0.
  void add(std::size_t side, double ratio, double level);
  /// Call this once, after all levels are added and before mean().
  void finish();
  /// The mean level, interpolated over the ratio. Where no level was added, it is the nearest mean;
  /// it is 1 for a side without levels.
  double mean(std::size_t side, double ratio) const;

 private:
  struct Cell {
    double level = 0.0;  // the sum of levels; after finish() their mean
    double count = 0.0;
  };
  std::array<std::vector<Cell>, 2> cells_;  // by side, in equal steps of the ratio's logarithm
};

}  // namespace ensonify::engine
