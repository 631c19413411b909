#include <ensonify/engine/seafloor/layers/seabed_in_windows.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/layers/roughness_in_windows.h>

namespace ensonify::engine {
namespace {

constexpr int max_margin = 1024;  // points
constexpr int sampled_rows = 8;   // rows and columns of sampled places

/// Whether a layer at a place depends only on the bed near the place. The rock of outcrops does
/// not, because it is one transform over the whole grid. Roughness on cells that are not square is
/// such a transform too; on square cells it is not (RoughnessInWindows).
template <class Relief>
bool fits_windows(const Heightfield& grid) {
  if (std::is_same_v<Relief, FractalRelief>) return grid.cell_east_m == grid.cell_north_m;
  return !std::is_same_v<Relief, OutcropRelief>;
}

/// Calls f(key, area, reach in metres, whether it fits windows) for each patch and layer of relief.
template <class F>
void for_each_layer(const Heightfield& grid, const SeabedOptions& options, F&& f) {
  for (std::size_t i = 0; i < options.patches.size(); ++i)
    f(fmt::format("seafloor.patches.{}", i), options.patches[i].area, 0.0, true);
  for_each_relief_list(options, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      double its_reach_m = 0.0;
      if constexpr (requires { reach_m(list[i].relief); }) its_reach_m = reach_m(list[i].relief);
      f(fmt::format("seafloor.{}.{}", kind_of(Relief{}).list, i), list[i].area, its_reach_m,
        fits_windows<Relief>(grid));
    }
  });
}

/// The number of points beyond a window's border on which a layer in the window depends.
double margin_of(const Area& area, double reach_m, const Heightfield& grid) {
  const double cell_m = std::min(grid.cell_east_m, grid.cell_north_m);
  // The three means of softened() reach half the width together; 3 is for their rounding.
  const auto of_means = [&](double width_m) { return 0.5 * width_m / cell_m + 3.0; };
  double margin = std::max(of_means(area.border_m), reach_m / cell_m + 1.0);
  if (area.gentlest_rad || area.steepest_rad)
    margin += of_means(std::max(area.border_m, 6.0 * grid.cell_east_m)) + 1.0;
  return margin;
}

int margin_of(const SeabedOptions& options, const Heightfield& grid) {
  double most = 0.0, sum = 0.0;
  bool on_others = false;
  for_each_layer(grid, options, [&](const std::string&, const Area& area, double reach_m, bool) {
    const double margin = margin_of(area, reach_m, grid);
    most = std::max(most, margin);
    sum += margin;
    on_others = on_others || !area.on.empty();
  });
  return static_cast<int>(std::ceil(std::min(on_others ? sum : most, max_margin + 1.0)));
}

/// The part of a window that is inside the grid, with heights of 0.
Heightfield window_of(const Heightfield& grid, int first_column, int first_row, int end_column,
                      int end_row) {
  const int west = std::max(0, first_column), south = std::max(0, first_row);
  Heightfield window = grid.window(west, south, std::min(grid.columns, end_column) - west,
                                   std::min(grid.rows, end_row) - south);
  window.z_m.assign(
      static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows), 0.0);
  return window;
}

}  // namespace

std::optional<SceneError> obstacle_to_windows(const Heightfield& grid,
                                              const SeabedOptions& options) {
  std::optional<SceneError> obstacle;
  for_each_layer(grid, options, [&](const std::string& key, const Area& area, double reach_m, bool fits) {
    if (obstacle) return;
    const auto refuse = [&](std::string_view why) {
      obstacle.emplace(key, fmt::format("{}: {}", key, why));
    };
    if (!fits)
      refuse(
          "this bed is made in tiles and cannot have this layer, which is made for all of the bed at "
          "once (roughness only if its cells are not square); remove it, or make the bed smaller");
    else if (area.pixels || !area.image.path.empty())
      refuse(
          "a bed that is made in tiles takes areas as polygons; make an outline of the image with "
          "gdal_polygonize.py, in GeoJSON");
    else if (margin_of(area, reach_m, grid) > max_margin)
      refuse(fmt::format(
          "its forms or its border reach {:.0f} m; where a bed with such cells is made in tiles, they "
          "may reach about {:.0f} m: make them smaller, or the cells larger",
          std::max(reach_m, 0.5 * area.border_m),
          max_margin * std::min(grid.cell_east_m, grid.cell_north_m)));
  });
  if (!obstacle && margin_of(options, grid) > max_margin)
    obstacle.emplace(
        "seafloor: the layers of a bed that is made in tiles depend on too much of what lies around "
        "(an area's key 'on' makes them depend on one another); use smaller forms, or leave 'on' out");
  return obstacle;
}

void require_windows(const Heightfield& grid, const SeabedOptions& options) {
  if (const auto obstacle = obstacle_to_windows(grid, options)) throw SceneError(*obstacle);
  // lay_seabed() refuses for a corner what it refuses for the whole bed, except areas outside it.
  Heightfield corner = window_of(grid, 0, 0, 4, 4);
  lay_seabed(corner, options, {}, 0);
  for_each_layer(grid, options, [&](const std::string& key, const Area& area, double, bool) {
    if (const std::string fault = fault_of_place(area, grid); !fault.empty())
      throw SceneError(key, fmt::format("{}: {}", key, fault));
  });
}

std::vector<std::string> unfound_area_warnings(
    const Heightfield& grid, const SeabedOptions& options,
    const std::function<refine::HeightTiles::Heights()>& make_bed) {
  std::vector<Heightfield> samples;  // made when the first layer needs them
  double deepest_m = 0.0, shallowest_m = std::numeric_limits<double>::infinity();
  const auto take_samples = [&] {
    constexpr int side = 64;  // points
    const int columns = std::min(side, grid.columns), rows = std::min(side, grid.rows);
    const refine::HeightTiles::Heights bed = make_bed();
    for (int row = 0; row < sampled_rows; ++row)
      for (int column = 0; column < sampled_rows; ++column) {
        const auto first = [](int place, int points) {
          return static_cast<int>((place + 0.5) / sampled_rows * points);
        };
        const int west = first(column, grid.columns - columns);
        const int south = first(row, grid.rows - rows);
        Heightfield& sample =
            samples.emplace_back(window_of(grid, west, south, west + columns, south + rows));
        bed(west, south, columns, rows, sample.z_m, {});
        for (const double z_m : sample.z_m)
          if (!std::isnan(z_m)) {
            deepest_m = std::max(deepest_m, -z_m);
            shallowest_m = std::min(shallowest_m, -z_m);
          }
      }
  };
  std::vector<std::string> warnings;
  for_each_layer(grid, options, [&](const std::string& key, const Area& area, double, bool) {
    if (!area.shallowest_m && !area.deepest_m && !area.gentlest_rad && !area.steepest_rad) return;
    if (samples.empty()) take_samples();
    const Area limits{.shallowest_m = area.shallowest_m,
                      .deepest_m = area.deepest_m,
                      .gentlest_rad = area.gentlest_rad,
                      .steepest_rad = area.steepest_rad,
                      .border_m = area.border_m};
    const bool found = std::ranges::any_of(samples, [&](const Heightfield& sample) {
      const std::vector<double> mask = area_mask(limits, {sample, {}}, {});
      return std::ranges::any_of(mask, [](double inside) { return inside > 0.0; });
    });
    if (!found)
      warnings.push_back(fmt::format(
          "{}: at {} places all over the bed no point has the depths and slopes of this area, so it "
          "may lie nowhere (depths there are {:.2f} to {:.2f} m)",
          key, samples.size(), shallowest_m, deepest_m));
  });
  return warnings;
}

std::vector<std::string> nowhere_on_warnings(const SeabedOptions& options,
                                             const std::string& material) {
  std::vector<std::string> there{material}, warnings;
  const auto look = [&](const auto& list, std::string_view name) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string& on = list[i].area.on;
      if (!on.empty() && std::ranges::find(there, on) == there.end())
        warnings.push_back(nowhere_on_warning(fmt::format("{}.{}", name, i)));
      else if (!list[i].material.empty())
        there.push_back(list[i].material);
    }
  };
  look(options.patches, "patches");
  for_each_relief_list(options, [&]<class Relief>(const std::vector<ReliefLayer<Relief>>& list) {
    look(list, kind_of(Relief{}).list);
  });
  return warnings;
}

std::vector<SeabedMap::Kind> possible_kinds(const SeabedOptions& options,
                                            const std::string& material) {
  std::vector<SeabedMap::Kind> kinds{{material, "seabed"}};
  const auto paint = [&](const std::string& with, const std::string& class_name) {
    if (with.empty() && class_name.empty()) return;
    const std::size_t before = kinds.size();
    for (std::size_t i = 0; i < before; ++i) {
      SeabedMap::Kind kind = kinds[i];
      if (!with.empty()) kind.material = with;
      if (!class_name.empty()) kind.class_name = class_name;
      if (std::ranges::find(kinds, kind) == kinds.end()) kinds.push_back(kind);
    }
    if (kinds.size() > 256)
      throw std::invalid_argument(
          "seafloor: a bed that is made in tiles can have 256 pairs of a material and a class, and "
          "these patches and layers make more; use fewer classes or materials");
  };
  for (const Patch& patch : options.patches) paint(patch.material, patch.class_name);
  for_each_relief_list(options, [&](const auto& list) {
    for (const auto& layer : list) paint(layer.material, layer.class_name);
  });
  return kinds;
}

refine::HeightTiles::Heights with_seabed(const Heightfield& grid, refine::HeightTiles::Heights bed,
                                         const SeabedOptions& options, const std::string& material,
                                         std::uint64_t seed) {
  return [whole = grid.window(0, 0, grid.columns, grid.rows), margin = margin_of(options, grid),
          bed = std::move(bed), options, material, seed,
          roughness = std::make_shared<RoughnessInWindows>(grid),
          kinds_of_bed = possible_kinds(options, material)](
             int first_column, int first_row, int columns, int rows, std::span<double> z_m,
             std::span<std::uint8_t> kinds) {
    Heightfield window = window_of(whole, first_column - margin, first_row - margin,
                                   first_column + columns + margin, first_row + rows + margin);
    bed(window.first_column, window.first_row, window.columns, window.rows, window.z_m, {});
    const SeabedMap map = lay_seabed(window, options, material, seed, roughness.get());

    std::vector<std::uint8_t> number;
    for (const SeabedMap::Kind& kind : map.kinds)
      number.push_back(
          static_cast<std::uint8_t>(std::ranges::find(kinds_of_bed, kind) - kinds_of_bed.begin()));
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        const std::size_t from = window.index(first_column - window.first_column + column,
                                              first_row - window.first_row + row);
        const std::size_t to = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                               static_cast<std::size_t>(column);
        z_m[to] = window.z_m[from];
        if (!kinds.empty()) kinds[to] = number[map.point_kind[from]];
      }
  };
}

}  // namespace ensonify::engine
