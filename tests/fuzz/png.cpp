#include <stdexcept>

#include <ensonify/engine/output/png.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const engine::Picture picture = engine::decode_png(std::as_bytes(std::span(data, size)));
    engine::encode_png(picture);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
