#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Rock that stands out of the sediment: tilted beds of equal thickness, divided by joints into
/// blocks that end in ledges. All values are typical; there is no common law of outcrops.
struct OutcropRelief {
  double height_m = 2.0;           ///< how far the rock rises where the weight of its area is 1
  double ledge_m = 0.5;            ///< thickness of a bed, the height of a step; 0: no ledges
  double dip_rad = 0.05;           ///< how steeply the beds sink
  double dip_heading_rad = 0.0;    ///< the direction in which the beds sink
  double roughness_at_1m_m = 0.1;  ///< rms height difference of points 1 m apart on the rock
  double hurst = 0.7;              ///< Hurst exponent H of the roughness
};

/// Adds rock where it is above `field`, the surface of the sediment. Its height over the sediment
/// is -height_m at a `weight` of 0 and height_m at a weight of 1 (one weight per point). Sets
/// `marked` to 1 where rock is visible. Throws std::invalid_argument for wrong values.
void add_outcrops(Heightfield& field, const OutcropRelief& relief, const LayerDraws& draws,
                  std::span<const double> weight, std::span<std::uint32_t> marked);

const ReliefKind<OutcropRelief>& kind_of(const OutcropRelief&);

}  // namespace ensonify::engine
