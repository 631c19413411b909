#pragma once

#include <string>

#include <ensonify/engine/sonar/beam_pattern.h>

namespace ensonify::engine {

/// One instrument: a line array a side, looking to port and starboard.
struct Sonar {
  std::string name = "sidescan";
  double frequency_hz = 400e3;
  double source_level_db = 210.0;  ///< dB re 1 uPa at 1 m, on the axis of the beam
  double bandwidth_hz = 30e3;      ///< of the pulse: its effective length is 1 / bandwidth
  double range_m = 75.0;           ///< slant range of the last bin's far edge
  int bins = 1500;                 ///< a side
  double array_length_m = 0.5;
  VerticalPattern vertical;
  double sector_low_rad = -0.17453292519943295;  ///< -10 degrees: depression where the fan begins
  double sector_high_rad = 1.5707963267948966;   ///< 90 degrees: and where it ends
  int planes = 8;                                ///< fan planes across the main lobe
  int elevations = 2048;                         ///< rays a plane

  double bin_m() const { return range_m / bins; }
};

enum class Side { port, starboard };

}  // namespace ensonify::engine
