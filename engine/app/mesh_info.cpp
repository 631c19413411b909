#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include <ensonify/refine/mesh_repair.h>

#include "app.h"
#include "mesh_file.h"

namespace ensonify::engine::app {
namespace {

void print_info(const std::filesystem::path& file) {
  const MeshFile input(file);
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
  CLI::App& command =
      *app.add_subcommand("mesh-info",
                          "Describe a mesh (PLY, OBJ, STL, OFF) or a survey grid: one `name value` "
                          "per line, in metres. Counts are of the file itself; repairs are the "
                          "changes that a run would make");
  command.add_option("FILE", *file, "The mesh or grid")->required();
  command.callback([&action, file] { action = [file] { print_info(*file); }; });
}

}  // namespace ensonify::engine::app
