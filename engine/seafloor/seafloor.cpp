#include <ensonify/engine/seafloor/seafloor.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/survey.h>
#include <ensonify/engine/seafloor/tessellate.h>

namespace ensonify::engine {
namespace {

constexpr double most_faces = 2147483648.0;  // 2^31

Heightfield make_fractal(const SeafloorOptions& options, std::uint64_t seed) {
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
  if (!(2.0 * cells_east * cells_north <= most_faces))
    throw std::invalid_argument(fmt::format(
        "seafloor: {:.0f} x {:.0f} cells are more than 2^31 faces; make the extent smaller or the "
        "cell larger than {} m",
        cells_east, cells_north, options.cell_m));

  Heightfield field;
  field.columns = static_cast<int>(cells_east) + 1;
  field.rows = static_cast<int>(cells_north) + 1;
  field.cell_east_m = field.cell_north_m = options.cell_m;
  field.z_m.assign(static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows),
                   -options.depth_m);
  add_fractal(field, options.fractal, seed);
  add_ripples(field, options.ripples, seed);
  const double highest = *std::max_element(field.z_m.begin(), field.z_m.end());
  if (!(highest <= 0.0))
    throw std::invalid_argument(
        fmt::format("seafloor: the bed rises {:.3g} m above the sea surface, its mean depth being "
                    "{} m; make it "
                    "deeper, the relief lower, or the extent smaller",
                    highest, options.depth_m));
  return field;
}

Heightfield make_survey(const SeafloorOptions& options) {
  Heightfield field = read_survey(options.survey, options.water_level_m);
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
        options.survey.string(), lowest + options.water_level_m, highest + options.water_level_m,
        options.water_level_m));
  return field;
}

}  // namespace

Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed) {
  return options.kind == SeafloorKind::survey ? make_survey(options) : make_fractal(options, seed);
}

Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed) {
  return {.mesh = tessellate(make_heightfield(options, seed)),
          .labels = {{.sediment = 1, .class_id = 1, .instance = 0}},
          .face_label = {}};
}

}  // namespace ensonify::engine
