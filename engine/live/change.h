#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
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

/// A change of altitude and speed. What is unset stays.
struct VehicleChange {
  std::optional<double> altitude_m, speed_mps;

  /// This change, followed by a later one.
  VehicleChange then(const VehicleChange& later) const {
    return {later.altitude_m ? later.altitude_m : altitude_m,
            later.speed_mps ? later.speed_mps : speed_mps};
  }
  Vehicle applied_to(const Vehicle& vehicle) const {
    return {altitude_m.value_or(vehicle.altitude_m), speed_mps.value_or(vehicle.speed_mps)};
  }
};

/// An object to put on the bed at a position relative to the vehicle.
struct AddedObject {
  MovingObject object;
  double ahead_m, starboard_m;
};

/// A scene with changed keys.
struct SceneChange {
  std::vector<KeyValue> keys;  ///< the changed keys, which the session keeps
  SessionScene before;         ///< the session's scene without these changes
  Scene scene;                 ///< with these changes
  VehicleChange vehicle;
  std::vector<std::pair<std::size_t, Sonar>> sonars;  ///< the changed sonars, with their numbers
  std::optional<Display> display;
  bool seabed = false;  ///< keys of the seabed or others change: the scene must be made ready again
};

/// Changes these keys of a scene; the vehicle does not change. Throws SceneError.
SceneChange scene_change(std::vector<KeyValue> keys, const SessionScene& before);

/// A valid request to LiveSession::change().
struct LiveChange {
  std::optional<SceneChange> set;
  std::optional<bool> hold;
  std::optional<std::optional<double>> pings_per_s;  ///< as in LiveOptions
  std::optional<AddedObject> add;
  bool clear = false, again = false;
};

/// Reads a change request. `now` is the session's present scene, and `objects` is the number of
/// objects added so far. Throws as LiveSession::change().
LiveChange read_change(std::string_view json, const SessionScene& now, std::uint32_t objects = 0);

}  // namespace ensonify::engine
