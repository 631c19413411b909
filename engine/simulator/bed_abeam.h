#pragma once

#include <array>

#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// How near and how high the bed is in the sectors of a sonar.
struct BedAbeam {
  double nearest_m;  ///< range, at most the height over the bed below
  /// By sector: how far it reaches above the horizontal; 0 if not.
  std::array<double, most_sectors> rise_rad;
};

/// Looks at places abeam of a sonar within its range. Height is the sonar's over the bed below it;
/// no bed is higher than highest_m.
///
/// The nearest range: a place in each half octave of distance, at its far end, whose bed is taken
/// to begin at the near end. So the range is up to 30 % too short, and hardly ever too long. A bed
/// that is nearer by less than one step of RayLayouts is ignored: the layout would hardly change.
/// The rise: a place in each quarter octave.
BedAbeam look_abeam(const Pose& pose, const Sonar& sonar, double height_m, double highest_m,
                    BedHeight& bed);

}  // namespace ensonify::engine
