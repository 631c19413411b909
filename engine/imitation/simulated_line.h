#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Called with the number of pings done in one simulation, and of all its pings; may throw to stop.
using AfterPings = std::function<void(std::size_t done, std::size_t of)>;

/// Writes the model's scene into the folder and makes its pings, as a recorded line in the
/// recording's numbers, without the samples that the recording does not have.
/// `automatic_gain_db` receives the recorder's gain at 1 m. Throws as Simulator.
RecordedLine simulated_line(const LineModel& model, const std::filesystem::path& folder,
                            int threads, const AfterPings& after_pings, double* gain_db = nullptr);

}  // namespace ensonify::engine
