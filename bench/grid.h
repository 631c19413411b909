#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/check/agreement.h>

#include "spread.h"

namespace ensonify::bench {

/// A cell of the grid: whole pings over a bed by a surface and an intersector, on one thread and in
/// its own time (stages are by the clock on the wall), without speckle and noise.
struct Cell {
  std::string name;  ///< ping/BED/SIZE/SURFACE/INTERSECTOR[/8]
  std::string bed, size, surface, intersector, code_path;
  int query_pings = 1;  ///< a tree, or the faces of a scan, do for this many
  std::size_t faces = 0;
  double rays = 0.0;       ///< a ping
  double prepare_s = 0.0;  ///< seafloor, analysis unless it was cached, trees; on all threads
  double first_ping_ms = 0.0;
  Spread ping_ms;
  Spread speedup;  ///< over static Embree packets, the best there are here, pair by pair in one run
  double surface_ms = 0.0, trace_ms = 0.0, echo_ms = 0.0;  ///< means over the same pings
  double stages_over_ping = 0.0;               ///< all stages' times over the pings' own
  double mesh_mb = 0.0, progressive_mb = 0.0;  ///< what the surface needs
  double tree_mb = 0.0;  ///< how the process grew while the trees were built, the mesh apart
  // The rays of one ping against the exact reference.
  std::uint64_t checked_rays = 0;
  std::array<std::uint64_t, engine::verdict_names.size()> verdicts{};
  bool agrees() const;
};

/// What to measure.
struct GridOptions {
  std::string pattern;  ///< only cells whose name holds it, and what they are compared with
  bool quick = false;   ///< small beds, few turns
  std::filesystem::path data, cache;
  std::function<void(std::string_view what)> progress;
};

/// Times the grid's cells, bed by bed, in turns of 8 pings so that a change of the machine's pace
/// meets all alike. First each cell's hits of one ping are held against the exact reference: one
/// that disagrees is not timed.
std::vector<Cell> measure_grid(const GridOptions& options);

}  // namespace ensonify::bench
