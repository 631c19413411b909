#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// The cost of selective refinement alone, on one thread: a sonar 15 m above a fractal seafloor of
/// 500 x 500 m, two fans of 0.6 degrees and 150 m, moving 0.4 m from ping to ping.
struct RefinementMeasurement {
  std::string name;  ///< refine/builder/seafloor/faces
  std::size_t faces = 0;
  double build_s = 0.0;           ///< to build the progressive mesh, once
  double bytes_per_vertex = 0.0;  ///< of the progressive mesh
  double first_ms = 0.0;          ///< the first ping, from the base mesh
  Spread refine_ms;               ///< later pings, including their exact faces
  Spread query_ms;                ///< the same exact faces by a top-down query
  double splits = 0.0, forced_splits = 0.0, collapses = 0.0, blocked_collapses = 0.0;  ///< per ping
  std::size_t active_vertices = 0, active_faces = 0, exact_faces = 0;
  /// Active vertices after 1000 pings, divided by the active vertices of a fresh refinement at that
  /// place.
  double growth = 0.0;
};

/// Measures the cases whose name contains `filter`.
std::vector<RefinementMeasurement> measure_refinement(std::string_view filter);

}  // namespace ensonify::bench
