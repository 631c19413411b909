#pragma once

#include <cmath>

namespace ensonify::scatter {

/// ln Gamma(x) of a positive number. std::lgamma is not used, because it also writes the sign of
/// Gamma to a variable that all threads share.
inline double log_gamma(double x) {
  int sign;
  return ::lgamma_r(x, &sign);
}

}  // namespace ensonify::scatter
