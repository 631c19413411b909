#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/imitation/line_model.h>

namespace ensonify::engine {

/// The level of a bed shows its material between these cells, 8 to 76 degrees: below, noise floor
/// and shadows affect it; above, a cell has few samples.
constexpr std::size_t first_sediment_cell = 4, end_sediment_cell = 38;

/// The backscatter strength of a material by cell, at the model's frequency.
GrazingLevels strength_db(const LineModel& model, std::string_view material);

/// The sediments, ordered by how well their backscatter over the grazing angle explains
/// `excess_db`, up to any constant and to what small errors of altitude and gain over range change.
/// `excess_db` is, by cell, the line's level less that of the model's material (dB); cells of NaN
/// do not count, and those with few samples or near the noise count less. Without a stated beam
/// only sediments with a grain size; never one that would return more energy than arrives.
struct NearSediment {
  std::string name;
  double rms_db;       ///< rms of the part that the sediment does not explain
  double chi_squared;  ///< the sum of its squares, each over the variance that is expected there
};
std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool beam_is_stated);

/// How many of the first sediments explain the levels so nearly alike that errors of the levels
/// decide which is first; 1: the first alone.
std::size_t as_near_as_the_first(const std::vector<NearSediment>& sediments);

}  // namespace ensonify::engine
