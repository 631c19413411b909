#include <ensonify/engine/seafloor/seafloor.h>

#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {

// Counts faces, not areas: a bed of several materials is a grid of faces of about equal areas.
std::vector<double> Seafloor::material_shares() const {
  constexpr std::size_t most = 16384;
  std::vector<std::uint16_t> sample;
  if (!one_label() && !labels_in_grid) {
    std::vector<double> places(bed_faces > most ? most : 0);
    RandomStream(0, Purpose::bed_sample).uniform(places);
    for (const double place : places)
      sample.push_back(label_of(
          static_cast<std::uint32_t>(std::ceil(place * static_cast<double>(bed_faces))) - 1));
    for (std::uint32_t face = 0; places.empty() && face < bed_faces; ++face)
      sample.push_back(label_of(face));
  }
  if (sample.empty()) sample.push_back(0);
  std::vector<double> shares(materials.size(), 0.0);
  for (const std::uint16_t label : sample)
    shares[labels[label].sediment] += 1.0 / static_cast<double>(sample.size());
  return shares;
}

bool Seafloor::in_tiles() const { return grid && grid->tiles_in_file() != nullptr; }

refine::Bounds Seafloor::bounds() const {
  if (progressive) return progressive->bounds;
  if (!grid) return refine::bounds(mesh);
  refine::Bounds box = grid->bounds();
  if (mesh.faces.empty()) return box;
  const refine::Bounds of_objects = refine::bounds(mesh);
  box.lowest = box.lowest.cwiseMin(of_objects.lowest);
  box.highest = box.highest.cwiseMax(of_objects.highest);
  return box;
}

void Seafloor::add_repairs(const refine::RepairReport& report, const std::filesystem::path& file) {
  if (report.total() == 0) return;
  repairs += report.total();
  std::string what;
  for (const auto& [name, count] : report.entries())
    if (count > 0) what += fmt::format("{}{} {}", what.empty() ? "" : ", ", name, count);
  warnings.push_back(fmt::format("{}: repaired: {}", file.filename().string(), what));
}

refine::TriangleMesh Seafloor::whole_mesh(const std::function<void()>& stop_check) const {
  return grid ? with_objects(grid->mesh(stop_check)) : mesh;
}

refine::TriangleMesh Seafloor::with_objects(refine::TriangleMesh bed) const {
  bed.positions.reserve(bed.positions.size() + mesh.positions.size());
  bed.faces.reserve(bed.faces.size() + mesh.faces.size());
  append(bed, mesh);
  return bed;
}

std::uint16_t Seafloor::kind_of(std::uint32_t face) const { return grid->kind_of(face); }

std::uint16_t Seafloor::tag_of(std::uint32_t face) const {
  if (progressive->tag_count() == 0) return 0;
  const std::uint16_t tag = progressive->tag(face);
  if (tag < labels.size()) return tag;
  throw refine::MeshError(fmt::format(
      "the progressive mesh gives face {} the label {}, but has only {} labels; analyse it again",
      face, tag, labels.size()));
}

}  // namespace ensonify::engine
