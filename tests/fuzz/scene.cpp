#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/scene/reader.h>

#include "fuzz/fuzz.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

using namespace ensonify;

// The text of a scene; each text after a zero byte is an override. A scene that was read, written
// and read again must be the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    static const tests::TemporaryFolder own;
    tests::write_text(own / "file", "");  // for keys that name a file
    return own.path();
  }();
  std::string_view scene = tests::text(data, size);
  std::vector<std::string> overrides;
  for (std::size_t zero; (zero = scene.rfind('\0')) != std::string_view::npos;
       scene = scene.substr(0, zero))
    overrides.emplace_back(scene.substr(zero + 1));
  std::string dump;
  const engine::ScenePaths paths{folder, {}};
  try {
    dump = engine::dump_scene(engine::parse_scene(scene, "fuzz", overrides, paths));
  } catch (const engine::SceneError&) {
    return 0;
  }
  tests::promise(engine::dump_scene(engine::parse_scene(dump, "dump", {}, paths)) == dump,
                 "a scene that was written reads back");
  return 0;
}
