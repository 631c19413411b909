#pragma once

#include <ensonify/scatter/angle.h>

namespace ensonify::engine {

using scatter::degree;
inline constexpr double knot_mps = 1852.0 / 3600.0;  ///< a nautical mile per hour

}  // namespace ensonify::engine
