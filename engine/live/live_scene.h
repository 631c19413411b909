#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/live/change.h>
#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/scene/checks/extrapolation.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// A scene made ready for the live view, with its bed frame. A change of the seabed replaces it.
struct LiveScene {
  Scene scene;
  MemoryLimit memory;
  Simulator simulator;
  TrackPings track;
  Bytes bed;

  LiveScene(const Scene& of, const Preparation& how);

  /// The altitude and speed of the track; for a recorded track their medians.
  Vehicle planned() const;
  /// The warnings of the scene and of its track, without those of extrapolation().
  std::vector<std::string> warnings() const;
  Extrapolation extrapolation() const;
  std::vector<std::string> all_warnings() const { return extrapolation().appended_to(warnings()); }
  /// The time between pings; 0.1 s if the track has one ping or no times.
  double interval_s() const;
  /// The pose at ping number `along` of the track, interpolated between two pings.
  Pose pose_at(double along) const;
};

/// The scene's display without what needs more than one line (normalisations, equalisation,
/// smoothing), in slant range and grey.
Display line_display(Display display);

/// A warning that names the display's keys that line_display() switches off and that the page does
/// not apply. Empty if none of them is set.
std::string keys_without_effect(const Display& display);

/// The setting frame, which describes the lines after it: sonars, names, palettes, the display and
/// the seabed. `name` is the scene's name.
Bytes setting_frame(const LiveScene& live, const Display& display, const std::string& name);

}  // namespace ensonify::engine
