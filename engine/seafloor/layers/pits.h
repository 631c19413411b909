#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Pockmarks, scours and other hollows at random places. Pockmarks are metres to hundreds of metres
/// wide; in Belfast Bay they are on average 85 m wide and 7.6 m deep (Andrews and others 2010).
struct PitRelief {
  double per_hectare = 10.0;     ///< number in 100 x 100 m; 0: none
  double diameter_m = 5.0;       ///< median
  double diameter_spread = 0.4;  ///< standard deviation of the diameter's logarithm
  double depth_ratio = 0.09;     ///< depth / diameter
  double rim_ratio = 0.0;        ///< height of the rim / depth
  double elongation = 1.0;       ///< length / width, for the same area; scours are long
  double heading_rad = 0.0;      ///< of the long axis; the deep and steep end is at the back
};

/// Adds pits whose middle is `allowed`. Where two pits overlap, the deeper one counts. Sets
/// `marked` (one number per point of the field) to the number, from 1, of the pit at the point.
/// Throws std::invalid_argument for values outside their ranges.
void add_pits(Heightfield& field, const PitRelief& relief, const LayerDraws& draws,
              const Allowed& allowed, std::span<std::uint32_t> marked);

/// The greatest distance of a pit and its rim from the pit's middle.
double reach_m(const PitRelief& relief);

const ReliefKind<PitRelief>& kind_of(const PitRelief&);

}  // namespace ensonify::engine
