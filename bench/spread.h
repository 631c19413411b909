#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace ensonify::bench {

/// The median of several measurements, and the limits between which four fifths of them lie.
struct Spread {
  double median = 0.0;
  double low = 0.0;
  double high = 0.0;
};

inline Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {at(0.5), at(0.1), at(0.9)};
}

}  // namespace ensonify::bench
