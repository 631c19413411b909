#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/engine/imitation/line_model.h>
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

}  // namespace ensonify::engine
