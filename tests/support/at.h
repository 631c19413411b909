#pragma once

#include <cstddef>
#include <cstring>

#include "support/catch.h"

namespace ensonify::tests {

/// The value of type T that begins at an offset of bytes, or of characters.
template <class T, class Bytes>
T at(const Bytes& bytes, std::size_t offset) {
  if (offset + sizeof(T) > bytes.size()) FAIL("no value at offset " << offset);
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

}  // namespace ensonify::tests
