#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/imitation/near_sediments.h>
#include <ensonify/engine/imitation/simulated_line.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Corrects the model until its simulation has the statistics of the line: altitude, material,
/// vertical beam or gain, gain over range, floor, relief, texture, pulse, length of the array. The
/// model's path has the line's pings. Simulates `rounds` times; `begins` is called with the number
/// of each simulation before it.
void fit_line(LineModel& model, const RecordedLine& line, const std::filesystem::path& folder,
              int threads, int rounds, bool beam_is_stated, std::vector<NearSediment>& sediments,
              const std::function<AfterPings(int round)>& begins);

}  // namespace ensonify::engine
