#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/imitation/line_model.h>

namespace ensonify::engine {

/// Between these cells the level of a bed says something of its material: below, floor and shadows
/// count; above, a cell has few samples. 8 to 76 degrees.
constexpr std::size_t first_sediment_cell = 4, end_sediment_cell = 38;

/// The sediments in order of how well their backscatter over the grazing angle explains
/// `excess_db`: what the line's level, by cell, is over that of the model's material; any constant
/// is free. Cells of NaN do not count. Without `rock_too` only those with a grain size; never one
/// that would return more energy than arrives.
struct NearSediment {
  std::string name;
  double rms_db;  ///< what it leaves unexplained
};
std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool rock_too);

}  // namespace ensonify::engine
