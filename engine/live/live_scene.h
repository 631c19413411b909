#pragma once

#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

/// A scene made ready to be watched, and its frame of the seabed from above. A changed seabed
/// replaces it.
struct LiveScene {
  Scene scene;
  Simulator simulator;
  TrackPings track;
  Bytes bed;

  LiveScene(const Scene& of, const Preparation& how);

  /// Between pings; a tenth of a second where the track has one ping or no time.
  double interval_s() const;
  /// Between two pings of the track, or at one of them exactly.
  Pose pose_at(double along) const;
};

/// A scene with the surface that is chosen to watch it, where it leaves that open.
Scene as_watched(Scene scene);

}  // namespace ensonify::engine
