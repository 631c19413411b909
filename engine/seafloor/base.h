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

// The base of a seafloor that is a grid: generated, or read from a survey, with its finer detail.

/// Reads only the header of a survey. Throws what make_base() would throw because of the header.
void check_header(const SeafloorOptions& options);

/// The base without heights, from the options or from the header of the survey. Throws
/// std::invalid_argument for extents that make no grid, or one of more than 2^31 faces; and what
/// read_survey_header() throws.
Heightfield base_grid(const SeafloorOptions& options);

/// The base at once. Throws what base_grid() and read_survey() throw, and refine::MeshError for a
/// survey that lies above the sea surface.
Heightfield make_base(const SeafloorOptions& options, std::uint64_t seed,
                      const WorkControl& control);

/// The base in windows of its grid (bed/generated_tiles.h, survey_tiles()).
refine::HeightTiles::Heights base_in_windows(const SeafloorOptions& options, std::uint64_t seed);

/// An estimate of the heights without making them: from the options, or from a sample of the
/// survey. Throws as make_base().
SurveySample sample_base(const SeafloorOptions& options);

/// Gives the seafloor this bed, which has the origin and the reference system of `base`.
void take_grid(std::shared_ptr<const refine::HeightGrid> grid, const Heightfield& base,
               Seafloor& seafloor);

/// Throws std::invalid_argument if a generated bed at this mean depth rises above the sea surface.
void refuse_land(std::span<const double> z_m, double depth_m);

}  // namespace ensonify::engine
