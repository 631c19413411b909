#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/seabed.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {

/// The index of a name in a list; a new name is appended. Index 0 is reserved and never returned,
/// even for the name "none".
std::uint16_t number_in(std::vector<std::string>& names, const std::string& name);

/// A label of this material and class, whose names the seafloor gets if it lacks them.
Label make_label(const std::string& material, const std::string& class_name, Seafloor& seafloor);

/// Labels the faces of a bed, the grid over these heights: a face gets the label that most of its
/// corners have on the map. The map's features get the instance numbers that follow those of the
/// objects, of which there are `objects`; a layer with more features than numbers are left gets
/// none, and a warning reports it. Throws std::invalid_argument for a map of more labels than there
/// are numbers.
void label_bed(const Heightfield& field, const refine::HeightGrid& grid, const SeabedMap& map,
               std::size_t objects, Seafloor& seafloor);

}  // namespace ensonify::engine
