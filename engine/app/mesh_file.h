#pragma once

#include <filesystem>
#include <optional>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/progressive_mesh_file.h>

#include "app.h"

namespace ensonify::engine::app {

/// A mesh that is read from a file: PLY, OBJ, STL or OFF by its extension; any other file is read
/// as a survey grid, which is kept, too. `cell_m` is as in SurveyFile.
struct MeshFile {
  std::optional<Heightfield> grid;
  refine::TriangleMesh mesh;

  explicit MeshFile(const std::filesystem::path& file, double cell_m = 0.0) {
    if (refine::is_progressive_mesh(file) || refine::HeightTiles::is_one(file))
      throw UsageError(
          file.string() +
          ": is an analysed seafloor, expected a mesh or a survey grid; give the file that it was "
          "made from, or write the seafloor of its scene as a mesh with "
          "`ensonify seafloor SCENE -o FILE.ply`");
    if (refine::mesh_format(file)) {
      mesh = refine::read_mesh(file);
    } else {
      grid = read_survey({file, cell_m}, 0.0);
      mesh = tessellate(*grid);
    }
  }
};

/// --survey-cell-m: the edge of the cells, for a grid whose file does not have it.
inline void add_cell(CLI::App& command, double& cell_m) {
  add_value(command, "--survey-cell-m", cell_m, "M",
            "Edge of the cells of an .npy grid or of soundings, as seafloor.survey_cell_m")
      ->check(number(1e-3, 1000.0));
}

}  // namespace ensonify::engine::app
