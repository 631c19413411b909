#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Pockmarks, scours and other hollows, scattered without order. Pockmarks measure metres to
/// hundreds of metres; in Belfast Bay they are on average 85 m wide and 7.6 m deep (Andrews and
/// others 2010).
struct PitRelief {
  double per_hectare = 10.0;     ///< number in 100 x 100 m; 0: none
  double diameter_m = 5.0;       ///< the median's
  double diameter_spread = 0.4;  ///< standard deviation of its logarithm
  double depth_ratio = 0.09;     ///< depth over diameter
  double rim_ratio = 0.0;        ///< height of the rim over the depth
  double elongation = 1.0;       ///< length over width, at the same area; scours are long
  double heading_rad = 0.0;      ///< of the long axis; its deep and steep end lies at the back
};

/// Adds such pits, each only if `allowed` is true of its middle; where two meet the deeper one
/// counts. Sets `marked` (one number per point of the field) to a pit's number, from 1, inside.
/// Throws std::invalid_argument for values that no pits have.
void add_pits(Heightfield& field, const PitRelief& relief, const LayerDraws& draws,
              const Allowed& allowed, std::span<std::uint32_t> marked);

/// How far a pit and its rim reach from its middle at most.
double reach_m(const PitRelief& relief);

const ReliefKind<PitRelief>& kind_of(const PitRelief&);

}  // namespace ensonify::engine
