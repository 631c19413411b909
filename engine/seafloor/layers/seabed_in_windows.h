#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/seabed.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// Why the layers cannot be laid on windows of a grid; none if they can.
std::optional<SceneError> obstacle_to_windows(const Heightfield& grid,
                                              const SeabedOptions& options);

/// Throws SceneError for such an obstacle and for an area outside the grid, and what
/// lay_seabed() throws for the options.
void require_windows(const Heightfield& grid, const SeabedOptions& options);

/// Warnings about layers whose depths and slopes are nowhere in a sample of the bed without its
/// layers. `make_bed` is called only if there is a layer with such limits.
std::vector<std::string> unfound_area_warnings(
    const Heightfield& grid, const SeabedOptions& options,
    const std::function<refine::HeightTiles::Heights()>& make_bed);

/// Warns of each layer on a material that neither the bed, which is of `material`, nor an earlier
/// layer has.
std::vector<std::string> nowhere_on_warnings(const SeabedOptions& options,
                                             const std::string& material);

/// All kinds that lay_seabed() can make of any bed: the seafloor's own first. Throws
/// std::invalid_argument for more than 256.
std::vector<SeabedMap::Kind> possible_kinds(const SeabedOptions& options,
                                            const std::string& material);

/// A bed with its layers, made in windows: heights and kinds are those that lay_seabed() gives the
/// whole bed, with three exceptions: a share of an area is right on average only, roughness has
/// other heights of the same statistics, and features have no numbers. Kinds are indices into
/// possible_kinds(). Only the size of the grid and its origin are used. The heights throw as
/// lay_seabed() does.
refine::HeightTiles::Heights with_seabed(const Heightfield& grid, refine::HeightTiles::Heights bed,
                                         const SeabedOptions& options, const std::string& material,
                                         std::uint64_t seed);

}  // namespace ensonify::engine
