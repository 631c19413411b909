#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/seafloor/objects/laid_line.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::vector<Eigen::Vector2d> path =
        engine::read_path(tests::file_of(data, size, "path.csv"));
    tests::promise(path.size() >= 2, "there are two points");
    for (const Eigen::Vector2d& point : path)
      tests::promise(point.allFinite(), "points are finite");
  } catch (const engine::SceneError&) {
  }
  return 0;
}
