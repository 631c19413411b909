#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/imitation/line_model.h>

namespace ensonify::engine {

/// The level of a bed shows its material in these cells, from 8 to 76 degrees. At lower angles the
/// noise floor and shadows affect it; at higher angles a cell has few samples.
constexpr std::size_t first_sediment_cell = 4, end_sediment_cell = 38;

/// The backscatter strength of a material in dB, by cell, at the model's frequency.
GrazingLevels strength_db(const LineModel& model, std::string_view material);

/// The sediments, ordered by how well their backscatter strength over the grazing angle explains
/// `excess_db`: the line's level minus that of the model's material, in dB by cell. A constant, a
/// small error of the altitude and a small error of the gain over range are fitted in addition.
/// Cells that are NaN do not count; cells with few samples or near the noise count less. If the
/// beam is not stated, only sediments with a grain size are tried. Sediments that would return more
/// energy than arrives are left out.
struct NearSediment {
  std::string name;
  double rms_db;       ///< rms of what the sediment does not explain
  double chi_squared;  ///< the sum of (what it does not explain)^2 / expected variance
};
std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool beam_is_stated);

/// The number of sediments that explain the levels almost as well as the first does: their
/// chi_squared is less than 9 (3 standard deviations) above that of the first. Errors of the levels
/// may decide the order of these sediments. 1: only the first.
std::size_t as_near_as_the_first(const std::vector<NearSediment>& sediments);

}  // namespace ensonify::engine
