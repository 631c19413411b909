#pragma once

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/vehicle_path.h>

namespace ensonify::engine {

/// The result of comparing the recorded headings with the samples.
struct HeadingCheck {
  double off_rad = 0.0;    ///< rms by which the headings were turned; 0: they were kept
  bool exchanged = false;  ///< the samples fit a vehicle that crabs to the other side
  /// Not compared: half of the bed or more has ripples or other long forms (lasting_likeness()),
  /// whose sideways drift may be their own.
  bool long_forms = false;
};

/// Turns the slow part of the path's heading, if the samples contradict it. A vehicle that crabs by
/// c (heading less course) moves sideways over the bed by sin(c) times its way, so that the same
/// bed comes nearer on one side and gets farther on the other (sideways_drift_m()). Headings may be
/// magnetic, or a file may have exchanged port and starboard; then the drift does not agree with
/// sin(c).
HeadingCheck correct_heading(const LineWithBed& line, VehiclePath& path);

}  // namespace ensonify::engine
