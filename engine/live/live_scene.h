#pragma once

#include <ensonify/engine/live/line_ring.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

/// A scene made ready for the live view, with its bed frame. A change of the seabed replaces it.
struct LiveScene {
  Scene scene;
  Simulator simulator;
  TrackPings track;
  Bytes bed;

  LiveScene(const Scene& of, const Preparation& how);

  /// The time between pings; 0.1 s if the track has one ping or no times.
  double interval_s() const;
  /// The pose at ping number `along` of the track; between two pings it is interpolated.
  Pose pose_at(double along) const;
};

}  // namespace ensonify::engine
