#include <filesystem>
#include <string>

#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>

#include "fuzz/fuzz.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

using namespace ensonify;

// A survey grid in any supported format: written to a file, read and tessellated.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  static const std::filesystem::path file = folder / "grid.asc";
  tests::write_text(file, std::string(tests::text(data, size)));
  try {
    tests::check_mesh(engine::tessellate(engine::read_survey(file, 0.0)));
  } catch (const refine::MeshError&) {
  }
  return 0;
}
