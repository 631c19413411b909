#pragma once

#include <filesystem>
#include <optional>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/refine/mesh_reader.h>

namespace ensonify::engine::app {

/// A mesh read from a file: PLY, OBJ, STL or OFF by its extension, else a survey grid, which is
/// kept as well.
struct MeshFile {
  std::optional<Heightfield> grid;
  refine::TriangleMesh mesh;

  explicit MeshFile(const std::filesystem::path& file) {
    if (refine::mesh_format(file)) {
      mesh = refine::read_mesh(file);
    } else {
      grid = read_survey(file, 0.0);
      mesh = tessellate(*grid);
    }
  }
};

}  // namespace ensonify::engine::app
