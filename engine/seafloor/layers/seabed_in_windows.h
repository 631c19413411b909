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

/// The error that states why the layers cannot be laid on windows of a grid; nullopt if they can.
std::optional<SceneError> obstacle_to_windows(const Heightfield& grid,
                                              const SeabedOptions& options);

/// Throws the error of obstacle_to_windows(), SceneError for an area outside the grid, and what
/// lay_seabed() throws for the options.
void require_windows(const Heightfield& grid, const SeabedOptions& options);

/// Warnings about layers whose limits of depth and slope no place in a sample of the base meets.
/// `make_bed` is called only if there is a layer with these limits.
std::vector<std::string> unfound_area_warnings(
    const Heightfield& grid, const SeabedOptions& options,
    const std::function<refine::HeightTiles::Heights()>& make_bed);

/// Warnings, one per layer whose key `on` names a material that neither the base, which is of
/// `material`, nor an earlier layer has.
std::vector<std::string> nowhere_on_warnings(const SeabedOptions& options,
                                             const std::string& material);

/// All kinds that lay_seabed() can make of a bed of `material`; the first is the kind of the base.
/// Throws std::invalid_argument for more than 256 kinds.
std::vector<SeabedMap::Kind> possible_kinds(const SeabedOptions& options,
                                            const std::string& material);

/// A bed with its layers, made in windows. Heights and kinds are those that lay_seabed() makes for
/// the whole bed, with three exceptions: the share of the ground that an area covers is right only
/// on average, roughness has other heights with the same statistics, and features have no numbers.
/// Kinds are indices into possible_kinds(). Only the size of the grid and its origin are used. The
/// returned function throws what lay_seabed() throws.
refine::HeightTiles::Heights with_seabed(const Heightfield& grid, refine::HeightTiles::Heights bed,
                                         const SeabedOptions& options, const std::string& material,
                                         std::uint64_t seed);

}  // namespace ensonify::engine
