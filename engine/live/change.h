#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/live/session.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

/// What the vehicle is asked to fly at.
struct Vehicle {
  double altitude_m = 0.0, speed_mps = 0.0;
};

/// An object to lie on the bed, as seen from the vehicle.
struct AddedObject {
  MovingObject object;
  double ahead_m, starboard_m;
};

/// A scene with other values.
struct SceneChange {
  std::vector<std::string> overrides;  ///< all, the new ones last
  std::size_t before = 0;              ///< how many of them there were
  Scene scene;
  Vehicle vehicle;
  std::vector<std::pair<std::size_t, Sonar>> sonars;  ///< that are set anew, with their numbers
  std::optional<Display> display;
  bool seabed = false;  ///< whether the rest changes, too: it is to be made ready anew
};

/// What LiveSession::change() was asked for, found right.
struct LiveChange {
  std::optional<SceneChange> set;
  std::optional<bool> hold;
  std::optional<std::optional<double>> pings_per_s;  ///< as LiveOptions has it
  std::optional<AddedObject> add;
  bool clear = false, again = false;
};

/// Reads a change of a session that is as `now` says, flown as `vehicle` says. Throws as
/// LiveSession::change().
LiveChange read_change(std::string_view json, const LiveOptions& now, const Vehicle& vehicle);

}  // namespace ensonify::engine
