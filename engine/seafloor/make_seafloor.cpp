#include <ensonify/engine/seafloor/make_seafloor.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/bed/detail_in_windows.h>
#include <ensonify/engine/seafloor/bed/generated_tiles.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/engine/seafloor/bed/soundings.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/layers/bed_labels.h>
#include <ensonify/engine/seafloor/layers/seabed_in_windows.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/scour.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/refine/height_tiles.h>
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
void refuse_land(std::span<const double> z_m, double depth_m) {
  const double highest = *std::max_element(z_m.begin(), z_m.end());
  if (!(highest <= 0.0))
    throw std::invalid_argument(fmt::format(
        "seafloor: the bed rises {:.3g} m above the sea surface at a mean depth of {} m; make it "
        "deeper, the relief lower, or the extent smaller",
        highest, depth_m));
}

/// `under_water` is the share of the points.
void refuse_all_land(const SeafloorOptions& options, double lowest_m, double highest_m,
                     double under_water) {
  constexpr double least = 1e-3;  // fewer are wrong heights
  if (lowest_m < 0.0 && under_water > least) return;
  throw refine::MeshError(fmt::format(
      "{}: the whole survey lies above the sea surface{}: its heights are {:.2f} to {:.2f} m and "
      "the water level is {:.2f} m; set water_level_m, or change the sign of depths that count "
      "downwards",
      options.survey.path.string(),
      lowest_m < 0.0 ? fmt::format(", except {:.2g} % of its points", 100.0 * under_water) : "",
      lowest_m + options.water_level_m, highest_m + options.water_level_m, options.water_level_m));
}

SurveyFile survey_of(const SeafloorOptions& options) {
  return {options.survey.path, options.survey_cell_m};
}

SurveyScatter scatter_of(const SeafloorOptions& options, std::uint64_t seed) {
  return {options.uncertainty_scatter, seed};
}

Heightfield make_survey(const SeafloorOptions& options, std::uint64_t seed) {
  Heightfield field =
      read_survey(survey_of(options), options.water_level_m, scatter_of(options, seed));
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  double points = 0.0, under_water = 0.0;
  for (const double z : field.z_m)
    if (!std::isnan(z)) {
      points += 1.0;
      under_water += z < 0.0;
      lowest = std::min(lowest, z);
      highest = std::max(highest, z);
    }
  refuse_all_land(options, lowest, highest, under_water / points);
  if (options.detail.cell_m == 0.0) return field;
  return with_detail(field, options.detail, seed);
}

double points_of(const Heightfield& grid) { return static_cast<double>(grid.columns) * grid.rows; }

/// The grid of the bed without heights, from the options or from the header of the survey file.
Heightfield expected_grid(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::fractal) return fractal_grid(options);
  Heightfield grid = read_survey_header(survey_of(options));
  return options.detail.cell_m > 0.0 ? grid_with_detail(grid, options.detail) : grid;
}

/// Bytes allocated at the same time while the heights of a bed are made, 8 per point for the
/// heights included.
double heights_bytes(const SeafloorOptions& options, const Heightfield& grid) {
  const double points = points_of(grid);
  double bytes = 8.0 * points;
  const auto at_once = [&](double other) { bytes = std::max(bytes, 8.0 * points + other); };
  if (options.kind == SeafloorKind::fractal) {
    if (options.fractal.height_at_1m_m > 0.0)
      at_once(spectral_field_bytes(grid, fractal_field(grid, options.fractal)));
    if (options.ripples.rms_height_m > 0.0)
      at_once(spectral_field_bytes(grid, ripple_field(grid, options.ripples)));
  } else if (options.detail.cell_m > 0.0 && options.detail.height_at_1m_m != 0.0) {
    at_once(spectral_field_bytes(grid, SpectralField{}));
  }
  // 16: the bed before all layers, and where a layer lies; 28: the relief of a roughness layer and
  // its marks in addition.
  if (!options.seabed.empty()) at_once(16.0 * points);
  for (const auto& layer : options.seabed.roughness)
    at_once(28.0 * points + spectral_field_bytes(grid, fractal_field(grid, layer.relief)));
  return bytes;
}

/// Bytes that exist at the same time once the heights of a bed were made: the heights and their
/// grid, then the grid and its mesh, then the mesh and what is built over it.
double bed_bytes(const Heightfield& grid, double faces, double bytes_per_face, BedForm form) {
  const double heights = 8.0 * points_of(grid);
  const double in_grid = refine::HeightGrid::bytes_of(grid.columns, grid.rows);
  if (form == BedForm::grid) return heights + in_grid;
  const double mesh = refine::mesh_bytes_per_face * faces;
  return std::max(heights + in_grid, mesh + std::max(in_grid, bytes_per_face * faces));
}

std::string cure_of(const SeafloorOptions& options, BedForm form) {
  const std::string smaller =
      options.kind == SeafloorKind::fractal
          ? "make seafloor.cell_m larger or the extent smaller"
          : "make the survey coarser with gdalwarp -tr (or soundings with a larger "
            "seafloor.survey_cell_m), cut a part out with gdal_translate -projwin, or take a "
            "larger seafloor.detail.cell_m if there is one";
  return form == BedForm::grid
             ? smaller
             : "take run.surface = \"footprint\" in a run, which needs no mesh of the bed, or " +
                   smaller;
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
  plan.limit.require(heights_bytes(options, grid) + plan.more_bytes, description_of(grid, plan),
                     cure_of(options, BedForm::grid));
}

/// The same for all of a bed; of a survey only the heights count, since its holes make no faces.
void require_bed(const SeafloorOptions& options, const MemoryPlan& plan, BedForm form) {
  require_heights(options, plan);
  if (options.kind == SeafloorKind::survey) return;
  const Heightfield grid = expected_grid(options);
  const double faces = 2.0 * (grid.columns - 1.0) * (grid.rows - 1.0);
  plan.limit.require(bed_bytes(grid, faces, plan.bytes_per_face, form) + plan.more_bytes,
                     description_of(grid, plan), cure_of(options, form));
}

/// Throws MemoryError if what is made of these heights cannot fit.
void require_faces(const SeafloorOptions& options, const Heightfield& field, const MemoryPlan& plan,
                   BedForm form) {
  double faces = 0.0;
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column)
      faces += 2.0 * field.whole(column, row);
  plan.limit.require(
      bed_bytes(field, faces, plan.bytes_per_face, form) - 8.0 * points_of(field) + plan.more_bytes,
      description_of(field, plan), cure_of(options, form));
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
  if (fractal) refuse_land(ground.field.z_m, options.depth_m);
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
  for (const Eigen::Vector3f& p : read.positions)
    if (const double height_m = p.z() + read.world_origin.z();
        !(std::abs(height_m) <= most_height_m))
      throw refine::MeshError(fmt::format(
          "{}: has a height of {:.6g} m; is it in millimetres or feet? Scale it to metres",
          options.mesh.path.string(), height_m));
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
  return std::move(mesh);
}

double mean_height_m(refine::Triangles triangles) {
  double sum = 0.0;
  for (const refine::Face& face : triangles.faces)
    for (const std::uint32_t vertex : face) sum += triangles.positions[vertex].z();
  return sum / (3.0 * static_cast<double>(triangles.faces.size()));
}

void add_object(PlacedObjects::One& object, Seafloor& seafloor) {
  refine::TriangleMesh& whole = seafloor.mesh;
  const auto first = static_cast<std::uint32_t>(whole.positions.size());
  whole.positions.insert(whole.positions.end(), object.mesh.positions.begin(),
                         object.mesh.positions.end());
  for (const refine::Face& face : object.mesh.faces)
    whole.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
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
}

/// `scoured`, if given, are the heights of the grid, from which it is made again where objects have
/// scours.
void add_objects(std::span<const ObjectOptions> tables, std::uint64_t seed,
                 std::span<const Material> materials, Heightfield* scoured, Seafloor& seafloor) {
  if (tables.empty()) return;
  const auto require_labels = [&](std::size_t count, std::string_view what) {
    if (count + seafloor.labels.size() > max_labels)
      throw std::invalid_argument(
          fmt::format("{} {} are more than the {} labels that are left; use fewer objects", count,
                      what, max_labels - seafloor.labels.size()));
  };
  require_labels(count_of(tables), "objects");
  PlacedObjects placed = place_objects(tables, seed, BedGrid(seafloor), materials);
  if (const std::optional<std::size_t> first = first_scoured(tables)) {
    if (!scoured)
      throw std::invalid_argument(
          fmt::format("objects.{}: scour_ratio and tail_ratio need a bed of heights that is made "
                      "at once, not a mesh and not one in tiles; leave them out",
                      *first));
    add_scours(*scoured, placed, tables, seed);
    seafloor.grid = std::make_shared<const refine::HeightGrid>(height_grid(*scoured));
    seafloor.mean_bed_m = seafloor.grid->mean_height_m();
  }
  std::size_t parts = 0;
  for (const PlacedObjects::One& object : placed.objects) parts += object.parts.size();
  require_labels(parts, "parts of objects");
  for (const auto& [file, report] : placed.repairs) report_repairs(report, file, seafloor);
  seafloor.warnings.insert(seafloor.warnings.end(), placed.warnings.begin(), placed.warnings.end());
  std::size_t faces = seafloor.mesh.faces.size(), vertices = seafloor.mesh.positions.size();
  const std::size_t in_grid = seafloor.first_in_mesh();
  for (const PlacedObjects::One& object : placed.objects) {
    faces += object.mesh.faces.size();
    vertices += object.mesh.positions.size();
  }
  if (static_cast<double>(in_grid + faces) > max_faces)
    throw refine::MeshError(fmt::format(
        "with its {} objects the seafloor has more than 2^31 faces; use coarser meshes or a "
        "coarser bed",
        placed.objects.size()));
  seafloor.mesh.faces.reserve(faces);
  seafloor.mesh.positions.reserve(vertices);
  for (PlacedObjects::One& object : placed.objects) add_object(object, seafloor);
}

void add_objects_and_count(std::span<const ObjectOptions> objects, std::uint64_t seed,
                           std::span<const Material> materials, Heightfield* scoured,
                           Seafloor& seafloor) {
  const std::size_t bed_vertices = seafloor.vertices - seafloor.mesh.positions.size();
  add_objects(objects, seed, materials, scoured, seafloor);
  seafloor.vertices = bed_vertices + seafloor.mesh.positions.size();
  seafloor.faces = seafloor.first_in_mesh() + seafloor.mesh.faces.size();
}

constexpr double most_survey_points = 67108864.0;        // 2^26, that are read at once
constexpr double most_points_with_detail = 268435456.0;  // 2^28, that with_detail() makes

std::string not_at_once(const SeafloorOptions& options) {
  const Heightfield grid = expected_grid(options);
  return fmt::format(
      "seafloor: a bed of {} x {} points is too large to be made at once, which this needs (run, "
      "stream and live make it where pings need it); {}",
      grid.columns, grid.rows, cure_of(options, BedForm::grid));
}

/// The heights and kinds of a bed's tiles.
refine::HeightTiles::Heights heights_of_tiles(const SeafloorOptions& options,
                                              const Heightfield& grid, std::uint64_t seed) {
  const bool fractal = options.kind == SeafloorKind::fractal;
  refine::HeightTiles::Heights bed =
      fractal ? generated_tiles(grid, options.depth_m, options.fractal, options.ripples, seed)
              : survey_tiles(survey_of(options), options.water_level_m, scatter_of(options, seed));
  if (!fractal && options.detail.cell_m > 0.0)
    bed = with_detail_in_windows(read_survey_header(survey_of(options)), std::move(bed),
                                 sample_survey(survey_of(options), options.water_level_m).parts,
                                 options.detail, seed);
  if (options.seabed.empty()) return bed;
  bed = with_seabed(grid, std::move(bed), options.seabed, options.material, seed);
  if (!fractal) return bed;
  return [bed = std::move(bed), depth_m = options.depth_m](
             int first_column, int first_row, int columns, int rows, std::span<double> z_m,
             std::span<std::uint8_t> kinds) {
    bed(first_column, first_row, columns, rows, z_m, kinds);
    refuse_land(z_m, depth_m);
  };
}

/// Of layers whose features lie between the points of the grid.
void warn_of_coarse_cells(const Heightfield& grid, const SeabedOptions& seabed,
                          Seafloor& seafloor) {
  const double cell_m = std::max(grid.cell_east_m, grid.cell_north_m);
  for_each_relief_list(seabed, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    for (std::size_t i = 0; kind.size_m && i < list.size(); ++i)
      if (const double size_m = list[i].relief.*kind.size_m; cell_m > 0.5 * size_m)
        seafloor.warnings.push_back(fmt::format(
            "seafloor.{}.{}: cells of {} m hardly show its features of {} m; make the cells {} m or "
            "smaller",
            kind.list, i, cell_m, size_m, 0.25 * size_m));
  });
}

/// The labels of a bed whose tiles have the kinds of its points, which features have no numbers in.
void label_tiles(const SeabedOptions& seabed, std::span<const SeabedMap::Kind> kinds,
                 Seafloor& seafloor) {
  for (const SeabedMap::Kind& kind : kinds)
    seafloor.labels.push_back({.sediment = number_in(seafloor.materials, kind.material),
                               .class_id = number_in(seafloor.classes, kind.class_name)});
  seafloor.labels_in_grid = kinds.size() > 1;
  for_each_relief_list(seabed, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    const ReliefKind<Relief>& kind = kind_of(Relief{});
    for (std::size_t i = 0; kind.has_instances() && i < list.size(); ++i)
      if (!list[i].class_name.empty())
        seafloor.warnings.push_back(fmt::format(
            "seafloor.{}.{}: a bed that is made in tiles has no numbers of features; the truth has "
            "their class, but no instances of them",
            kind.list, i));
  });
}

/// The grid whose tiles are made later. Its mean height is that of the options, or of a sample.
void take_bed_in_tiles(const SeafloorOptions& options, std::uint64_t seed, const TileFile& tiles,
                       Seafloor& seafloor) {
  const bool fractal = options.kind == SeafloorKind::fractal;
  const Heightfield grid = expected_grid(options);
  require_windows(grid, options.seabed);
  const std::vector<SeabedMap::Kind> kinds = possible_kinds(options.seabed, options.material);
  const auto describe = [&](refine::HeightTiles::Shape& shape) {
    if (fractal) {
      shape.mean_height_m = -options.depth_m;
      shape.lowest_m = shape.highest_m = static_cast<float>(-options.depth_m);
      return;
    }
    const SurveySample sample = sample_survey(survey_of(options), options.water_level_m);
    refuse_all_land(options, sample.lowest_m, sample.highest_m, 1.0);
    shape.mean_height_m = sample.mean_m;
    shape.lowest_m = static_cast<float>(sample.lowest_m);
    shape.highest_m = static_cast<float>(sample.highest_m);
  };
  auto [x_m, y_m] = places(grid);
  Eigen::Vector3d world_origin = grid.world_origin;
  if (!fractal) world_origin.z() = options.water_level_m;
  seafloor.grid = std::make_shared<const refine::HeightGrid>(std::make_shared<refine::HeightTiles>(
      std::move(x_m), std::move(y_m), world_origin, describe, heights_of_tiles(options, grid, seed),
      tiles.file, tiles.key, kinds.size() > 1));
  seafloor.mesh.world_origin = world_origin;
  seafloor.utm_zone = grid.utm_zone;
  seafloor.vertices = seafloor.grid->vertices();
  seafloor.bed_faces = seafloor.grid->faces();
  seafloor.mean_bed_m = seafloor.grid->mean_height_m();
  label_tiles(options.seabed, kinds, seafloor);
  warn_of_coarse_cells(grid, options.seabed, seafloor);
}

/// A bed that was made at once, before its objects.
void take_bed(const Ground& ground, std::size_t objects, Seafloor& seafloor) {
  seafloor.grid = std::make_shared<const refine::HeightGrid>(height_grid(ground.field));
  seafloor.mesh.world_origin = ground.field.world_origin;
  seafloor.utm_zone = ground.field.utm_zone;
  seafloor.vertices = seafloor.grid->vertices();
  seafloor.bed_faces = seafloor.grid->faces();
  seafloor.mean_bed_m = seafloor.grid->mean_height_m();
  label_bed(ground.field, *seafloor.grid, ground.map, objects, seafloor);
}

}  // namespace

void check_header(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::survey) read_survey_header(survey_of(options));
}

bool needs_tiles(const SeafloorOptions& options) {
  if (is_mesh(options)) return false;
  if (options.kind == SeafloorKind::survey) {
    const Heightfield grid = expected_grid(options);
    const bool detail = options.detail.cell_m > 0.0;
    return points_of(grid) > (detail ? most_points_with_detail : most_survey_points) &&
           !(detail && grid.cell_east_m != grid.cell_north_m) &&
           obstacle_to_windows(grid, options.seabed).empty();
  }
  const Heightfield grid = fractal_grid(options);
  const auto fits = [&](const FractalRelief& relief) {
    return fits_one_transform(
        grid, relief.height_at_1m_m > 0.0 ? fractal_field(grid, relief) : SpectralField{});
  };
  return !fits(options.fractal) ||
         !std::ranges::all_of(options.seabed.roughness, fits, &ReliefLayer<FractalRelief>::relief);
}

void require_at_once(const SeafloorOptions& options) {
  if (needs_tiles(options)) throw std::invalid_argument(not_at_once(options));
}

Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed,
                             std::span<const ObjectOptions> objects,
                             std::span<const Material> materials, const MemoryPlan& plan) {
  require_at_once(options);
  if (!is_mesh(options)) require_heights(options, plan);
  Ground ground = make_ground(options, seed);
  if (first_scoured(objects)) {
    Seafloor seafloor;
    take_bed(ground, count_of(objects), seafloor);
    add_objects(objects, seed, materials, &ground.field, seafloor);
  }
  return std::move(ground.field);
}

Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed,
                       std::span<const ObjectOptions> objects, std::span<const Material> materials,
                       const MemoryPlan& plan, BedForm form) {
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
    seafloor.mesh = make_mesh(options, seafloor, plan);
    seafloor.vertices = seafloor.mesh.positions.size();
    seafloor.bed_faces = seafloor.mesh.faces.size();
    seafloor.mean_bed_m = mean_height_m(seafloor.mesh);
    seafloor.labels = {{.sediment = number_in(seafloor.materials, options.material),
                        .class_id = number_in(seafloor.classes, "seabed"),
                        .two_sided = true}};
  } else {
    require_at_once(options);
    require_bed(options, plan, form);
    ground = make_ground(options, seed);
    require_faces(options, ground.field, plan, form);
    take_bed(ground, count_of(objects), seafloor);
    warn_of_coarse_cells(ground.field, options.seabed, seafloor);
  }
  add_objects_and_count(objects, seed, materials,
                        options.kind == SeafloorKind::mesh ? nullptr : &ground.field, seafloor);
  if (form == BedForm::mesh) take_bed_to_mesh(seafloor);
  return seafloor;
}

Seafloor make_seafloor_in_tiles(const SeafloorOptions& options, std::uint64_t seed,
                                std::span<const ObjectOptions> objects,
                                std::span<const Material> materials, const TileFile& tiles) {
  Seafloor seafloor;
  take_bed_in_tiles(options, seed, tiles, seafloor);
  add_objects_and_count(objects, seed, materials, nullptr, seafloor);
  return seafloor;
}

void take_bed_to_mesh(Seafloor& seafloor) {
  if (!seafloor.grid) return;
  seafloor.mesh = seafloor.whole_mesh();
  seafloor.grid = nullptr;
}

}  // namespace ensonify::engine
