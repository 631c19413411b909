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

/// A cell of the grid: whole pings over a bed with a face source and an intersector, on one thread,
/// in thread time (stages in wall time), without speckle and noise.
struct Cell {
  std::string name;  ///< ping/BED/SIZE/SURFACE/INTERSECTOR[/8]
  std::string bed, size, surface, intersector, code_path;
  int query_pings = 1;  ///< how many pings one tree, or the faces of one scan, serve
  std::size_t faces = 0;
  double rays = 0.0;       ///< per ping
  double prepare_s = 0.0;  ///< seafloor, analysis unless cached, trees; on all threads
  double first_ping_ms = 0.0;
  Spread ping_ms;
  Spread speedup;  ///< over the fastest static Embree packets of this machine, turn by turn
  double surface_ms = 0.0, trace_ms = 0.0, echo_ms = 0.0;  ///< means over those pings
  double stages_over_ping = 0.0;  ///< sum of the stages' times over the pings' time
  /// What the face source needs without trees: mesh and heights, or the mapped progressive mesh.
  double mesh_mb = 0.0, progressive_mb = 0.0;
  // The comparison of one ping's rays with the exact reference.
  std::uint64_t checked_rays = 0;
  std::array<std::uint64_t, engine::verdict_names.size()> verdicts{};
  std::uint64_t wrong_numbers = 0;  ///< hits whose index or run is of another face
  bool agrees() const;
};

/// What to measure.
struct GridOptions {
  std::string pattern;  ///< only cells whose name contains it, and those they are compared with
  bool quick = false;   ///< small beds, few turns
  std::filesystem::path data, cache;
  std::function<void(std::string_view what)> progress;
};

/// Times the grid's cells, bed by bed, alternately in turns of 8 pings, so that a change of the
/// machine's speed affects all equally. Before that it compares each cell's hits of one ping with
/// the exact reference; a cell that disagrees is not timed.
std::vector<Cell> measure_grid(const GridOptions& options);

}  // namespace ensonify::bench
