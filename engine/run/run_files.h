#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {

struct RunState;  // run_state.h

/// Writes a file. Several threads may call it at once.
using WriteFile =
    std::function<void(const std::string& name, const refine::WriteContent& write_content)>;

/// The place of a run's world on Earth, as far as it is known.
struct WorldOnEarth {
  std::optional<GeographicPlace> middle;  ///< as TrackPoses
  std::string reference;                  ///< as in Manifest
};

/// Encodes the files of the pings of a run or of one of its parts, on several threads: for each
/// sonar NAME the picture, the layers and recordings that the scene asks for, the table of pings
/// and the targets. The recordings may also be of all sonars together. `ending` follows NAME in all
/// file names. Renumbers the labels in the order that the scene gives. Returns the record of these
/// pings, without their files.
PartRecord write_files(const RunState& run, ScenePings& pings, const Simulator& simulator,
                       const std::string& ending, int threads, const WriteFile& write);

/// The names of the files that write_files() may write.
std::vector<std::string> file_names(const Scene& scene, const std::string& ending);

/// The most bytes of the files of a run's parts with these pings, joined pictures included; without
/// the tables of targets.
double most_file_bytes(const Scene& scene, std::span<const Sonar> sonars, std::size_t pings,
                       std::size_t parts);

/// The picture of a sonar's pings, as write_files() encodes it.
std::vector<std::byte> encode_picture(const Scene& scene, const Waterfall& image,
                                      const Simulator& simulator, std::size_t sonar,
                                      const NeighbourRows* neighbours = nullptr);

}  // namespace ensonify::engine
