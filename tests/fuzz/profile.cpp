#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/tables/profile_reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    engine::parse_profile(tests::text(data, size), "fuzz");
  } catch (const engine::SceneError&) {
  }
  return 0;
}
