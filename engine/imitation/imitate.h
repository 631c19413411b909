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
  /// Called with the stage ("fit", "pings") and how much of it is done. If it returns false, the
  /// work ends with Stopped.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress;
};

/// The result of an imitation.
struct Imitation {
  LineModel model;
  LineWithBed line;                           ///< the part of the recording that is imitated
  LineWithBed imitated;                       ///< the same pings, simulated with the scene
  LineWithBed judged, judged_imitated;        ///< their pings that the fit did not use
  std::vector<ComparedStatistic> statistics;  ///< of the judged pings; a: recording
  std::vector<std::string> materials;         ///< the nearest first, by level over the angle
  std::vector<std::string> unknown;           ///< what the recording does not show
};

/// Finds a scene whose images look like a recorded line. The pings are divided into blocks of 32.
/// The scene's numbers are fitted to every second block and judged on the other blocks. Uses the
/// pings that alike_pings() selects. If there are more than 3000, only the 3000 in the middle are
/// used. Writes the scene's files into `folder`: scene.toml, navigation.csv and, if needed,
/// beam.csv and tones.png. Throws RecordingError for a line that shows no bed or does not state its
/// range, Stopped, and what Simulator throws.
Imitation imitate(const RecordedLine& recording, const std::filesystem::path& folder,
                  const ImitationControl& control);

/// An HTML page with both waterfalls, the level over angle and over range, histograms, the
/// statistics, and each key with its evidence. The page needs no other file.
std::string imitation_page(const std::string& name, const Imitation& made);

}  // namespace ensonify::engine
