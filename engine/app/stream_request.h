#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ensonify/engine/session_keys.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine::app {

inline constexpr std::size_t longest_request = 1 << 20;  ///< in bytes

/// A line that `ensonify stream` reads.
struct StreamRequest {
  enum class Kind { ping, set, add, move, remove };
  Kind kind = Kind::ping;
  std::vector<KeyValue> keys = {};  ///< the keys of sonars to set, or of an object to add
  std::uint32_t instance = 0;       ///< the object to move or to remove
  Pose pose = {};                   ///< the pose of a ping, or of an object to add or to move
};

/// Reads a line. Throws std::invalid_argument if it is not a request.
StreamRequest read_stream_request(const std::string& line);

}  // namespace ensonify::engine::app
