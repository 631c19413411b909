#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulator/ping_all.h>

namespace ensonify::engine {

class OutputFolder;  // output_folder.h
struct RunState;     // run_state.h

/// What write_files() has written.
struct WrittenPings {
  PartRecord record;                               ///< with an empty list of files
  std::vector<Picture> pictures;                   ///< by sonar
  std::vector<std::vector<TargetRecord>> targets;  ///< by sonar
};

/// Encodes the files of the pings of a run or of one of its parts, on several threads: for each
/// sonar NAME the picture, the layers and recordings that the scene asks for, the table of pings
/// and the targets. The recordings may also be of all sonars together. `ending` follows NAME in all
/// file names. Renumbers the labels in the order that the scene gives.
WrittenPings write_files(const RunState& run, ScenePings& pings, const Simulator& simulator,
                         const std::string& ending, int threads, OutputFolder& folder);

/// The names of the files that write_files() may write of these pings.
std::vector<std::string> file_names(const Scene& scene, const std::string& ending,
                                    PingRange pings = {});

/// An upper limit for the bytes of all files of a run that has `pings` pings in `parts` parts. It
/// includes the joined pictures, but not the tables of targets.
double most_file_bytes(const Scene& scene, std::span<const Sonar> sonars, std::size_t pings,
                       std::size_t parts);

/// The picture of a sonar's pings, as write_files() writes it.
Picture picture_of(const Scene& scene, const Waterfall& image, const Simulator& simulator,
                   std::size_t sonar, const NeighbourRows* neighbours = nullptr);

}  // namespace ensonify::engine
