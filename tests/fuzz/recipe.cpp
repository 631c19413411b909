#include <algorithm>

#include <ensonify/engine/dataset/recipe.h>

#include "fuzz/fuzz.h"
#include "support/temporary_folder.h"

using namespace ensonify;

// The text of a recipe. Its first samples are drawn.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  try {
    const engine::Recipe recipe(std::string(tests::text(data, size)), "fuzz", folder.path());
    tests::promise(recipe.class_names().size() >= recipe.target_classes(), "targets are classes");
    for (std::size_t k = 0; k < std::min<std::size_t>(recipe.samples(), 3); ++k)
      tests::promise(recipe.sample(k).seafloor < recipe.seafloors(), "the seafloor exists");
  } catch (const engine::SceneError&) {
  }
  return 0;
}
