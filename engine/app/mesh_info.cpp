#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/refine/progressive_mesh_file.h>

#include "app.h"
#include "mesh_file.h"

namespace ensonify::engine::app {
namespace {

/// Prints the header and a summary of the table of a file with the tiles of a bed.
void print_tiles(const refine::HeightTiles& tiles) {
  const refine::HeightTiles::Shape& shape = tiles.shape();
  const Eigen::Vector3d& origin = shape.world_origin;
  const std::size_t cells = (shape.x_m.size() - 1) * (shape.y_m.size() - 1);
  refine::HeightGrid::Range all;
  for (const refine::HeightGrid::Range& range : tiles.ranges())
    if (range.known()) all.take(range);
  std::string out;
  const auto line = [&](std::string_view name, auto value) {
    out += fmt::format("{} {}\n", name, value);
  };
  line("columns", shape.x_m.size());
  line("rows", shape.y_m.size());
  line("triangles_without_holes", 2 * cells);
  line("x_min", origin.x() + shape.x_m.front());
  line("x_max", origin.x() + shape.x_m.back());
  line("y_min", origin.y() + shape.y_m.front());
  line("y_max", origin.y() + shape.y_m.back());
  line("tiles", tiles.tiles());
  line("tiles_made", tiles.tiles_made());
  if (!all.empty()) {
    line("z_min_of_made", origin.z() + all.lowest);
    line("z_max_of_made", origin.z() + all.highest);
  }
  line("mean_height_m", origin.z() + shape.mean_height_m);
  line("made_from", tiles.key());
  print(out);
}

/// Prints the sizes of a progressive mesh, which `analyse` wrote.
void print_progressive(const refine::ProgressiveMesh& mesh) {
  std::string out;
  const auto line = [&](std::string_view name, auto value) {
    out += fmt::format("{} {}\n", name, value);
  };
  mesh.verify_all();
  line("vertices", mesh.leaves());
  line("triangles", std::ranges::count_if(mesh.source_face, [](std::uint32_t face) {
         return face != refine::ProgressiveMesh::none;
       }));
  for (int axis = 0; axis < 3; ++axis) {
    line(fmt::format("{}_min", "xyz"[axis]), mesh.world_origin[axis] + mesh.bounds.lowest[axis]);
    line(fmt::format("{}_max", "xyz"[axis]), mesh.world_origin[axis] + mesh.bounds.highest[axis]);
  }
  line("base_vertices", mesh.roots.size());
  line("base_triangles", mesh.base_faces().size());
  line("made_from", mesh.key());
  print(out);
}

void print_info(const std::filesystem::path& file, double cell_m) {
  if (refine::HeightTiles::is_one(file)) return print_tiles(refine::HeightTiles(file));
  if (refine::is_progressive_mesh(file))
    return print_progressive(refine::map_progressive_mesh(file));
  const MeshFile input(file, cell_m);
  const refine::MeshSummary summary = refine::summarise(input.mesh);
  std::string out;
  const auto line = [&](std::string_view name, auto value) {
    out += fmt::format("{} {}\n", name, value);
  };
  line("vertices", summary.vertices);
  line("triangles", summary.faces);
  for (int axis = 0; axis < 3; ++axis) {
    line(fmt::format("{}_min", "xyz"[axis]), summary.lowest[axis]);
    line(fmt::format("{}_max", "xyz"[axis]), summary.highest[axis]);
  }
  line("boundary_edges", summary.boundary_edges);
  line("non_manifold_edges", summary.non_manifold_edges);
  const refine::RepairReport repairs = refine::repair(input.mesh).report;
  line("repairs", repairs.total());
  for (const auto& [name, count] : repairs.entries()) line(fmt::format("repair_{}", name), count);
  if (input.grid) {
    const Heightfield& grid = *input.grid;
    line("columns", grid.columns);
    line("rows", grid.rows);
    line("cell_east_m", grid.cell_east_m);
    line("cell_north_m", grid.cell_north_m);
    line("holes", std::ranges::count_if(grid.z_m, [](double z) { return std::isnan(z); }));
  }
  print(out);
}

}  // namespace

void add_mesh_info(CLI::App& app, Action& action) {
  const auto file = std::make_shared<std::filesystem::path>();
  const auto cell_m = std::make_shared<double>(0.0);
  CLI::App& command = *app.add_subcommand(
      "mesh-info",
      "Describe a mesh, a survey grid, a progressive mesh, or the tiles of a bed. A mesh is a PLY, "
      "OBJ, STL or OFF file, a progressive mesh is what `analyse` wrote, and tiles are in the cache. "
      "Prints one `name value` per line, in metres. Counts are of the file itself; repairs are the "
      "changes that a run would make");
  command.add_option("FILE", *file, "The mesh or grid")->required();
  add_cell(command, *cell_m);
  command.callback(
      [&action, file, cell_m] { action = [file, cell_m] { print_info(*file, *cell_m); }; });
}

}  // namespace ensonify::engine::app
