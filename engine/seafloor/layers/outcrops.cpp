#include <ensonify/engine/seafloor/layers/outcrops.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/seafloor/bed/fractal.h>

namespace ensonify::engine {
namespace {

constexpr double riser = 0.18;  // share of a bed's edge that is steep

/// A staircase that keeps to v within a step: treads, and between them steep risers.
double stairs(double v) {
  const double whole = std::floor(v);
  const double edge = std::clamp((v - whole - (1.0 - riser)) / riser, 0.0, 1.0);
  return whole + edge * edge * (3.0 - 2.0 * edge);
}

}  // namespace

void add_outcrops(Heightfield& field, const OutcropRelief& relief, const LayerDraws& draws,
                  std::span<const double> weight, std::span<std::uint32_t> marked) {
  check_relief(relief);
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

const ReliefKind<OutcropRelief>& kind_of(const OutcropRelief&) {
  static const ReliefKind<OutcropRelief> kind{
      .list = "outcrops",
      .help =
          "A layer of tilted beds of rock that stand out of the sediment in ledges. Over the "
          "width border_m it rises from as far below the bed as it stands above it.",
      .purpose = Purpose::outcrop_layer,
      .class_name = "outcrop",
      .material = "rock",
      .area = {.share = 0.3, .border_m = 30.0},  // over which the rock rises
      .add = &add_outcrops,
      .values = {
          {"height_m", "m", 0, 1000,
           "How far the rock rises; at the area's border it is level with the bed.",
           &OutcropRelief::height_m},
          {"ledge_m", "m", 0, 1000, "Height of a ledge: a bed's thickness; 0: no ledges.",
           &OutcropRelief::ledge_m},
          {"dip_deg", "degrees", 0, 45, "How steeply the beds sink.", &OutcropRelief::dip_rad},
          {"dip_heading_deg", "degrees", -360, 360,
           "Direction in which they sink; ledges run across it.", &OutcropRelief::dip_heading_rad},
          {"roughness_at_1m_m", "m", 0, 100,
           "Rms height difference of points 1 m apart on the rock.",
           &OutcropRelief::roughness_at_1m_m},
          {"hurst", "", 0.01, 0.99, "Hurst exponent of that.", &OutcropRelief::hurst},
      }};
  return kind;
}

}  // namespace ensonify::engine
