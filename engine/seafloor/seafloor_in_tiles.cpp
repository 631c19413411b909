#include <ensonify/engine/seafloor/seafloor_in_tiles.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/add_objects.h>
#include <ensonify/engine/seafloor/base.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/seafloor/layers/bed_labels.h>
#include <ensonify/engine/seafloor/layers/seabed_in_windows.h>
#include <ensonify/engine/seafloor/seafloor_memory.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {
namespace {

constexpr double max_survey_points = 67108864.0;        // 2^26, read at once
constexpr double max_points_with_detail = 268435456.0;  // 2^28, made by with_detail()

/// The heights and kinds of a bed's tiles.
refine::HeightTiles::Heights heights_of_tiles(const SeafloorOptions& options,
                                              const Heightfield& grid, std::uint64_t seed) {
  refine::HeightTiles::Heights bed = base_in_windows(options, seed);
  if (!options.seabed.empty())
    bed = with_seabed(grid, std::move(bed), options.seabed, options.material, seed);
  if (options.kind != SeafloorKind::fractal) return bed;
  return [bed = std::move(bed), depth_m = options.depth_m](
             int first_column, int first_row, int columns, int rows, std::span<double> z_m,
             std::span<std::uint8_t> kinds) {
    bed(first_column, first_row, columns, rows, z_m, kinds);
    refuse_land(z_m, depth_m);
  };
}

/// Adds one label per kind: a face's kind is the index of its label. Kinds have no instances, so a
/// warning names each layer whose features would be instances.
void label_tiles(const SeabedOptions& seabed, std::span<const SeabedMap::Kind> kinds,
                 Seafloor& seafloor) {
  for (const SeabedMap::Kind& kind : kinds)
    seafloor.labels.push_back(make_label(kind.material, kind.class_name, seafloor));
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

/// Gives the seafloor a grid whose tiles are made later. The mean height comes from the options, or
/// from a sample of the survey.
void take_bed_in_tiles(const SeafloorOptions& options, std::uint64_t seed, const TileFile& tiles,
                       Seafloor& seafloor) {
  const Heightfield grid = base_grid(options);
  require_windows(grid, options.seabed);
  const std::vector<SeabedMap::Kind> kinds = possible_kinds(options.seabed, options.material);
  const auto describe = [&](refine::HeightTiles::Shape& shape) {
    const SurveySample sample = sample_base(options);
    shape.mean_height_m = sample.mean_m;
    shape.lowest_m = static_cast<float>(sample.lowest_m);
    shape.highest_m = static_cast<float>(sample.highest_m);
  };
  auto [x_m, y_m] = places(grid);
  Eigen::Vector3d world_origin = grid.world_origin;
  if (options.kind == SeafloorKind::survey) world_origin.z() = options.water_level_m;
  take_grid(std::make_shared<const refine::HeightGrid>(std::make_shared<refine::HeightTiles>(
                std::move(x_m), std::move(y_m), world_origin, describe,
                heights_of_tiles(options, grid, seed), tiles.file, tiles.key, kinds.size() > 1)),
            grid, seafloor);
  seafloor.warnings = coarse_cell_warnings(grid, options.seabed);
  for (std::string& warning :
       unfound_area_warnings(grid, options.seabed, [&] { return base_in_windows(options, seed); }))
    seafloor.warnings.push_back(std::move(warning));
  for (std::string& warning : nowhere_on_warnings(options.seabed, options.material))
    seafloor.warnings.push_back(std::move(warning));
  label_tiles(options.seabed, kinds, seafloor);
}

}  // namespace

bool needs_tiles(const SeafloorOptions& options) {
  if (!options.is_grid()) return false;
  const Heightfield grid = base_grid(options);
  if (options.kind == SeafloorKind::survey) {
    const bool detail = options.detail.cell_m > 0.0;
    return grid.points() > (detail ? max_points_with_detail : max_survey_points) &&
           !(detail && grid.cell_east_m != grid.cell_north_m) &&
           !obstacle_to_windows(grid, options.seabed);
  }
  const auto fits = [&](const FractalRelief& relief) {
    return fits_one_transform(
        grid, relief.height_at_1m_m > 0.0 ? fractal_field(grid, relief) : SpectralField{});
  };
  return !fits(options.fractal) ||
         !std::ranges::all_of(options.seabed.roughness, fits, &ReliefLayer<FractalRelief>::relief);
}

void require_at_once(const SeafloorOptions& options) {
  if (!needs_tiles(options)) return;
  const Heightfield grid = base_grid(options);
  throw std::invalid_argument(fmt::format(
      "seafloor: a bed of {} x {} points is too large to be made at once, which this needs (run, "
      "stream, live, generate, preview and analyse make it in tiles); {}",
      grid.columns, grid.rows, smaller_bed_remedy(options, BedForm::grid)));
}

Seafloor make_seafloor_in_tiles(const SeafloorOptions& options, std::uint64_t seed,
                                std::span<const ObjectOptions> objects,
                                std::span<const Material> materials, const TileFile& tiles,
                                const MemoryPlan& plan, const std::function<void()>& stop_check) {
  Seafloor seafloor;
  take_bed_in_tiles(options, seed, tiles, seafloor);
  add_objects(objects, seed, materials, nullptr, seafloor, plan, {1, stop_check});
  return seafloor;
}

}  // namespace ensonify::engine
