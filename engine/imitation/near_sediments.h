#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/imitation/line_model.h>

namespace ensonify::engine {

/// The level of a bed shows its material between these cells, 8 to 76 degrees: below, noise floor
/// and shadows affect it; above, a cell has few samples.
constexpr std::size_t first_sediment_cell = 4, end_sediment_cell = 38;

/// The sediments, ordered by how well their backscatter over the grazing angle explains
/// `excess_db`, up to any constant. `excess_db` is, by cell, the line's level less that of the
/// model's material (dB); cells of NaN do not count. Without `rock_too` only sediments with a grain
/// size; never one that would return more energy than arrives.
struct NearSediment {
  std::string name;
  double rms_db;  ///< rms of the part that the sediment does not explain
};
std::vector<NearSediment> nearest_sediments(const LineModel& model, const GrazingLevels& excess_db,
                                            bool rock_too);

}  // namespace ensonify::engine
