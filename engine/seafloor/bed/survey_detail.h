#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Relief finer than a survey's cells.
struct SurveyDetail {
  double cell_m = 0.0;  ///< spacing of the finer grid, rounded to cell / n; 0: no detail
  std::optional<double>
      height_at_1m_m;           ///< rms height difference at 1 m; unset: estimated from the survey
  std::optional<double> hurst;  ///< unset: estimated from the survey
};

/// Rms height difference at 1 m and Hurst exponent, as FractalRelief has them.
struct FractalScale {
  double height_at_1m_m = 0.0;
  double hurst = 0.5;
};

/// Estimates these from a survey, or from parts of it, at its finest scales: from the second
/// differences of its heights over 1, 2 and 4 cells. They do not depend on the slope; their mean
/// square over a distance d is height^2 d^2H (4 - 2^2H). H is limited to 0.05 to 0.95.
FractalScale fractal_scale(std::span<const Heightfield> parts);

/// The size of the finer grid. Throws std::invalid_argument for a cell that is not finer than the
/// survey's.
Heightfield grid_with_detail(const Heightfield& survey, const SurveyDetail& detail);

/// The survey on a finer grid: its heights, smoothly interpolated, plus fractal relief that adds
/// the power which the interpolated heights lack. Holes stay holes. Throws std::invalid_argument
/// for a cell that is not finer than the survey's or makes more than 2^28 points.
Heightfield with_detail(const Heightfield& survey, const SurveyDetail& detail, std::uint64_t seed,
                        const WorkControl& control = {});

}  // namespace ensonify::engine
