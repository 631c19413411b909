#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Boulders as relief: many boulders, each a few cells wide (a single boulder with fine detail is
/// an object). A current digs a moat in front of each and leaves a tail behind it.
struct BoulderField {
  double per_hectare = 60.0;  ///< number in 100 x 100 m; 0: none
  double diameter_m = 0.8;    ///< the median's; boulders are stones over 0.256 m (Wentworth 1922)
  double diameter_spread = 0.5;  ///< standard deviation of its logarithm
  double height_ratio = 0.5;     ///< height above the bed over the diameter; the rest is buried
  double scour_ratio = 0.15;     ///< depth of the moat over the height; 0: none
  double tail_ratio = 0.1;       ///< height of the tail over the height; 0: none
  /// 0: independent places. Above, the number per area changes over 8 to 60 diameters: it is
  /// (1 + c) v^c times its mean, where v is evenly distributed in (0, 1).
  double clustering = 2.0;
  double current_rad = 0.0;  ///< heading that the current goes to, and the tails point to
};

/// Adds such boulders, each only if `allowed` is true of its middle. Sets `marked` (one number per
/// point of the field) to a boulder's number, from 1, at the points where it is higher than the
/// other boulders. Throws std::invalid_argument for values that no boulders have.
void add_boulders(Heightfield& field, const BoulderField& boulders, const LayerDraws& draws,
                  const Allowed& allowed, std::span<std::uint32_t> marked);

/// How far a boulder, its moat and its tail reach from its middle at most.
double reach_m(const BoulderField& boulders);

const ReliefKind<BoulderField>& kind_of(const BoulderField&);

}  // namespace ensonify::engine
