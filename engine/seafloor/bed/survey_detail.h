#pragma once

#include <cstdint>
#include <optional>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Relief below a survey's cell.
struct SurveyDetail {
  double cell_m = 0.0;  ///< the finer grid's spacing, rounded to a whole part of the cell; 0: none
  std::optional<double> height_at_1m_m;  ///< rms height difference at 1 m; unset: the survey's own
  std::optional<double> hurst;           ///< unset: the survey's own
};

/// Rms height difference at 1 m and Hurst exponent, as FractalRelief has them.
struct FractalScale {
  double height_at_1m_m = 0.0;
  double hurst = 0.5;
};

/// What a survey's finest scales tell of it: by its second differences over 1, 2 and 4 cells,
/// whose mean square is height^2 d^2H (4 - 2^2H) over a distance d and to which slopes are
/// nothing. H stays within 0.05 to 0.95.
FractalScale fractal_scale(const Heightfield& survey);

/// The survey on a finer grid: its heights, smoothly interpolated, and fractal relief that begins
/// where the spectrum of what was interpolated ends. Holes stay holes. Throws
/// std::invalid_argument for a cell that is not finer than the survey's or makes more than 2^28
/// points.
Heightfield with_detail(const Heightfield& survey, const SurveyDetail& detail, std::uint64_t seed);

}  // namespace ensonify::engine
