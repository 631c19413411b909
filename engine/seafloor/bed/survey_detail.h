#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Relief finer than a survey's cells.
struct SurveyDetail {
  double cell_m = 0.0;  ///< spacing of the finer grid, rounded to survey cell / n; 0: no detail
  std::optional<double>
      height_at_1m_m;           ///< rms height difference at 1 m; unset: estimated from the survey
  std::optional<double> hurst;  ///< unset: estimated from the survey
};

/// Rms height difference at 1 m and Hurst exponent, as in FractalRelief.
struct FractalScale {
  double height_at_1m_m = 0.0;
  double hurst = 0.5;
};

/// Estimates a FractalScale from a survey, or from parts of a survey, at the finest scales: from
/// the second differences of heights over 1, 2 and 4 cells. Second differences do not depend on the
/// slope. Their mean square over a distance d is height^2 d^2H (4 - 2^2H). H is limited to 0.05 to
/// 0.95.
FractalScale fractal_scale(std::span<const Heightfield> parts);

/// The finer grid, without heights. Throws std::invalid_argument if its cells are not finer.
Heightfield grid_with_detail(const Heightfield& survey, const SurveyDetail& detail);

/// The survey on a finer grid: its heights, smoothly interpolated, plus fractal relief with the
/// power that the interpolated heights lack. Holes stay holes. Throws std::invalid_argument for a
/// cell that is not finer than the survey's cells or makes more than 2^28 points.
Heightfield with_detail(const Heightfield& survey, const SurveyDetail& detail, std::uint64_t seed,
                        const WorkControl& control = {});

}  // namespace ensonify::engine
