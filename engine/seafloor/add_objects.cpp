#include <ensonify/engine/seafloor/add_objects.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/layers/bed_labels.h>
#include <ensonify/engine/seafloor/objects/laid_line.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/scour.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {
namespace {

void add_object(PlacedObjects::One& object, Seafloor& seafloor) {
  append(seafloor.mesh, object.mesh);
  const std::size_t label = seafloor.labels.size();
  for (const ObjectPart& part : object.parts)
    seafloor.labels.push_back({.sediment = number_in(seafloor.materials, part.material),
                               .class_id = number_in(seafloor.classes, part.class_name),
                               .instance = static_cast<std::uint16_t>(seafloor.objects.size() + 1),
                               .two_sided = part.two_sided});
  object.record.label = seafloor.labels[label];
  seafloor.objects.push_back(object.record);
  if (seafloor.face_label.empty())
    seafloor.first_labelled = static_cast<std::uint32_t>(seafloor.bed_faces);
  for (std::size_t f = 0; f < object.mesh.faces.size(); ++f)
    seafloor.face_label.push_back(
        static_cast<std::uint16_t>(label + (object.face_part.empty() ? 0 : object.face_part[f])));
  object.mesh = {};
  seafloor.object_meshes.push_back(std::move(object.own));
}

ObjectWay way_of(const ObjectOptions& object, const Eigen::Vector3d& start_m) {
  if (!object.poses.empty()) return read_way(object.poses.path, start_m);
  return way_along(start_m,
                   object.path_file.path.empty() ? object.path : read_path(object.path_file.path),
                   *object.speed_mps);
}

}  // namespace

void add_moving_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                        std::span<const Material> materials, const BedGrid& bed, Seafloor& seafloor,
                        const MemoryPlan& plan, const WorkControl& control) {
  if (std::ranges::none_of(tables, &ObjectOptions::moves)) return;
  PlacedObjects placed = place_objects(tables, seed, bed, materials, plan, control, true);
  for (const auto& [file, report] : placed.repairs) seafloor.add_repairs(report, file);
  seafloor.warnings.insert(seafloor.warnings.end(), placed.warnings.begin(), placed.warnings.end());
  for (PlacedObjects::One& object : placed.objects) {
    const ObjectPart& part = object.parts.front();
    object.record.label = {.sediment = number_in(seafloor.materials, part.material),
                           .class_id = number_in(seafloor.classes, part.class_name)};
    object.own.place = object.own.place - object.record.middle_m;  // about its middle
    MovingRecord& moving = seafloor.moving.emplace_back();
    moving.mesh = object.own.in_floats();
    moving.record = object.record;
    try {
      moving.way = way_of(tables[object.record.table], object.record.middle_m);
    } catch (const std::invalid_argument& error) {
      throw SceneError(fmt::format("objects.{}.path", object.record.table), error.what());
    }
  }
}

void add_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                 std::span<const Material> materials, Heightfield* heights, Seafloor& seafloor,
                 const MemoryPlan& plan, const WorkControl& control) {
  if (count_of(tables) == 0) return;
  const auto require_labels = [&](std::size_t count, std::string_view what) {
    if (count + seafloor.labels.size() > max_labels)
      throw std::invalid_argument(
          fmt::format("{} {} are more than the {} labels that are left; use fewer objects", count,
                      what, max_labels - seafloor.labels.size()));
  };
  require_labels(count_of(tables), "objects");
  PlacedObjects placed =
      place_objects(tables, seed, BedGrid(seafloor, control.stop_check), materials, plan, control);
  if (const std::optional<std::size_t> first = first_scoured(tables)) {
    if (!heights)
      throw SceneError(
          fmt::format("objects.{}", *first),
          fmt::format("objects.{}: scour_ratio and tail_ratio need a bed of heights that is made "
                      "at once, not a mesh and not one in tiles; leave them out",
                      *first));
    add_scours(*heights, placed, tables, seed, control);
    seafloor.grid =
        std::make_shared<const refine::HeightGrid>(height_grid(*heights, control.stop_check));
    seafloor.mean_bed_m = seafloor.grid->mean_height_m();
  }
  std::size_t parts = 0, faces = 0, vertices = 0;
  for (const PlacedObjects::One& object : placed.objects) {
    parts += object.parts.size();
    faces += object.mesh.faces.size();
    vertices += object.mesh.positions.size();
  }
  require_labels(parts, "parts of objects");
  for (const auto& [file, report] : placed.repairs) seafloor.add_repairs(report, file);
  seafloor.warnings.insert(seafloor.warnings.end(), placed.warnings.begin(), placed.warnings.end());
  seafloor.faces += faces;
  seafloor.vertices += vertices;
  if (static_cast<double>(seafloor.faces) > max_seafloor_faces)
    throw refine::MeshError(fmt::format(
        "with its {} objects the seafloor has more than 2^31 faces; use coarser meshes or a "
        "coarser bed",
        placed.objects.size()));
  seafloor.mesh.faces.reserve(seafloor.mesh.faces.size() + faces);
  seafloor.mesh.positions.reserve(seafloor.mesh.positions.size() + vertices);
  for (PlacedObjects::One& object : placed.objects) add_object(object, seafloor);
}

}  // namespace ensonify::engine
