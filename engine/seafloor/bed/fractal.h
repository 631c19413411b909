#pragma once

#include <cstdint>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// The power spectrum of the synthesis: a 2-D spectrum over wavenumber k.
enum class FractalSpectrum {
  variogram,  ///< |k|^-(2H+2): the variogram is eq. 1 of the paper
  paper,      ///< |k|^-(4H+2): eqs 2-3 of the paper, to reproduce its figures; smoother
};

/// Relief whose mean squared height difference over a distance d is height_at_1m^2 d^(2H) (eq. 1 of
/// Riordan, Toal and others), without the waves that a grid cannot hold: waves shorter than two
/// cells or longer than twice the grid's longer side (four times for H > 0.7). Therefore the mean
/// squared difference is smaller than in eq. 1. For H from 0.5 to 0.7 it is smaller by 3 to 15 %
/// from two cells to a sixteenth of the longer side, by 16 to 31 % at one cell, by 6 to 21 % at an
/// eighth of the side and by 25 to 47 % at half of the side. For H = 0.2 it is smaller by 64 % at
/// one cell and by 28 % at eight cells. For H = 0.9 it is smaller by 27 to 50 % up to a sixteenth
/// of the side.
struct FractalRelief {
  double height_at_1m_m = 0.06;  ///< rms height difference of points 1 m apart; 0: none
  double hurst = 0.7;            ///< H in (0, 1): small is jagged, large is rolling
  FractalSpectrum spectrum = FractalSpectrum::variogram;
  double longest_m = 0.0;      ///< the spectrum is constant for waves longer than this; 0: no limit
  bool sediments_own = false;  ///< use the relief that the material's roughness parameters describe
};

/// Adds fractal relief to a heightfield by spectral synthesis: white noise is filtered by
/// |k|^-(H+1) over a square whose side is at least twice the field's longer side (four times for H
/// > 0.7). The relief is a part of this square, so opposite borders do not match. The mean of the
/// relief is zero. The spectrum `paper` is scaled to the same height difference at 1 m. Needs 8
/// bytes per point of the square. Throws std::invalid_argument for H outside (0, 1), or a negative
/// height or length.
void add_fractal(Heightfield& field, const FractalRelief& relief, std::uint64_t seed,
                 const WorkControl& control = {});
/// As the function above, with the random stream of a layer instead of a seed.
void add_fractal(Heightfield& field, const FractalRelief& relief, const RandomStream& noise,
                 const WorkControl& control = {});

}  // namespace ensonify::engine
