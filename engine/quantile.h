#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace ensonify::engine {

/// The value below which a share of them lies (0 of none): the first one that does not.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at =
      static_cast<std::ptrdiff_t>(std::min(share * static_cast<double>(values.size()), last));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

}  // namespace ensonify::engine
