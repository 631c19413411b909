#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/seabed.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// The index of a name in a list; a new name is appended. Index 0 is reserved and never returned,
/// even for the name "none".
std::uint16_t number_in(std::vector<std::string>& names, const std::string& name);

/// Labels the faces of a bed, which is the field's tessellation: each as most of its corners are on
/// the map. The map's features get the instance numbers behind those of so many objects; a layer of
/// more features than there are numbers left has none, and a warning says so. Throws
/// std::invalid_argument for a map of more labels than there are numbers.
void label_bed(const Heightfield& field, const SeabedMap& map, std::size_t objects,
               Seafloor& seafloor);

}  // namespace ensonify::engine
