#include <ensonify/engine/seafloor/layers/pits.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double largest_of_median = 3.5;

void check(const PitRelief& relief) {
  const auto require = [](bool holds, const char* what, double value) {
    if (!holds) throw std::invalid_argument(fmt::format("pits: the {} is {}", what, value));
  };
  const auto in = [](double x, double low, double high) { return x >= low && x <= high; };
  require(in(relief.per_hectare, 0.0, 1e5), "number a hectare", relief.per_hectare);
  require(in(relief.diameter_m, 1e-3, 1e4), "diameter in metres", relief.diameter_m);
  require(in(relief.diameter_spread, 0.0, 2.0), "spread of diameters", relief.diameter_spread);
  require(in(relief.depth_ratio, 0.0, 1.0), "depth over diameter", relief.depth_ratio);
  require(in(relief.rim_ratio, 0.0, 1.0), "rim over depth", relief.rim_ratio);
  require(in(relief.elongation, 1.0, 20.0), "elongation", relief.elongation);
  const double cover = 1e-4 * relief.per_hectare * relief.diameter_m * relief.diameter_m;
  require(cover <= 10.0, "number of times that they would cover the bed", cover);
  require(std::isfinite(relief.heading_rad), "heading", relief.heading_rad);
}

}  // namespace

void add_pits(Heightfield& field, const PitRelief& relief, const LayerDraws& draws,
              const Allowed& allowed, std::span<std::uint32_t> marked) {
  check(relief);
  std::vector<double> change(field.z_m.size(), 0.0);
  const double stretch = std::sqrt(relief.elongation);
  const double reach = 0.75 * stretch * largest_of_median * relief.diameter_m;
  std::uint32_t number = 0;
  const auto dig = [&](double x, double y, const auto& u) {
    if (!allowed(x, y)) return;
    ++number;
    const double normal = std::sqrt(-2.0 * std::log(u[2])) * std::cos(2.0 * pi * u[3]);
    const double diameter_m =
        relief.diameter_m * std::min(largest_of_median, std::exp(relief.diameter_spread * normal));
    const double depth_m = relief.depth_ratio * diameter_m * (0.7 + 0.6 * u[4]);
    // Round ones have an axis of their own.
    const double heading =
        relief.elongation > 1.0 ? relief.heading_rad + 0.3 * (u[5] - 0.5) : 2.0 * pi * u[5];
    const double along_x = std::sin(heading), along_y = std::cos(heading);
    for_each_point_near(
        field, x, y, 0.75 * stretch * diameter_m, [&](int column, int row, double dx, double dy) {
          const double along = (dx * along_x + dy * along_y) / (0.5 * diameter_m * stretch);
          const double across = (dx * along_y - dy * along_x) / (0.5 * diameter_m) * stretch;
          const double angle = std::atan2(across, along);
          // Not a circle: the slumped wall stands a few hundredths in or out.
          const double outline = 1.0 + 0.07 * std::cos(2.0 * angle + 2.0 * pi * u[6]) +
                                 0.05 * std::cos(3.0 * angle + 2.0 * pi * u[7]) +
                                 0.03 * std::cos(5.0 * angle + 2.0 * pi * u[8]);
          const double r = std::hypot(along, across) / outline;
          if (r >= 1.4) return;
          const std::size_t point = field.index(column, row);
          if (r < 1.0) {
            // Deepest behind the middle of a long one, as a current leaves it.
            const double lean = 1.0 - 0.5 * std::min(1.0, relief.elongation - 1.0) * along;
            const double bowl = 1.0 - r * r;
            const double floor_m = -depth_m * bowl * bowl * std::max(0.3, lean);
            if (floor_m < change[point] || marked[point] == 0) marked[point] = number;
            change[point] = std::min(change[point], floor_m);
          }
          const double from_rim = (r - 1.05) / 0.16;
          if (change[point] >= 0.0)
            change[point] = std::max(change[point],
                                     depth_m * relief.rim_ratio * std::exp(-from_rim * from_rim));
        });
  };
  for_each_scattered(field, 1e-4 * relief.per_hectare, reach, draws, 1, dig);
  for (std::size_t i = 0; i < change.size(); ++i) field.z_m[i] += change[i];
}

}  // namespace ensonify::engine
