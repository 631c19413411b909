#pragma once

#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/imitation/near_sediments.h>
#include <ensonify/engine/imitation/simulated_line.h>

namespace ensonify::engine {

/// Corrects the model until its simulation has the statistics of the line: altitude, material,
/// vertical beam or gain, gain over range, noise floor, relief, texture, pulse, length of the
/// array. The model's path has the line's pings. The pings are simulated 10 times; `after_pings`
/// counts the pings of all simulations. Returns nearest_sediments().
std::vector<NearSediment> fit_line(LineModel& model, const LineWithBed& line, int threads,
                                   bool beam_is_stated, const AfterPings& after_pings);

}  // namespace ensonify::engine
