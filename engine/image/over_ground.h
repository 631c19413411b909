#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/waterfall.h>

namespace ensonify::engine {

/// The sonar's height above the bed, as if the bed were level below it: from the ping's record, or
/// else the slant range of the first echo.
double height_over_bed_m(const Waterfall& waterfall, std::size_t row);

/// For each column of a row in ground range, the column in slant range that it shows; -1 beyond the
/// sonar's range.
std::vector<std::ptrdiff_t> columns_over_ground(const Waterfall& waterfall, std::size_t row);

/// A picture of a waterfall, column by column of slant range, with its columns equally spaced in
/// ground range, as Display::slant_range_correction makes it: without the water column, and black
/// beyond the sonar's range. Throws std::invalid_argument if its size is not the waterfall's.
Picture over_ground(const Waterfall& waterfall, const Picture& picture);

/// The layers of a waterfall that find_targets() reads, in the same way, 0 beyond the sonar's
/// range; the others are empty.
Waterfall truth_over_ground(const Waterfall& waterfall);

}  // namespace ensonify::engine
