#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Boulders as relief: many boulders, each a few cells wide (a single boulder with fine detail is
/// an object). A current digs a moat in front of each and leaves a tail behind it.
struct BoulderField {
  double per_hectare = 60.0;  ///< number in 100 x 100 m; 0: none
  double diameter_m = 0.8;    ///< median; stones of more than 0.256 m are boulders (Wentworth 1922)
  double diameter_spread = 0.5;  ///< standard deviation of the diameter's logarithm
  double height_ratio = 0.5;     ///< height above the bed / diameter; the rest is buried
  double scour_ratio = 0.15;     ///< depth of the moat / height; 0: none
  double tail_ratio = 0.1;       ///< height of the tail / height; 0: none
  /// c. If c is 0, places are independent. Otherwise the number per area changes over 8 to 60
  /// diameters: it is (1 + c) v^c times its mean, where v is uniformly distributed in (0, 1).
  double clustering = 2.0;
  double current_rad = 0.0;  ///< direction to which the current flows and the tails point
};

/// Adds boulders whose middle is `allowed`. Sets `marked` (one number per point of the field) to
/// the number, from 1, of the highest boulder there. Throws std::invalid_argument for wrong values.
void add_boulders(Heightfield& field, const BoulderField& boulders, const LayerDraws& draws,
                  const Allowed& allowed, std::span<std::uint32_t> marked);

/// The greatest distance of a boulder, its moat and its tail from the boulder's middle.
double reach_m(const BoulderField& boulders);

const ReliefKind<BoulderField>& kind_of(const BoulderField&);

}  // namespace ensonify::engine
