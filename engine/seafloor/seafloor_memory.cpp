#include <ensonify/engine/seafloor/seafloor_memory.h>

#include <algorithm>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/base.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {
namespace {

/// Bytes allocated at the same time while the heights of a bed are made, with 8 per point for them.
double heights_bytes(const SeafloorOptions& options, const Heightfield& grid) {
  const double points = grid.points();
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
  // 16 bytes per point: the bed before all layers, and where a layer lies. 28: in addition the
  // relief of a roughness layer and its marks.
  if (!options.seabed.empty()) at_once(16.0 * points);
  for (const auto& layer : options.seabed.roughness)
    at_once(28.0 * points + spectral_field_bytes(grid, fractal_field(grid, layer.relief)));
  return bytes;
}

/// The most bytes that exist at the same time after the heights of a bed are made: first the
/// heights and their grid, then the grid and its mesh, then the mesh and what is built over it.
double bed_bytes(const Heightfield& grid, double faces, double bytes_per_face, BedForm form) {
  const double heights = 8.0 * grid.points();
  const double in_grid = refine::HeightGrid::bytes_of(grid.columns, grid.rows);
  if (form == BedForm::grid) return heights + in_grid;
  const double mesh = refine::mesh_bytes_per_face * faces;
  return std::max(heights + in_grid, mesh + std::max(in_grid, bytes_per_face * faces));
}

std::string description_of(const Heightfield& grid, const MemoryPlan& plan) {
  return fmt::format(
      "a seafloor of {} x {} points and what is built over it{}", grid.columns, grid.rows,
      plan.more_bytes > 0.0 ? fmt::format(" ({:.3g} GB of it images)", 1e-9 * plan.more_bytes)
                            : "");
}

}  // namespace

std::string smaller_bed_remedy(const SeafloorOptions& options, BedForm form) {
  const std::string smaller =
      options.kind == SeafloorKind::fractal
          ? "make seafloor.cell_m larger or the extent smaller"
          : "make the survey coarser with gdalwarp -tr (or soundings with a larger "
            "seafloor.survey_cell_m), cut a part out with gdal_translate -projwin, or use a "
            "larger seafloor.detail.cell_m if there is one";
  return form == BedForm::grid
             ? smaller
             : "set run.surface = \"footprint\" in a run, which needs no mesh of the bed, or " +
                   smaller;
}

void require_heights_fit(const SeafloorOptions& options, const MemoryPlan& plan) {
  const Heightfield grid = base_grid(options);
  if (options.kind == SeafloorKind::fractal && options.ripples.rms_height_m > 0.0)
    plan.limit.require(
        spectral_field_bytes(grid, ripple_field(grid, options.ripples)),
        fmt::format("ripples of {} m in cells of {} m (they repeat after 4 wavelengths over "
                    "relative_width)",
                    options.ripples.wavelength_m, std::max(grid.cell_east_m, grid.cell_north_m)),
        "make seafloor.ripples.wavelength_m shorter, or seafloor.cell_m or "
        "seafloor.ripples.relative_width larger");
  plan.limit.require(heights_bytes(options, grid) + plan.more_bytes, description_of(grid, plan),
                     smaller_bed_remedy(options, BedForm::grid));
}

void require_bed_fits(const SeafloorOptions& options, const MemoryPlan& plan, BedForm form) {
  require_heights_fit(options, plan);
  if (options.kind == SeafloorKind::survey) return;
  const Heightfield grid = base_grid(options);
  const double faces = 2.0 * (grid.columns - 1.0) * (grid.rows - 1.0);
  plan.limit.require(bed_bytes(grid, faces, plan.bytes_per_face, form) + plan.more_bytes,
                     description_of(grid, plan), smaller_bed_remedy(options, form));
}

void require_faces_fit(const SeafloorOptions& options, const Heightfield& field,
                       const MemoryPlan& plan, BedForm form) {
  double faces = 0.0;
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column)
      faces += 2.0 * field.whole(column, row);
  plan.limit.require(
      bed_bytes(field, faces, plan.bytes_per_face, form) - 8.0 * field.points() + plan.more_bytes,
      description_of(field, plan), smaller_bed_remedy(options, form));
}

}  // namespace ensonify::engine
