#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// What selective refinement alone costs, on one thread: a sonar 15 m over a fractal seafloor of
/// 500 x 500 m, two fans of 0.6 degrees and 150 m, 0.4 m on from ping to ping.
struct RefinementMeasurement {
  std::string name;  ///< refine/builder/seafloor/faces
  std::size_t faces = 0;
  double build_s = 0.0;           ///< of the progressive mesh, once
  double bytes_per_vertex = 0.0;  ///< of the progressive mesh
  double first_ms = 0.0;          ///< the first ping, from the base mesh
  Spread refine_ms;               ///< then, exact faces gathered
  Spread query_ms;                ///< the same exact faces by a top-down query
  double splits = 0.0, forced_splits = 0.0, collapses = 0.0, blocked_collapses = 0.0;  ///< a ping
  std::size_t active_vertices = 0, active_faces = 0, exact_faces = 0;
  double growth = 0.0;  ///< active vertices after 1000 pings over those of a fresh refinement there
};

/// Those of the cases whose name holds `filter`.
std::vector<RefinementMeasurement> measure_refinement(std::string_view filter);

}  // namespace ensonify::bench
