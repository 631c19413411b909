#pragma once

#include <cstdint>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Which power spectrum the synthesis uses (physics: 2-D spectra over wavenumber k).
enum class FractalSpectrum {
  variogram,  ///< |k|^-(2H+2): its variogram is the paper's eq. 1
  paper,      ///< |k|^-(4H+2): exactly the paper's eqs 2-3, to reproduce its figures; smoother
};

/// Relief whose mean squared height difference over a distance d is height_at_1m^2 d^(2H) (eq. 1 of
/// Riordan, Toal and others), minus what a grid cannot hold: waves shorter than two cells and
/// longer than twice its side (four times for H > 0.7). For H from 0.5 to 0.7 it is 3 to 15 %
/// smaller from two cells to a sixteenth of the longer side, 16 to 31 % at one cell, 6 to 21 % at
/// an eighth of the side and 25 to 47 % at half of it. For H = 0.2 it is 64 % smaller at one cell
/// and 28 % at eight cells; for H = 0.9 it is 27 to 50 % smaller up to a sixteenth of the side.
struct FractalRelief {
  double height_at_1m_m = 0.06;  ///< rms height difference of points 1 m apart; 0: none
  double hurst = 0.7;            ///< H in (0, 1): small is jagged, large is rolling
  FractalSpectrum spectrum = FractalSpectrum::variogram;
  double longest_m = 0.0;      ///< the spectrum is level for waves longer than this; 0: no limit
  bool sediments_own = false;  ///< use the relief that the material's roughness parameters describe
};

/// Adds such relief to a heightfield by spectral synthesis: white noise, filtered by |k|^-(H+1)
/// over a square at least twice as long as the field's longer side (four times for H > 0.7). The
/// relief is a part of that square, so opposite borders do not match; its mean is zero. The
/// spectrum `paper` is scaled to the same height difference at 1 m. Needs 8 bytes per point of the
/// square. Throws std::invalid_argument for H outside (0, 1), or a negative height or length.
void add_fractal(Heightfield& field, const FractalRelief& relief, std::uint64_t seed,
                 const WorkControl& control = {});
/// The same, with the random stream of a layer.
void add_fractal(Heightfield& field, const FractalRelief& relief, const RandomStream& noise,
                 const WorkControl& control = {});

}  // namespace ensonify::engine
