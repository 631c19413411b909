#pragma once

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/vehicle_path.h>

namespace ensonify::engine {

/// The result of comparing the recorded headings with the samples.
struct HeadingCheck {
  double off_rad = 0.0;    ///< rms of the angles by which the headings were turned; 0: not turned
  bool exchanged = false;  ///< the samples show a crab angle of the other sign
  /// The headings were not compared, because half of the bed or more has ripples or other long
  /// forms (lasting_likeness()), which may drift sideways by themselves.
  bool long_forms = false;
};

/// Turns the slow part of the path's headings if the samples contradict them. A vehicle with the
/// crab angle c (heading minus course) that moves by a distance s moves sideways over the bed by s
/// sin(c). So the same bed comes nearer on one side and moves away on the other
/// (sideways_drift_m()). If headings are magnetic, or if a file has exchanged port and starboard,
/// this drift does not agree with sin(c).
HeadingCheck correct_heading(const LineWithBed& line, VehiclePath& path);

}  // namespace ensonify::engine
