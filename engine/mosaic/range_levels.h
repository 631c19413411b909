#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace ensonify::engine {

/// The mean level of each side of a sonar over slant range divided by height, a ratio that fixes
/// the depression angle. Dividing by the mean level removes what depends on the range alone: beam,
/// grazing angle and a gain that does not fit (empirical gain normalisation).
class RangeLevels {
 public:
  RangeLevels();
  /// `side` is 0 or 1; `ratio` is slant range over height, infinite without a height.
  void add(std::size_t side, double ratio, double level);
  /// To be called once, after all levels are added.
  void finish();
  /// Interpolated; where nothing was added, the nearest mean; 1 for a side without any.
  double mean(std::size_t side, double ratio) const;

 private:
  struct Cell {
    double level = 0.0;  // the sum, then the mean
    double count = 0.0;
  };
  std::array<std::vector<Cell>, 2> cells_;  // in equal steps of the ratio's logarithm
};

}  // namespace ensonify::engine
