#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// What tracing alone costs, on one thread: with a tree over the whole seafloor, or on the faces
/// that a pair of fans can touch, which are then found and taken first.
struct TraceMeasurement {
  std::string name;  ///< trace/BED/SIZE/INTERSECTOR
  std::string code_path;
  std::size_t faces = 0;     ///< that are traced
  double rays = 0.0;         ///< a pair of fans, port and starboard
  double build_ms = 0.0;     ///< of the tree, or of the progressive mesh: once, on all threads
  Spread pair_us;            ///< a pair of fans
  Spread query_us, take_us;  ///< a pair: to find its faces, and to build over them
  double ratio = 0.0;        ///< to Embree's bare loop over the same fans, the middle of all pairs
};

/// Times the tracing cases whose name holds `filter`, in turns, `pings` pairs of fans a round; beds
/// of more than 4 million faces only if the filter names their size.
std::vector<TraceMeasurement> measure_traces(std::string_view filter,
                                             const std::filesystem::path& data, int rounds,
                                             int pings);

}  // namespace ensonify::bench
