#include <algorithm>
#include <array>

#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/scene/scene.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

// The OpenEXR image of a run.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    engine::ImageReader image(tests::file_of(data, size, "line.exr"));
    const std::size_t rows = std::min<std::size_t>(image.rows(), 4);
    const std::array<std::string, 1> layers = {"intensity"};
    std::array<std::vector<float>, 1> values;
    image.read(image.rows() - rows, rows, layers, values);
    tests::promise(values[0].size() == rows * image.columns(), "each pixel has a value");
    image.text("sonar");
    image.names("class_names");
    image.number("range_m");
  } catch (const engine::SceneError&) {
  }
  return 0;
}
