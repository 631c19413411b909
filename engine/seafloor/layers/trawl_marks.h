#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Marks of otter trawls: pairs of furrows with berms on both sides. Each of the two doors of a
/// trawl leaves one furrow. Doors dig a few centimetres into sand and up to 0.4 m into mud. Furrows
/// are typically 0.2 to 2 m wide and, like the doors, some 20 to 120 m apart. The sweeps and the
/// ground gear between the doors leave fine furrows along the tow.
struct TrawlMarks {
  int count = 6;                 ///< pairs of furrows; 0: none
  double depth_m = 0.15;         ///< of a fresh furrow below the bed; its berms are 0.45 as high
  double width_m = 0.8;          ///< between the berms' inner feet
  double door_spacing_m = 40.0;  ///< between the furrows of a pair
  double sweep_depth_m =
      0.005;                 ///< rms height of the fine furrows midway between the doors; 0: none
  double heading_rad = 0.0;  ///< mean heading of the tows
  double heading_spread_rad = 0.2;  ///< standard deviation; half of the tows are reversed
  double wander_m = 3.0;            ///< rms distance of a tow from a straight line
};

/// Adds marks of tows at random places of the grid. The cross-section of the berms equals that of
/// the furrow. Each door leaves one mark. Sets `marked` (one number per point of the field) to the
/// number of a mark, from 1, at the points of its furrow and berms. The fine furrows between the
/// doors belong to no mark. Throws std::invalid_argument for values outside their ranges.
void add_trawl_marks(Heightfield& field, const TrawlMarks& marks, const LayerDraws& draws,
                     std::span<std::uint32_t> marked);

const ReliefKind<TrawlMarks>& kind_of(const TrawlMarks&);

}  // namespace ensonify::engine
