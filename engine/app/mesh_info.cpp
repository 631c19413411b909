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

/// Lines with a name and a value each.
struct Lines {
  std::string text;

  void add(std::string_view name, const auto& value) {
    text += fmt::format("{} {}\n", name, value);
  }
  void add_bounds(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest) {
    for (int axis = 0; axis < 3; ++axis) {
      add(fmt::format("{}_min", "xyz"[axis]), lowest[axis]);
      add(fmt::format("{}_max", "xyz"[axis]), highest[axis]);
    }
  }
};

/// Prints the header and a summary of the table of a file with the tiles of a bed.
void print_tiles(const refine::HeightTiles& tiles) {
  const refine::HeightTiles::Shape& shape = tiles.shape();
  const Eigen::Vector3d& origin = shape.world_origin;
  const std::size_t cells = (shape.x_m.size() - 1) * (shape.y_m.size() - 1);
  refine::HeightGrid::Range all;
  for (const refine::HeightGrid::Range& range : tiles.ranges())
    if (range.known()) all.take(range);
  Lines lines;
  lines.add("columns", shape.x_m.size());
  lines.add("rows", shape.y_m.size());
  lines.add("triangles_without_holes", 2 * cells);
  lines.add("x_min", origin.x() + shape.x_m.front());
  lines.add("x_max", origin.x() + shape.x_m.back());
  lines.add("y_min", origin.y() + shape.y_m.front());
  lines.add("y_max", origin.y() + shape.y_m.back());
  lines.add("tiles", tiles.tiles());
  lines.add("tiles_made", tiles.tiles_made());
  if (!all.empty()) {
    lines.add("z_min_of_made", origin.z() + all.lowest);
    lines.add("z_max_of_made", origin.z() + all.highest);
  }
  lines.add("mean_height_m", origin.z() + shape.mean_height_m);
  lines.add("made_from", tiles.key());
  print(lines.text);
}

/// Prints the sizes of a progressive mesh, which `analyse` wrote.
void print_progressive(const refine::ProgressiveMesh& mesh) {
  Lines lines;
  mesh.verify_all();
  lines.add("vertices", mesh.leaves());
  lines.add("triangles", std::ranges::count_if(mesh.source_face, [](std::uint32_t face) {
              return face != refine::ProgressiveMesh::none;
            }));
  lines.add_bounds(mesh.world_origin + mesh.bounds.lowest.cast<double>(),
                   mesh.world_origin + mesh.bounds.highest.cast<double>());
  lines.add("base_vertices", mesh.roots.size());
  lines.add("base_triangles", mesh.base_faces().size());
  lines.add("made_from", mesh.key());
  print(lines.text);
}

void print_info(const std::filesystem::path& file, double cell_m) {
  if (refine::HeightTiles::is_one(file)) return print_tiles(refine::HeightTiles(file));
  if (refine::is_progressive_mesh(file))
    return print_progressive(refine::map_progressive_mesh(file));
  const MeshFile input(file, cell_m);
  const refine::MeshSummary summary = refine::summarise(input.mesh);
  Lines lines;
  lines.add("vertices", summary.vertices);
  lines.add("triangles", summary.faces);
  lines.add_bounds(summary.lowest, summary.highest);
  lines.add("boundary_edges", summary.boundary_edges);
  lines.add("non_manifold_edges", summary.non_manifold_edges);
  const refine::RepairReport repairs = refine::repair(input.mesh).report;
  lines.add("repairs", repairs.total());
  for (const auto& [name, count] : repairs.entries())
    lines.add(fmt::format("repair_{}", name), count);
  if (input.grid) {
    const Heightfield& grid = *input.grid;
    lines.add("columns", grid.columns);
    lines.add("rows", grid.rows);
    lines.add("cell_east_m", grid.cell_east_m);
    lines.add("cell_north_m", grid.cell_north_m);
    lines.add("holes", std::ranges::count_if(grid.z_m, [](double z) { return std::isnan(z); }));
  }
  print(lines.text);
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
