#pragma once

#include <array>

#include <ensonify/engine/simulator/prepare.h>

namespace ensonify::engine {

/// How near and how high the bed is in the sectors of a sonar.
struct BedAbeam {
  double nearest_m;  ///< range, at most the height over the bed straight below
  /// By sector: how far the bed reaches above the horizontal; 0 if it does not.
  std::array<double, most_sectors> rise_rad;
};

/// Measures the bed at places abeam of a sonar, within its range. height_m: height of the sonar
/// over the bed straight below. highest_m: no bed is higher.
///
/// For the nearest range, one place is measured at the far end of each half octave of distance. The
/// bed at this place is taken to begin at the near end of the half octave. So the range is up to 30
/// % too short, and hardly ever too long. A bed that is nearer by less than one step of RayLayouts
/// is ignored, because the layout would hardly change. For the rise, one place in each quarter
/// octave is measured.
BedAbeam look_abeam(const Pose& pose, const Sonar& sonar, double height_m, double highest_m,
                    BedHeight& bed);

}  // namespace ensonify::engine
