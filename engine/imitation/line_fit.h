#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/imitation/near_sediments.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Called with the number of pings that are done in a simulation and the number of all its pings.
/// It may throw to stop the simulation.
using AfterPings = std::function<void(std::size_t done, std::size_t of)>;

/// The pings of the model's scene as a recorded line, in the unit of the recording's samples.
/// Samples that the recording does not have are 0.
struct SimulatedLine {
  RecordedLine line;
  double gain_db;  ///< the recorder's gain at 1 m
};
/// Simulates the model's scene. Throws what Simulator throws.
SimulatedLine simulated_line(const LineModel& model, int threads, const AfterPings& after_pings);

/// Corrects the model until its simulation has the statistics of the line: altitude, material,
/// vertical beam or gain, gain over range, noise floor, relief, texture, pulse, length of the
/// array. The model's path has the line's pings. The pings are simulated 10 times; `after_pings`
/// counts the pings of all simulations. Returns nearest_sediments().
std::vector<NearSediment> fit_line(LineModel& model, const LineWithBed& line, int threads,
                                   bool beam_is_stated, const AfterPings& after_pings);

}  // namespace ensonify::engine
