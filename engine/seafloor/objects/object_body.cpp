#include <ensonify/engine/seafloor/objects/object_body.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/objects/facets.h>
#include <ensonify/engine/seafloor/objects/laid_line.h>
#include <ensonify/engine/seafloor/objects/set_down.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {
namespace {

constexpr double max_table_faces = 4e6;  // of all objects of a table after refined()
constexpr int max_round = 512;           // facets around a body

/// The table with facets of round shapes as small as its material's lobe needs, within the limits.
ObjectOptions refined(ObjectOptions table, std::span<const Material> materials) {
  const std::optional<double> lobe_rad = lobe_width_rad(table.material, materials);
  if (!lobe_rad) return table;
  constexpr double finer = 0.87;  // a margin, since facets differ in size
  // A ball with n facets around it has n^2 / 1.5 faces, and up to four times this number, because
  // edges are only halved.
  const double affordable = std::sqrt(0.375 * max_table_faces / std::max(table.count, 1));
  table.size.facet_rad = std::max(finer * facet_over_lobe * *lobe_rad,
                                  2.0 * std::numbers::pi / std::min<double>(affordable, max_round));
  return table;
}

constexpr double far_m = 1e5;  // size of an object up to which floats resolve a centimetre

/// A warning for an object so large that one of its vertices may be misplaced. The warning names
/// the farthest vertex and the precision of positions.
std::optional<std::string> warning_of_extent(const refine::TriangleMesh& mesh,
                                             const ObjectOptions& table) {
  const refine::Bounds box = refine::bounds(mesh);
  const float extent = (box.highest - box.lowest).maxCoeff();  // in units of the mesh
  if (!(table.scale * extent > far_m)) return std::nullopt;
  std::vector<std::uint32_t> used;
  for (const refine::Face& face : mesh.faces) used.insert(used.end(), face.begin(), face.end());
  Eigen::Vector3f middle;  // the median, which a few distant vertices do not move
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto half = used.begin() + std::ssize(used) / 2;
    std::ranges::nth_element(used, half, {},
                             [&](std::uint32_t vertex) { return mesh.positions[vertex][axis]; });
    middle[axis] = mesh.positions[*half][axis];
  }
  const std::uint32_t farthest = *std::ranges::max_element(
      used, {}, [&](std::uint32_t vertex) { return (mesh.positions[vertex] - middle).norm(); });
  return fmt::format(
      "{}: is {:.3g} m long, where positions have a precision of {:.2g} m; vertex {} (from 0) is "
      "the farthest, {:.3g} m from the middle: if it is misplaced, move or remove it",
      table.mesh.path.filename().string(), table.scale * extent,
      table.scale * (std::nextafter(0.5f * extent, 1e30f) - 0.5f * extent), farthest,
      table.scale * (mesh.positions[farthest] - middle).norm());
}

/// A warning for an object that is wider than the bed.
std::optional<std::string> warning_of_size(const refine::TriangleMesh& mesh,
                                           const ObjectOptions& table, const BedGrid& bed) {
  const auto width_m = [](const refine::Bounds& box) {
    return double((box.highest - box.lowest).head<2>().maxCoeff());
  };
  const double own_m = table.scale * width_m(refine::bounds(mesh));
  const double bed_m = width_m(bed.bounds());
  if (!(own_m > bed_m)) return std::nullopt;
  return fmt::format(
      "{}: is {:.4g} m wide, and the seafloor {:.4g} m; is it in millimetres? Then set scale = 0.001",
      table.mesh.path.filename().string(), own_m, bed_m);
}

refine::RepairedMesh repaired(const refine::TriangleMesh& read, const ObjectOptions& table) {
  return refine::repair_file(read, table.weld_tolerance_m / table.scale, table.mesh.path);
}

/// The mesh of a table's file. If the table has a length, the mesh is scaled so that its longer
/// horizontal side has this length.
refine::TriangleMesh read_fitted(const ObjectOptions& table, const MemoryPlan& plan) {
  refine::TriangleMesh mesh =
      read_mesh_to_repair(table.mesh.path, plan, "use a coarser mesh of the object");
  if (!table.size.length_m) return mesh;
  Eigen::AlignedBox2f box;
  for (const refine::Face& face : mesh.faces)
    for (const std::uint32_t vertex : face) box.extend(mesh.positions[vertex].head<2>().eval());
  const double longer = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  if (!(longer > 0.0))
    throw refine::MeshError(fmt::format(
        "{}: has no length seen from above, so it cannot be scaled to length_m; give its scale",
        table.mesh.path.string()));
  for (Eigen::Vector3f& p : mesh.positions) p *= static_cast<float>(*table.size.length_m / longer);
  return mesh;
}

}  // namespace

refine::TriangleMesh mesh_of(const ObjectOptions& options, std::uint64_t seed,
                             std::span<const Material> materials, std::uint64_t number) {
  const ObjectOptions table = refined(options, materials);
  refine::TriangleMesh mesh;
  if (table.shape.empty())
    mesh = repaired(read_fitted(table, {}), table).mesh;
  else
    mesh =
        make_body(shape_named(table.shape), table.size,
                  table.shape_seed ? RandomStream(*table.shape_seed, Purpose::object_shape, {0, 0})
                                   : RandomStream(seed, Purpose::object_shape, {0, number}),
                  table.variant)
            .mesh;
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f middle = 0.5f * (box.lowest + box.highest);
  for (Eigen::Vector3f& p : mesh.positions) p = static_cast<float>(table.scale) * (p - middle);
  mesh.world_origin = Eigen::Vector3d::Zero();
  return mesh;
}

std::vector<ObjectPart> parts_of(const ObjectOptions& table) {
  std::vector<ObjectPart> parts{{table.class_name, table.material}};
  if (table.shape.empty()) return parts;
  for (const ShapePart& part : shape_named(table.shape).parts)
    parts.push_back(
        {table.part_classes ? fmt::format("{}.{}", table.class_name, part.name) : table.class_name,
         part.material.empty() ? table.material : std::string(part.material)});
  return parts;
}

void centre(ObjectBody& body) {
  const refine::Bounds box = refine::bounds(body.mesh);
  Eigen::Vector3f shift = 0.5f * (box.lowest + box.highest);
  shift.z() = box.lowest.z() + static_cast<float>(body.sunk_m);
  for (Eigen::Vector3f& p : body.mesh.positions) p -= shift;
}

void add_member(ObjectBody& base, ObjectBody member, const ObjectOptions& options) {
  centre(member);
  const Eigen::Matrix3d turn = options.scale * attitude(options, options.heading_rad);
  double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
  for (Eigen::Vector3f& p : member.mesh.positions) {
    p = (turn * p.cast<double>()).cast<float>();
    lowest_m = std::min(lowest_m, double(p.z()));
    highest_m = std::max(highest_m, double(p.z()));
  }
  const double sunk_m =
      options.burial.value_or(0.0) * (highest_m - lowest_m) + options.scale * member.sunk_m;
  const Eigen::Vector3f shift(
      static_cast<float>(options.east_m), static_cast<float>(options.north_m),
      static_cast<float>(options.height_m.value_or(0.0) - sunk_m - lowest_m));
  const auto parts = static_cast<std::uint16_t>(base.parts.size());
  for (Eigen::Vector3f& p : member.mesh.positions) p += shift;
  append(base.mesh, member.mesh);
  base.parts.insert(base.parts.end(), member.parts.begin(), member.parts.end());
  for (const std::uint16_t part : member.face_part)
    base.face_part.push_back(static_cast<std::uint16_t>(part + parts));
}

BodySource::BodySource(const ObjectOptions& table, std::size_t its_number, std::uint64_t seed,
                       const BedGrid& bed, std::span<const Material> materials,
                       const MemoryPlan& plan)
    : options(refined(table, materials)), number(its_number), seed_(seed) {
  what = table.shape.empty() ? table.mesh.path.string()
                             : fmt::format("objects.{} ({})", number, table.shape);
  if (!options.path_file.path.empty()) options.path = read_path(options.path_file.path);
  if (table.shape.empty()) {
    const refine::TriangleMesh read = read_fitted(table, plan);
    warning = warning_of_extent(read, table);
    if (!warning) warning = warning_of_size(read, table, bed);
    if (warning) what = *warning;
    refine::RepairedMesh sound = repaired(read, table);
    mesh_ = std::move(sound.mesh);
    open_ = !refine::encloses_volume(mesh_);
    report = sound.report;
  }
}

bool BodySource::is_line() const {
  return !options.shape.empty() && shape_named(options.shape).along_path;
}

ObjectBody BodySource::body(std::size_t copy) const {
  ObjectBody body{.mesh = {}, .parts = parts_of(options), .face_part = {}};
  if (options.shape.empty()) {
    body.mesh = mesh_;
    body.parts.front().two_sided = open_;
  } else if (!is_line()) {
    const RandomStream form =
        options.shape_seed ? RandomStream(*options.shape_seed, Purpose::object_shape, {0, copy})
                           : RandomStream(seed_, Purpose::object_shape, {number, copy});
    try {
      const ShapeKind& kind = shape_named(options.shape);
      ShapeBody made = make_body(kind, options.size, form, options.variant);
      body.mesh = std::move(made.mesh);
      const bool depth_given = options.burial || options.height_m;
      if (kind.several || !depth_given) body.sunk_m = made.sunk_m;
      // Part 0 is the whole object, and the parts of the shape follow.
      for (const std::uint8_t part : made.face_part)
        body.face_part.push_back(static_cast<std::uint16_t>(part + 1));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", what, error.what()));
    }
  }
  const bool one_of_several = body.parts.size() > 1;
  body.face_part.resize(body.mesh.faces.size(), one_of_several ? 1 : 0);
  return body;
}

}  // namespace ensonify::engine
