#include <ensonify/engine/seafloor/make_seafloor.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/bed/spectral.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/layers/bed_labels.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {
namespace {

constexpr double max_faces = 2147483648.0;  // 2^31

void report_repairs(const refine::RepairReport& report, const std::filesystem::path& file,
                    Seafloor& seafloor) {
  if (report.total() == 0) return;
  seafloor.repairs += report.total();
  std::string what;
  for (const auto& [name, count] : report.entries())
    if (count > 0) what += fmt::format("{}{} {}", what.empty() ? "" : ", ", name, count);
  seafloor.warnings.push_back(fmt::format("{}: repaired: {}", file.filename().string(), what));
}

/// The grid of a generated bed, without heights.
Heightfield fractal_grid(const SeafloorOptions& options) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0.0 && std::isfinite(value)))
      throw std::invalid_argument(
          fmt::format("seafloor: the {} is {} m; it must be positive", name, value));
  };
  positive(options.extent_east_m, "extent to the east");
  positive(options.extent_north_m, "extent to the north");
  positive(options.cell_m, "cell");
  positive(options.depth_m, "depth");
  const double cells_east = std::round(options.extent_east_m / options.cell_m);
  const double cells_north = std::round(options.extent_north_m / options.cell_m);
  if (!(cells_east >= 1.0 && cells_north >= 1.0))
    throw std::invalid_argument(
        fmt::format("seafloor: an extent of {} x {} m holds no cell of {} m; make it larger or the "
                    "cell smaller",
                    options.extent_east_m, options.extent_north_m, options.cell_m));
  if (!(2.0 * cells_east * cells_north <= max_faces))
    throw std::invalid_argument(fmt::format(
        "seafloor: {:.0f} x {:.0f} cells are more than 2^31 faces; make the extent smaller or the "
        "cell larger than {} m",
        cells_east, cells_north, options.cell_m));

  Heightfield field;
  field.columns = static_cast<int>(cells_east) + 1;
  field.rows = static_cast<int>(cells_north) + 1;
  field.cell_east_m = field.cell_north_m = options.cell_m;
  return field;
}

Heightfield make_fractal(const SeafloorOptions& options, std::uint64_t seed) {
  Heightfield field = fractal_grid(options);
  field.z_m.assign(static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows),
                   -options.depth_m);
  add_fractal(field, options.fractal, seed);
  add_ripples(field, options.ripples, seed);
  return field;
}

/// Throws if a generated bed rises above the sea surface.
void refuse_land(const Heightfield& field, double depth_m) {
  const double highest = *std::max_element(field.z_m.begin(), field.z_m.end());
  if (!(highest <= 0.0))
    throw std::invalid_argument(fmt::format(
        "seafloor: the bed rises {:.3g} m above the sea surface at a mean depth of {} m; make it "
        "deeper, the relief lower, or the extent smaller",
        highest, depth_m));
}

Heightfield make_survey(const SeafloorOptions& options, std::uint64_t seed) {
  Heightfield field = read_survey(options.survey.path, options.water_level_m);
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const double z : field.z_m)
    if (!std::isnan(z)) {
      lowest = std::min(lowest, z);
      highest = std::max(highest, z);
    }
  if (lowest >= 0.0)
    throw refine::MeshError(fmt::format(
        "{}: the whole survey lies above the sea surface: its heights are {:.2f} to {:.2f} m and "
        "the water level is {:.2f} m; set water_level_m, or change the sign of depths that count "
        "downwards",
        options.survey.path.string(), lowest + options.water_level_m,
        highest + options.water_level_m, options.water_level_m));
  if (options.detail.cell_m == 0.0) return field;
  return with_detail(field, options.detail, seed);
}

double points_of(const Heightfield& grid) { return static_cast<double>(grid.columns) * grid.rows; }

/// The grid of the bed without heights, from the options or from the header of the survey file.
Heightfield expected_grid(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::fractal) return fractal_grid(options);
  Heightfield grid = read_survey_header(options.survey.path);
  if (!(options.detail.cell_m > 0.0)) return grid;
  const auto divide = [&](int& count, double& cell_m) {
    const double parts = std::max(1.0, std::round(cell_m / options.detail.cell_m));
    const double points = (count - 1) * parts + 1.0;
    if (!(points <= std::numeric_limits<int>::max())) return;  // with_detail() refuses it
    count = static_cast<int>(points);
    cell_m /= parts;
  };
  divide(grid.columns, grid.cell_east_m);
  divide(grid.rows, grid.cell_north_m);
  return grid;
}

/// Bytes allocated at the same time while the heights of a bed are made, 8 per point for the
/// heights included.
double heights_bytes(const SeafloorOptions& options, const Heightfield& grid) {
  const double points = points_of(grid);
  double bytes = 8.0 * points;
  const auto at_once = [&](double other) { bytes = std::max(bytes, 8.0 * points + other); };
  if (options.kind == SeafloorKind::fractal) {
    if (options.fractal.height_at_1m_m > 0.0)
      at_once(spectral_field_bytes(grid, fractal_period_m(grid, options.fractal.hurst)));
    if (options.ripples.rms_height_m > 0.0) at_once(spectral_field_bytes(grid, 0.0));
  } else if (options.detail.cell_m > 0.0 && options.detail.height_at_1m_m != 0.0) {
    at_once(spectral_field_bytes(grid, 0.0));
  }
  // 16: the bed before all layers, and where a layer lies; 28: the relief of a roughness layer and
  // its marks in addition.
  if (!options.seabed.empty()) at_once(16.0 * points);
  for (const auto& layer : options.seabed.roughness)
    at_once(28.0 * points + spectral_field_bytes(grid, fractal_period_m(grid, layer.relief.hurst)));
  return bytes;
}

/// Bytes needed in addition to the heights of a bed: for the mesh while the heights still exist,
/// then for what is built over the mesh after the heights are freed.
double mesh_bytes(double points, double faces, double bytes_per_face) {
  const double mesh = (0.5 * sizeof(Eigen::Vector3f) + sizeof(refine::Face)) * faces;
  return mesh + std::max(sizeof(std::uint32_t) * points, bytes_per_face * faces - 8.0 * points);
}

std::string cure_of(const SeafloorOptions& options) {
  return options.kind == SeafloorKind::fractal
             ? "make seafloor.cell_m larger or the extent smaller"
             : "make the survey coarser with gdalwarp -tr, cut a part out with gdal_translate "
               "-projwin, or take a larger seafloor.detail.cell_m if there is one";
}

std::string description_of(const Heightfield& grid, const MemoryPlan& plan) {
  return fmt::format(
      "a seafloor of {} x {} points and what is built over it{}", grid.columns, grid.rows,
      plan.more_bytes > 0.0 ? fmt::format(" ({:.3g} GB of it images)", 1e-9 * plan.more_bytes)
                            : "");
}

/// Throws MemoryError before anything is made, if the options and the header show that it cannot
/// fit.
void require_heights(const SeafloorOptions& options, const MemoryPlan& plan) {
  const Heightfield grid = expected_grid(options);
  const double points = points_of(grid);
  double bytes = heights_bytes(options, grid);
  if (options.kind == SeafloorKind::fractal) {  // without holes
    const double faces = 2.0 * (grid.columns - 1.0) * (grid.rows - 1.0);
    bytes = std::max(bytes, 8.0 * points + mesh_bytes(points, faces, plan.bytes_per_face));
  }
  plan.limit.require(bytes + plan.more_bytes, description_of(grid, plan), cure_of(options));
}

/// Throws MemoryError if the mesh over these heights cannot fit.
void require_mesh(const SeafloorOptions& options, const Heightfield& field,
                  const MemoryPlan& plan) {
  double faces = 0.0;
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column)
      faces += 2.0 * field.whole(column, row);
  plan.limit.require(mesh_bytes(points_of(field), faces, plan.bytes_per_face) + plan.more_bytes,
                     description_of(field, plan), cure_of(options));
}

/// The heights of a bed, and the map of its sediments.
struct Ground {
  Heightfield field;
  SeabedMap map;
};

bool is_mesh(const SeafloorOptions& options) {
  return options.kind == SeafloorKind::mesh || options.kind == SeafloorKind::progressive;
}

Ground make_ground(const SeafloorOptions& options, std::uint64_t seed) {
  if (is_mesh(options))
    throw std::invalid_argument("seafloor: a mesh has no grid of heights; write it to a .ply file");
  const bool fractal = options.kind == SeafloorKind::fractal;
  Ground ground;
  ground.field = fractal ? make_fractal(options, seed) : make_survey(options, seed);
  ground.map = lay_seabed(ground.field, options.seabed, options.material, seed);
  if (fractal) refuse_land(ground.field, options.depth_m);
  return ground;
}

constexpr double repair_bytes_per_face = 75.0;  // in addition to the mesh that was read

refine::TriangleMesh make_mesh(const SeafloorOptions& options, Seafloor& seafloor,
                               const MemoryPlan& plan) {
  const std::string cure = "use a coarser mesh, or a part of it";
  std::error_code unreadable;  // read_mesh() reports it
  if (const auto bytes = std::filesystem::file_size(options.mesh.path, unreadable); !unreadable)
    plan.limit.require(static_cast<double>(bytes) + plan.more_bytes,
                       options.mesh.path.string() + " and what is read of it", cure);
  const refine::TriangleMesh read = refine::read_mesh(options.mesh.path);
  const auto faces = static_cast<double>(read.faces.size());
  plan.limit.require(std::max(repair_bytes_per_face, plan.bytes_per_face) * faces + plan.more_bytes,
                     fmt::format("the repair of the {:.0f} faces of {} and what is built over them",
                                 faces, options.mesh.path.string()),
                     cure);
  refine::RepairedMesh repaired = refine::repair(read, options.weld_tolerance_m);
  report_repairs(repaired.report, options.mesh.path, seafloor);
  refine::TriangleMesh& mesh = repaired.mesh;
  const auto rise_m = static_cast<float>(mesh.world_origin.z() - options.water_level_m);
  for (Eigen::Vector3f& p : mesh.positions) p.z() += rise_m;
  mesh.world_origin.z() = options.water_level_m;
  if (refine::bounds(mesh).lowest.z() >= 0.0f)
    throw refine::MeshError(fmt::format(
        "{}: the whole mesh lies above the sea surface at the water level of {:.2f} m; set "
        "water_level_m, or change the sign of depths that count downwards",
        options.mesh.path.string(), options.water_level_m));
  return std::move(mesh);
}

double mean_height_m(refine::Triangles triangles) {
  double sum = 0.0;
  for (const refine::Face& face : triangles.faces)
    for (const std::uint32_t vertex : face) sum += triangles.positions[vertex].z();
  return sum / (3.0 * static_cast<double>(triangles.faces.size()));
}

void add_object(PlacedObjects::One& object, const ObjectOptions& options, Seafloor& seafloor) {
  refine::TriangleMesh& whole = seafloor.mesh;
  const auto first = static_cast<std::uint32_t>(whole.positions.size());
  whole.positions.insert(whole.positions.end(), object.mesh.positions.begin(),
                         object.mesh.positions.end());
  for (const refine::Face& face : object.mesh.faces)
    whole.faces.push_back({face[0] + first, face[1] + first, face[2] + first});

  const auto label = static_cast<std::uint16_t>(seafloor.labels.size());
  seafloor.labels.push_back({.sediment = number_in(seafloor.materials, options.material),
                             .class_id = number_in(seafloor.classes, options.class_name),
                             .instance = static_cast<std::uint16_t>(seafloor.objects.size() + 1),
                             .two_sided = options.shape.empty()});  // a shape's outside is known
  object.record.label = seafloor.labels.back();
  seafloor.objects.push_back(object.record);
  if (seafloor.face_label.empty()) seafloor.face_label.assign(seafloor.bed_faces, 0);
  seafloor.face_label.resize(whole.faces.size(), label);
  object.mesh = {};
}

void add_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                 std::span<const Material> materials, Seafloor& seafloor) {
  if (tables.empty()) return;
  if (const std::size_t count = count_of(tables); count + seafloor.labels.size() > max_labels)
    throw std::invalid_argument(
        fmt::format("{} objects are more than the {} labels that are left; use fewer objects",
                    count, max_labels - seafloor.labels.size()));
  PlacedObjects placed = place_objects(tables, seed, BedGrid(seafloor), materials);
  for (const auto& [file, report] : placed.repairs) report_repairs(report, file, seafloor);
  seafloor.warnings.insert(seafloor.warnings.end(), placed.warnings.begin(), placed.warnings.end());
  std::size_t faces = seafloor.mesh.faces.size(), vertices = seafloor.mesh.positions.size();
  for (const PlacedObjects::One& object : placed.objects) {
    faces += object.mesh.faces.size();
    vertices += object.mesh.positions.size();
  }
  if (static_cast<double>(faces) > max_faces)
    throw refine::MeshError(fmt::format(
        "with its {} objects the seafloor has more than 2^31 faces; use coarser meshes or a "
        "coarser bed",
        placed.objects.size()));
  seafloor.mesh.faces.reserve(faces);
  seafloor.mesh.positions.reserve(vertices);
  for (PlacedObjects::One& object : placed.objects)
    add_object(object, tables[object.record.table], seafloor);
}

}  // namespace

void check_header(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::survey) read_survey_header(options.survey.path);
}

Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             const MemoryPlan& plan) {
  if (!is_mesh(options)) require_heights(options, plan);
  return make_ground(options, seed).field;
}

Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects, std::span<const Material> materials,
                       const MemoryPlan& plan) {
  if (options.kind == SeafloorKind::progressive) {
    if (!objects.empty())
      throw std::invalid_argument(
          "seafloor: no objects can be added to a progressive mesh; add them to the scene that is "
          "analysed");
    return open_analysed(options.progressive.path);
  }
  Seafloor seafloor;
  if (options.kind == SeafloorKind::mesh) {
    seafloor.mesh = make_mesh(options, seafloor, plan);
    seafloor.labels = {{.sediment = number_in(seafloor.materials, options.material),
                        .class_id = number_in(seafloor.classes, "seabed"),
                        .two_sided = true}};
  } else {
    require_heights(options, plan);
    const Ground ground = make_ground(options, seed);
    require_mesh(options, ground.field, plan);
    seafloor.mesh = tessellate(ground.field);
    seafloor.utm_zone = ground.field.utm_zone;
    label_bed(ground.field, ground.map, count_of(objects), seafloor);
  }
  seafloor.bed_faces = seafloor.mesh.faces.size();
  seafloor.mean_bed_m = mean_height_m(seafloor.mesh);
  add_objects(objects, seed, materials, seafloor);
  seafloor.vertices = seafloor.mesh.positions.size();
  seafloor.faces = seafloor.mesh.faces.size();
  return seafloor;
}

}  // namespace ensonify::engine
