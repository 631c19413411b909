#include <filesystem>

#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>

#include "fuzz/fuzz.h"

using namespace ensonify;

// A survey grid in any supported format: written to a file, read and tessellated.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::filesystem::path file = tests::file_of(data, size, "grid.asc");
    tests::check_mesh(engine::tessellate(engine::read_survey(file, 0.0)));
  } catch (const refine::MeshError&) {
  }
  return 0;
}
