#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/session_keys.h>
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
  std::vector<KeyValue> keys;  ///< that are to be kept
  SessionScene before;         ///< the session's scene without them
  Scene scene;
  Vehicle vehicle;
  std::vector<std::pair<std::size_t, Sonar>> sonars;  ///< that are set again, by number
  std::optional<Display> display;
  bool seabed = false;  ///< whether other keys change, so that it has to be made ready again
};

/// What LiveSession::change() was asked for, once it is checked.
struct LiveChange {
  std::optional<SceneChange> set;
  std::optional<bool> hold;
  std::optional<std::optional<double>> pings_per_s;  ///< as LiveOptions has it
  std::optional<AddedObject> add;
  bool clear = false, again = false;
};

/// Reads a change of a session whose scene is `now`, flown at `vehicle`. Throws as
/// LiveSession::change().
LiveChange read_change(std::string_view json, const SessionScene& now, const Vehicle& vehicle);

}  // namespace ensonify::engine
