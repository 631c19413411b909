#pragma once

#include <cstdint>
#include <span>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/survey_detail.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// As with_detail(), but in windows of the finer grid: the same interpolated heights, and relief
/// with the same statistics. `survey` has the size of the survey, whose cells must be square, and
/// `heights` returns its heights in windows. The scale of the relief is estimated from `parts` of
/// the survey. Throws std::invalid_argument as with_detail(); the returned function throws what
/// `heights` throws.
refine::HeightTiles::Heights with_detail_in_windows(const Heightfield& survey,
                                                    refine::HeightTiles::Heights heights,
                                                    std::span<const Heightfield> parts,
                                                    const SurveyDetail& detail, std::uint64_t seed);

}  // namespace ensonify::engine
