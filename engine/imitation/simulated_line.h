#pragma once

#include <cstddef>
#include <functional>

#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Called with the number of pings done in one simulation, and of all its pings; may throw to stop.
using AfterPings = std::function<void(std::size_t done, std::size_t of)>;

/// The pings of the model's scene, as a recorded line in the recording's numbers, without the
/// samples that the recording does not have.
struct SimulatedLine {
  RecordedLine line;
  double gain_db;  ///< the recorder's gain at 1 m
};
/// Throws as Simulator.
SimulatedLine simulated_line(const LineModel& model, int threads, const AfterPings& after_pings);

}  // namespace ensonify::engine
