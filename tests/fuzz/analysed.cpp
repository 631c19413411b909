#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/refine/progressive_mesh_file.h>
#include <ensonify/refine/tile_collapse.h>

#include "fuzz/fuzz.h"
#include "support/meshes.h"

using namespace ensonify;

// What an analysed seafloor says about itself, in a whole file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::TemporaryFolder folder;
  static const refine::TriangleMesh mesh = tests::open_grid(4, 3, 6.0, 0.5, 1);
  static const refine::ProgressiveMesh progressive(refine::build_by_tiles(mesh, 1));
  const std::vector<std::uint16_t> tags(mesh.faces.size(), 1);
  const std::string about(tests::text(data, size));
  refine::save(progressive, {.tags = tags, .about = about}, folder / "file");
  try {
    engine::Seafloor seafloor = engine::open_analysed(folder / "file");
    tests::promise(!seafloor.labels.empty(), "there is a label");
    for (std::uint32_t face = 0; face < seafloor.faces; ++face) try {
        const engine::Label& label = seafloor.labels.at(seafloor.label_of(face));
        tests::promise(
            label.sediment < seafloor.materials.size() && label.class_id < seafloor.classes.size(),
            "labels have names");
      } catch (const refine::MeshError&) {
      }
    engine::restore_mesh(seafloor);
    tests::check_mesh(seafloor.mesh);
  } catch (const refine::MeshError&) {
  }
  return 0;
}
