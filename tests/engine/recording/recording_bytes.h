#pragma once

// Bytes of recordings that a test writes itself.

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/message.h"

#include <ensonify/engine/recording/recording_reader.h>

namespace ensonify::tests {

/// Puts a number at an offset of bytes, or of characters.
template <class Number, class Bytes>
void put(Bytes&& bytes, std::size_t offset, Number value) {
  REQUIRE(offset + sizeof value <= bytes.size());
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

inline std::string error_of(std::span<const std::byte> bytes) {
  return message_thrown<engine::RecordingError>([&] { engine::parse_recording(bytes, "r"); },
                                                "no error");
}
inline std::string error_of(const std::string& bytes) {
  return error_of(std::as_bytes(std::span(bytes)));
}

}  // namespace ensonify::tests
