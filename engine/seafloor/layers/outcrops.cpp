#include <ensonify/engine/seafloor/layers/outcrops.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/fractal.h>

namespace ensonify::engine {
namespace {

constexpr double riser = 0.18;  // share of a bed's edge that is steep

void check(const OutcropRelief& relief) {
  const auto require = [](bool holds, const char* what, double value) {
    if (!holds) throw std::invalid_argument(fmt::format("outcrops: the {} is {}", what, value));
  };
  const auto in = [](double x, double low, double high) { return x >= low && x <= high; };
  require(in(relief.height_m, 0.0, 1e3), "height in metres", relief.height_m);
  require(in(relief.ledge_m, 0.0, 1e3), "ledge in metres", relief.ledge_m);
  require(in(relief.dip_rad, 0.0, 1.0), "dip in radians", relief.dip_rad);
  require(std::isfinite(relief.dip_heading_rad), "dip's heading", relief.dip_heading_rad);
}

/// A staircase that keeps to v within a step: treads, and between them steep risers.
double stairs(double v) {
  const double whole = std::floor(v);
  const double edge = std::clamp((v - whole - (1.0 - riser)) / riser, 0.0, 1.0);
  return whole + edge * edge * (3.0 - 2.0 * edge);
}

}  // namespace

void add_outcrops(Heightfield& field, const OutcropRelief& relief, const LayerDraws& draws,
                  std::span<const double> weight, std::span<std::uint32_t> marked) {
  check(relief);
  if (relief.height_m == 0.0) return;
  Heightfield rough = field;
  std::ranges::fill(rough.z_m, 0.0);
  add_fractal(rough, {.height_at_1m_m = relief.roughness_at_1m_m, .hurst = relief.hurst},
              draws.of(1));
  const double sinks = std::tan(relief.dip_rad);
  const double east = std::sin(relief.dip_heading_rad), north = std::cos(relief.dip_heading_rad);
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const std::size_t point = field.index(column, row);
      const double eroded = relief.height_m * (2.0 * weight[point] - 1.0) + rough.z_m[point];
      double rock = eroded;
      if (relief.ledge_m > 0.0) {
        // Beds are counted across their dip: treads are parallel to it, risers where the eroded
        // surface leaves one bed for the next.
        const double bed = -sinks * (field.x_m(column) * east + field.y_m(row) * north);
        rock =
            bed + relief.ledge_m * stairs((eroded - bed) / relief.ledge_m) + 0.3 * rough.z_m[point];
      }
      if (rock <= 0.0) continue;
      field.z_m[point] += rock;
      marked[point] = 1;
    }
}

}  // namespace ensonify::engine
