#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

namespace {

struct KnownKeys {
  std::vector<std::string> names;  ///< with dots, as for an override
  std::vector<std::string> values;

  /// The keys of a dumped scene, also those that are not set there.
  explicit KnownKeys(const std::string& dump) {
    std::istringstream lines(dump);
    std::string table;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with('[')) table = line.substr(1, line.find(']') - 1) + ".";
      const std::size_t begin = line.starts_with("# ") ? 2 : 0, equals = line.find(" =", begin);
      const std::string name = line.substr(begin, equals - begin);
      if (equals == line.npos || name.find(' ') != name.npos) continue;
      names.push_back(table + name);
      if (equals + 3 < line.size()) values.push_back(line.substr(equals + 3));
    }
  }
};

}  // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t largest);

// Changes bytes as libFuzzer does, or adds an override of a known key by a value that some key has.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t largest, unsigned seed) {
  static const KnownKeys keys(engine::dump_scene(engine::Scene{}));
  std::minstd_rand random(seed);
  const auto any = [&](const auto& list) { return list[random() % list.size()]; };
  const std::string more = std::string(1, '\0') + any(keys.names) + "=" + any(keys.values);
  if (random() % 4 != 0 || size + more.size() > largest)
    return LLVMFuzzerMutate(data, size, largest);
  more.copy(reinterpret_cast<char*>(data) + size, more.size());
  return size + more.size();
}

// The text of a scene; each text after a zero byte is an override. A scene that was read, written
// and read again must be the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder =
      tests::file_of(nullptr, 0, "file").parent_path();  // for keys that name a file
  std::vector<std::string> overrides = tests::texts(data, size, 1);
  const std::string scene = overrides.front();
  overrides.erase(overrides.begin());
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
