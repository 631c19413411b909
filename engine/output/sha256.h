#pragma once

#include <string>
#include <string_view>

namespace ensonify::engine {

/// The SHA-256 hash of bytes (FIPS 180-4), 64 hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace ensonify::engine
