#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

/// The altitude and speed that the vehicle is to keep.
struct Vehicle {
  double altitude_m = 0.0, speed_mps = 0.0;
};

/// A change of these; what is unset stays.
struct VehicleChange {
  std::optional<double> altitude_m, speed_mps;

  /// This change and then another one.
  VehicleChange then(const VehicleChange& later) const {
    return {later.altitude_m ? later.altitude_m : altitude_m,
            later.speed_mps ? later.speed_mps : speed_mps};
  }
  Vehicle applied_to(const Vehicle& vehicle) const {
    return {altitude_m.value_or(vehicle.altitude_m), speed_mps.value_or(vehicle.speed_mps)};
  }
};

/// An object to put on the bed; its position is relative to the vehicle.
struct AddedObject {
  MovingObject object;
  double ahead_m, starboard_m;
};

/// A scene with changed keys.
struct SceneChange {
  std::vector<KeyValue> keys;  ///< the changed ones, to be kept
  SessionScene before;         ///< the session's scene without them
  Scene scene;
  VehicleChange vehicle;
  std::vector<std::pair<std::size_t, Sonar>> sonars;  ///< the changed ones, with their numbers
  std::optional<Display> display;
  bool seabed = false;  ///< other keys change too: the scene must be made ready again
};

/// The change of these keys, without a change of the vehicle. Throws SceneError.
SceneChange scene_change(std::vector<KeyValue> keys, const SessionScene& before);

/// A valid request to LiveSession::change().
struct LiveChange {
  std::optional<SceneChange> set;
  std::optional<bool> hold;
  std::optional<std::optional<double>> pings_per_s;  ///< as in LiveOptions
  std::optional<AddedObject> add;
  bool clear = false, again = false;
};

/// Reads a change request. `now` is the session's present scene, and `objects` is how many have
/// been added so far. Throws as LiveSession::change().
LiveChange read_change(std::string_view json, const SessionScene& now, std::uint32_t objects = 0);

}  // namespace ensonify::engine
