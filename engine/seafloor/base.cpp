#include <ensonify/engine/seafloor/base.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/detail_in_windows.h>
#include <ensonify/engine/seafloor/bed/generated_tiles.h>
#include <ensonify/engine/seafloor/bed/mean_plane.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {
namespace {

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
  constexpr double right_angle = 0.5 * std::numbers::pi;
  if (!(std::abs(options.slope_rad) < right_angle && std::isfinite(options.downhill_rad)))
    throw std::invalid_argument(fmt::format(
        "seafloor: it slopes by {} rad towards {} rad; the slope must be less than a right angle",
        options.slope_rad, options.downhill_rad));
  const double cells_east = std::round(options.extent_east_m / options.cell_m);
  const double cells_north = std::round(options.extent_north_m / options.cell_m);
  if (!(cells_east >= 1.0 && cells_north >= 1.0))
    throw std::invalid_argument(
        fmt::format("seafloor: an extent of {} x {} m holds no cell of {} m; make it larger or the "
                    "cell smaller",
                    options.extent_east_m, options.extent_north_m, options.cell_m));
  if (!(2.0 * cells_east * cells_north <= max_seafloor_faces))
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

MeanPlane plane_of(const SeafloorOptions& options) {
  return {options.depth_m, options.slope_rad, options.downhill_rad};
}

/// Throws if the survey is above the sea surface. `under_water` is the share of its points that are
/// below the sea surface.
void refuse_all_land(const SeafloorOptions& options, double lowest_m, double highest_m,
                     double under_water) {
  constexpr double least = 1e-3;  // a smaller share of points is taken for wrong heights
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

Heightfield make_survey(const SeafloorOptions& options, std::uint64_t seed,
                        const WorkControl& control) {
  Heightfield field = read_survey(survey_of(options), options.water_level_m,
                                  scatter_of(options, seed), control.stop_check);
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
  return with_detail(field, options.detail, seed, control);
}

}  // namespace

void check_header(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::survey) read_survey_header(survey_of(options));
}

Heightfield base_grid(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::fractal) return fractal_grid(options);
  Heightfield grid = read_survey_header(survey_of(options));
  return options.detail.cell_m > 0.0 ? grid_with_detail(grid, options.detail) : grid;
}

Heightfield make_base(const SeafloorOptions& options, std::uint64_t seed,
                      const WorkControl& control) {
  if (options.kind != SeafloorKind::fractal) return make_survey(options, seed, control);
  Heightfield field = fractal_grid(options);
  field.z_m.resize(static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows));
  lay(plane_of(options), field, field.z_m);
  add_fractal(field, options.fractal, seed, control);
  add_ripples(field, options.ripples, seed, control);
  return field;
}

refine::HeightTiles::Heights base_in_windows(const SeafloorOptions& options, std::uint64_t seed) {
  if (options.kind == SeafloorKind::fractal)
    return generated_tiles(fractal_grid(options), plane_of(options), options.fractal,
                           options.ripples, seed);
  const SurveyFile file = survey_of(options);
  refine::HeightTiles::Heights survey =
      survey_tiles(file, options.water_level_m, scatter_of(options, seed));
  if (options.detail.cell_m == 0.0) return survey;
  return with_detail_in_windows(read_survey_header(file), std::move(survey),
                                sample_survey(file, options.water_level_m).parts, options.detail,
                                seed);
}

SurveySample sample_base(const SeafloorOptions& options) {
  if (options.kind == SeafloorKind::fractal) {
    const double mean_m = -options.depth_m;
    const double to_corner_m = 0.5 * plane_of(options).rise().cwiseAbs().dot(Eigen::Vector2d(
                                         options.extent_east_m, options.extent_north_m));
    return {.mean_m = mean_m,
            .lowest_m = mean_m - to_corner_m,
            .highest_m = mean_m + to_corner_m,
            .parts = {}};
  }
  SurveySample sample = sample_survey(survey_of(options), options.water_level_m);
  refuse_all_land(options, sample.lowest_m, sample.highest_m, 1.0);
  return sample;
}

void take_grid(std::shared_ptr<const refine::HeightGrid> grid, const Heightfield& base,
               Seafloor& seafloor) {
  seafloor.mesh.world_origin = grid->world_origin();
  seafloor.utm_zone = base.utm_zone;
  seafloor.reference = base.reference;
  seafloor.vertices = grid->vertices();
  seafloor.faces = seafloor.bed_faces = grid->faces();
  seafloor.mean_bed_m = grid->mean_height_m();
  seafloor.grid = std::move(grid);
}

void refuse_land(std::span<const double> z_m, double depth_m) {
  const double highest = std::ranges::max(z_m);
  if (!(highest <= 0.0))
    throw std::invalid_argument(fmt::format(
        "seafloor: the bed rises {:.3g} m above the sea surface at a mean depth of {} m; make it "
        "deeper, the relief or the slope lower, or the extent smaller",
        highest, depth_m));
}

}  // namespace ensonify::engine
