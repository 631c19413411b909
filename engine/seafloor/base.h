#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_options.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

// The base of a seafloor that is a grid: generated, or read from a survey and given finer detail.

/// Reads only the header of a survey. Throws what make_base() would throw because of the header.
void check_header(const SeafloorOptions& options);

/// The grid of the base without heights, from the options or from the header of the survey. Throws
/// std::invalid_argument for extents that make no grid or a grid of more than 2^31 faces, and what
/// read_survey_header() throws.
Heightfield base_grid(const SeafloorOptions& options);

/// Makes the whole base at once. Throws what base_grid() and read_survey() throw, and
/// refine::MeshError for a survey that lies above the sea surface.
Heightfield make_base(const SeafloorOptions& options, std::uint64_t seed,
                      const WorkControl& control);

/// A function for the heights of any window of the grid (bed/generated_tiles.h, survey_tiles()).
refine::HeightTiles::Heights base_in_windows(const SeafloorOptions& options, std::uint64_t seed);

/// Estimates the heights from the options, or from a sample of the survey, without making the base.
/// Throws what make_base() throws.
SurveySample sample_base(const SeafloorOptions& options);

/// Makes `grid` the bed of the seafloor. The UTM zone and the reference system are those of `base`.
void take_grid(std::shared_ptr<const refine::HeightGrid> grid, const Heightfield& base,
               Seafloor& seafloor);

/// Throws std::invalid_argument if a generated bed at this mean depth rises above the sea surface.
void refuse_land(std::span<const double> z_m, double depth_m);

}  // namespace ensonify::engine
