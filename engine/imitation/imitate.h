#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/comparison/line_statistics.h>
#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How an imitation is made.
struct ImitationControl {
  int threads = 0;  ///< 0: one per core of the machine
  /// Called with the stage ("fit", "pings") and how much of it is done. Returning false stops the
  /// work with Stopped.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress;
};

/// The result of an imitation.
struct Imitation {
  LineModel model;
  LineWithBed line;                           ///< the part of the recording that is imitated
  LineWithBed imitated;                       ///< the same pings, simulated with the scene
  LineWithBed judged, judged_imitated;        ///< their pings that the fit did not use
  std::vector<ComparedStatistic> statistics;  ///< of these pings, the recording first
  std::vector<std::string> materials;  ///< nearest first, by their level over the grazing angle
  std::vector<std::string> unknown;    ///< what the recording does not show
};

/// Finds a scene whose images look like a recorded line. The recording's pings are divided into
/// blocks of 32; numbers are fitted to every second block and judged on the others. At most 3000
/// of the alike_pings(), from the middle of a longer line. `folder` gets the scene's files
/// scene.toml, navigation.csv and beam.csv. Throws RecordingError for a line that shows no bed or
/// does not state its range, Stopped, and as Simulator.
Imitation imitate(const RecordedLine& recording, const std::filesystem::path& folder,
                  const ImitationControl& control);

/// A page with both waterfalls, level over angle and range, histograms, the statistics, and each
/// key with its evidence. It needs no other file.
std::string imitation_page(const std::string& name, const Imitation& made);

}  // namespace ensonify::engine
