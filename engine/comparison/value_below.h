#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace ensonify::engine {

/// The value below which a share of them lies; NaN if there are fewer values than `fewest`.
inline double value_below(std::vector<double> values, double share, std::size_t fewest) {
  if (values.size() < fewest) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace ensonify::engine
