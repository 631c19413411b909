#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/memory_plan.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_options.h>

namespace ensonify::engine {

// A bed too large to be made at once is a grid of tiles, made when needed (refine/height_tiles.h).

/// Where the tiles are kept.
struct TileFile {
  std::filesystem::path file;  ///< empty: in memory
  std::string key;             ///< what the bed is made from
};

/// Whether a bed has to be made in tiles: a generated bed that is too large for one Fourier
/// transform, or a survey of more than 2^26 points (with detail: 2^28), unless it has something
/// that a survey in tiles cannot have. Throws what read_survey_header() throws.
bool needs_tiles(const SeafloorOptions& options);
/// Throws std::invalid_argument, with what to do, for a bed that needs tiles.
void require_at_once(const SeafloorOptions& options);

/// The seafloor, with the bed in tiles and the objects set down on it. A bed of any size can be
/// made in tiles. The heights of a generated bed then differ from the heights that make_seafloor()
/// makes, but have the same statistics. The mean height comes from the options, or from a sample of
/// the survey. Throws what make_seafloor() and refine::HeightTiles throw, and std::invalid_argument
/// for layers of the seabed that a bed in tiles cannot have (layers/seabed_in_windows.h).
Seafloor make_seafloor_in_tiles(const SeafloorOptions& options, std::uint64_t seed,
                                std::span<const ObjectOptions> objects,
                                std::span<const Material> materials, const TileFile& tiles,
                                const MemoryPlan& plan = {},
                                const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
