#include <iterator>
#include <system_error>

#include <ensonify/engine/dataset/merge.h>
#include <ensonify/engine/scene/scene.h>

#include "fuzz/fuzz.h"
#include "support/small_dataset.h"

using namespace ensonify;

// A dataset of one sample: dataset.json, then, each after a zero byte, sample.json and the labels
// of its picture. The hashes fit.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  const std::filesystem::path outer = folder / "outer";
  std::filesystem::remove_all(outer);
  const std::vector<std::string> texts = tests::texts(data, size, 3);
  tests::SmallDataset{texts[0], texts[1], texts[2]}.write(outer / "set");
  try {
    engine::merge(outer / "set", {}, {.webdataset = size % 2 == 0});
  } catch (const engine::SceneError&) {
  } catch (const std::system_error&) {  // such as a name that is too long for a file
  }
  const std::filesystem::directory_iterator beside(outer);
  tests::promise(std::distance(begin(beside), end(beside)) == 1, "merge writes into its folder");
  return 0;
}
