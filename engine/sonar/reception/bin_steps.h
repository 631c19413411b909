#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace ensonify::engine {

/// The next bin at which a smooth function of range is evaluated. Between these bins it is
/// interpolated linearly. The function has a kink at bin `first`: steps are one bin there and grow
/// with the distance from it, up to 1/64 of the range.
inline std::size_t next_step(std::size_t n, std::size_t first) {
  return n + std::max<std::size_t>(1, std::min((n - first) / 16, n / 64));
}

/// Calls add(n, value) for the bins [begin, end). Evaluates f only at the bins of next_step(), and
/// interpolates between them.
template <class F, class Add>
void over_bins(std::size_t begin, std::size_t end, F&& f, Add&& add) {
  if (begin >= end) return;
  double here = f(begin);
  for (std::size_t n = begin; n < end;) {
    const std::size_t to = std::min(next_step(n, begin), end);
    const double next = f(std::min(to, end - 1));
    const double slope = (next - here) / static_cast<double>(to - n);
    for (std::size_t i = n; i < to; ++i) add(i, here + static_cast<double>(i - n) * slope);
    here = next;
    n = to;
  }
}

/// The steps of tables over the sine of the grazing angle.
inline constexpr std::size_t sine_steps = 1024;

/// The value of a table over the sine of the grazing angle, which has equal steps from 0 to 1.
inline double at_sine(std::span<const double> table, double sine) {
  const std::size_t steps = table.size() - 1;
  const double place = sine * static_cast<double>(steps);
  const std::size_t step = std::min(static_cast<std::size_t>(place), steps - 1);
  return std::lerp(table[step], table[step + 1], place - static_cast<double>(step));
}

}  // namespace ensonify::engine
