#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/tables/vertical_pattern_reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    for (const auto& side : engine::parse_vertical_pattern(tests::text(data, size), "fuzz"))
      tests::promise(side.size() >= 2, "there are two levels");
  } catch (const engine::SceneError&) {
  }
  return 0;
}
