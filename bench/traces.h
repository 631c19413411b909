#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// The cost of tracing alone, on one thread. The tree is over the whole seafloor, or over the faces
/// that a pair of fans can touch. Then these faces are found, and their tree is built, per pair.
struct TraceMeasurement {
  std::string name;  ///< trace/BED/SIZE/INTERSECTOR
  std::string code_path;
  std::size_t faces = 0;     ///< traced faces
  double rays = 0.0;         ///< within the beam, of a pair of fans: port and starboard
  double build_ms = 0.0;     ///< to build the tree or the progressive mesh: once, on all threads
  Spread pair_us;            ///< per pair of fans
  Spread query_us, take_us;  ///< per pair: to find its faces, and to build over them
  double ratio = 0.0;        ///< pair_us divided by pair_us of Embree's bare loop: median of pairs
};

/// Times the tracing cases whose name contains `filter`, and the bare loops over the same beds,
/// alternately, `pings` pairs of fans per round; beds of more than 4 million faces only if the
/// filter contains their size.
std::vector<TraceMeasurement> measure_traces(std::string_view filter,
                                             const std::filesystem::path& data, int rounds,
                                             int pings);

}  // namespace ensonify::bench
