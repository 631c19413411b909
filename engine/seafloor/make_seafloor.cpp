#include <ensonify/engine/seafloor/make_seafloor.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/add_objects.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/base.h>
#include <ensonify/engine/seafloor/bed/soundings.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/layers/bed_labels.h>
#include <ensonify/engine/seafloor/objects/scour.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {
namespace {

struct Ground {
  Heightfield field;
  SeabedMap map;
};

Ground make_ground(const SeafloorOptions& options, std::uint64_t seed, const WorkControl& control) {
  if (!options.is_grid())
    throw std::invalid_argument("seafloor: a mesh has no grid of heights; write it to a .ply file");
  Ground ground;
  ground.field = make_base(options, seed, control);
  ground.map = lay_seabed(ground.field, options.seabed, options.material, seed, nullptr, control);
  if (options.kind == SeafloorKind::fractal) refuse_land(ground.field.z_m, options.depth_m);
  return ground;
}

refine::TriangleMesh make_mesh(const SeafloorOptions& options, Seafloor& seafloor,
                               const MemoryPlan& plan, const WorkControl& control) {
  const std::string remedy = "use a coarser mesh, or a part of it";
  const refine::TriangleMesh read =
      read_mesh_to_repair(options.mesh.path, plan, remedy, control.stop_check);
  for (const Eigen::Vector3f& p : read.positions)
    if (const double height_m = p.z() + read.world_origin.z();
        !(std::abs(height_m) <= max_height_m))
      throw refine::MeshError(fmt::format(
          "{}: has a height of {:.6g} m; is it in millimetres or feet? Scale it to metres",
          options.mesh.path.string(), height_m));
  const auto faces = static_cast<double>(read.faces.size());
  plan.limit.require(
      plan.bytes_per_face * faces + plan.more_bytes,
      fmt::format("what is built over the {:.0f} faces of {}", faces, options.mesh.path.string()),
      remedy);
  refine::RepairedMesh repaired =
      refine::repair_file(read, options.weld_tolerance_m, options.mesh.path);
  seafloor.add_repairs(repaired.report, options.mesh.path);
  refine::TriangleMesh& mesh = repaired.mesh;
  const auto rise_m = static_cast<float>(mesh.world_origin.z() - options.water_level_m);
  for (Eigen::Vector3f& p : mesh.positions) p.z() += rise_m;
  mesh.world_origin.z() = options.water_level_m;
  return std::move(mesh);
}

double mean_height_m(refine::Triangles triangles) {
  double sum = 0.0;
  for (const refine::Face& face : triangles.faces)
    for (const std::uint32_t vertex : face) sum += triangles.positions[vertex].z();
  return sum / (3.0 * static_cast<double>(triangles.faces.size()));
}

/// Gives the seafloor a bed that was made at once, with its labels and without objects.
void take_bed(const Ground& ground, std::size_t objects, const WorkControl& control,
              Seafloor& seafloor) {
  take_grid(
      std::make_shared<const refine::HeightGrid>(height_grid(ground.field, control.stop_check)),
      ground.field, seafloor);
  label_bed(ground.field, *seafloor.grid, ground.map, objects, seafloor);
}

}  // namespace

Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             std::span<const ObjectOptions> objects,
                             std::span<const Material> materials, const MemoryPlan& plan,
                             const WorkControl& control) {
  require_at_once(options);
  if (options.is_grid()) require_heights_fit(options, plan);
  Ground ground = make_ground(options, seed, control);
  if (first_scoured(objects)) {
    Seafloor seafloor;
    take_bed(ground, count_of(objects), control, seafloor);
    add_objects(objects, seed, materials, &ground.field, seafloor, plan, control);
  }
  return std::move(ground.field);
}

Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects, std::span<const Material> materials,
                       const MemoryPlan& plan, BedForm form, const WorkControl& control) {
  if (options.kind == SeafloorKind::progressive) {
    if (!objects.empty())
      throw std::invalid_argument(
          "seafloor: no objects can be added to a progressive mesh; add them to the scene that is "
          "analysed");
    return open_analysed(options.progressive.path);
  }
  Seafloor seafloor;
  Ground ground;
  if (options.kind == SeafloorKind::mesh) {
    seafloor.mesh = make_mesh(options, seafloor, plan, control);
    seafloor.vertices = seafloor.mesh.positions.size();
    seafloor.faces = seafloor.bed_faces = seafloor.mesh.faces.size();
    seafloor.mean_bed_m = mean_height_m(seafloor.mesh);
    seafloor.labels = {make_label(options.material, "seabed", seafloor)};
    seafloor.labels.front().two_sided = true;
  } else {
    require_at_once(options);
    require_bed_fits(options, plan, form);
    ground = make_ground(options, seed, control);
    require_faces_fit(options, ground.field, plan, form);
    seafloor.warnings = coarse_cell_warnings(ground.field, options.seabed);
    seafloor.warnings.insert(seafloor.warnings.end(), ground.map.warnings.begin(),
                             ground.map.warnings.end());
    take_bed(ground, count_of(objects), control, seafloor);
  }
  add_objects(objects, seed, materials, seafloor.grid ? &ground.field : nullptr, seafloor, plan,
              control);
  if (form == BedForm::mesh) take_bed_to_mesh(seafloor, control.stop_check);
  return seafloor;
}

void take_bed_to_mesh(Seafloor& seafloor, const std::function<void()>& stop_check) {
  if (!seafloor.grid) return;
  seafloor.mesh = seafloor.whole_mesh(stop_check);
  seafloor.grid = nullptr;
}

}  // namespace ensonify::engine
