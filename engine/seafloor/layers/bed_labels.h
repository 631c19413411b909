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

/// The index of a name in a list. A new name is appended. Index 0 is reserved and never returned,
/// not even for the name "none".
std::uint16_t number_in(std::vector<std::string>& names, const std::string& name);

/// A label of this material and class. Names that the seafloor does not have are added to it.
Label make_label(const std::string& material, const std::string& class_name, Seafloor& seafloor);

/// Labels the faces of a bed, where `grid` has the heights of `field`. A face gets the label that
/// most of its corners have on the map. The instance numbers of features follow the numbers of the
/// `objects` objects. If a layer has more features than numbers are left, its features get no
/// numbers, and a warning reports this. Throws std::invalid_argument for more than max_labels.
void label_bed(const Heightfield& field, const refine::HeightGrid& grid, const SeabedMap& map,
               std::size_t objects, Seafloor& seafloor);

}  // namespace ensonify::engine
