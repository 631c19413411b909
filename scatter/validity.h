#pragma once

namespace ensonify::scatter {

/// The range of frequencies that TR 9407 is validated for.
constexpr double lowest_valid_hz = 10e3, highest_valid_hz = 100e3;

/// Up to here TR 9407 was compared with the small-slope approximation: expected_spread_db().
constexpr double highest_compared_hz = 1e6;

}  // namespace ensonify::scatter
