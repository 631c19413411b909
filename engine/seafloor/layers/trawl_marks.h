#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Marks of otter trawls: pairs of furrows, one of each door, with berms on both sides. Doors dig
/// a few centimetres into sand and up to 0.4 m into mud; furrows are typically 0.2 to 2 m wide,
/// their spacing is the doors', some 20 to 120 m. The sweeps and the ground gear between the doors
/// leave fine furrows along the tow.
struct TrawlMarks {
  int count = 6;                 ///< pairs; 0: none
  double depth_m = 0.15;         ///< of a fresh furrow below the bed; its berms rise 0.45 of that
  double width_m = 0.8;          ///< between the berms' inner feet
  double door_spacing_m = 40.0;  ///< between the furrows of a pair
  double sweep_depth_m = 0.005;  ///< rms height of the fine furrows midway between; 0: none
  double heading_rad = 0.0;      ///< of the tows
  double heading_spread_rad = 0.2;  ///< standard deviation; half of the tows are reversed
  double wander_m = 3.0;            ///< rms distance from a straight line
};

/// Adds such marks, of tows drawn over the grid. The berms hold what the furrow lost: their
/// cross-sections are equal. Sets `marked` (one number per point of the field) to a mark's number,
/// from 1, at the points of its furrow and berms; each door leaves one mark. The fine furrows
/// between the doors belong to no mark. Throws std::invalid_argument for values that no marks have.
void add_trawl_marks(Heightfield& field, const TrawlMarks& marks, const LayerDraws& draws,
                     std::span<std::uint32_t> marked);

const ReliefKind<TrawlMarks>& kind_of(const TrawlMarks&);

}  // namespace ensonify::engine
