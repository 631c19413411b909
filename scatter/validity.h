#pragma once

namespace ensonify::scatter {

/// The range of frequencies that TR 9407 is validated for.
constexpr double lowest_valid_hz = 10e3, highest_valid_hz = 100e3;

}  // namespace ensonify::scatter
