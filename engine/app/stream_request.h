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
  std::vector<KeyValue> keys = {};  ///< of a sonar to set, or of an object to add
  std::uint32_t instance = 0;       ///< the object to move or to remove
  Pose pose = {};                   ///< of a ping, or of an object to add or to move
};

/// Throws std::invalid_argument for anything but a request.
StreamRequest read_stream_request(const std::string& line);

}  // namespace ensonify::engine::app
