#include <ensonify/engine/sonar/pulse.h>

#include <cmath>
#include <stdexcept>

namespace ensonify::engine {
namespace {

// Integral from 0 to x of the triangle 1 - |s| on [-1, 1], the bins' overlap.
double triangle_integral(double x) {
  const double s = std::min(std::abs(x), 1.0);
  return std::copysign(s - 0.5 * s * s, x);
}

}  // namespace

std::vector<double> pulse_kernel(double cell_m, double bin_m) {
  if (!(cell_m > 0.0 && bin_m > 0.0))
    throw std::invalid_argument("pulse_kernel: the range cell and the bin must be positive");
  const double half = 0.5 * cell_m / bin_m;
  std::vector<double> kernel;
  for (int d = 0; d < half + 1.0; ++d)
    kernel.push_back(triangle_integral(d + half) - triangle_integral(d - half));
  return kernel;
}

}  // namespace ensonify::engine
