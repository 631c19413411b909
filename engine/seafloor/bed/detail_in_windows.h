#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/survey_detail.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// What with_detail() makes, in windows of the finer grid, from windows of a survey of this size,
/// with square cells: the same interpolated heights, and relief of the same statistics. Its scale
/// is estimated from `parts` of the survey. Throws std::invalid_argument as with_detail() does, and
/// when heights are made, what the survey throws.
refine::HeightTiles::Heights with_detail_in_windows(const Heightfield& survey,
                                                    refine::HeightTiles::Heights heights,
                                                    std::span<const Heightfield> parts,
                                                    const SurveyDetail& detail, std::uint64_t seed);

}  // namespace ensonify::engine
