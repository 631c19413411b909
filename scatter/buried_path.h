#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// The way of sound from water into a level bed, by Snell's law: cos(g_s) = nu cos(g_w). By
/// Fermat's principle it is the quickest one.
struct BuriedPath {
  double water_m = 0.0, sediment_m = 0.0;         ///< lengths of its two parts
  double cos_water = 0.0, sin_water = 0.0;        ///< of the grazing angle at the bed, in water
  double cos_sediment = 0.0, sin_sediment = 0.0;  ///< the same in the sediment
  /// The geometric mean of the spreading of both ways, as for SoundRay in two layers with the
  /// speeds 1 and nu: sin g_w sin g_s A B / nu with A = h / sin g_w + nu d / sin g_s and B = h /
  /// sin^3 g_w + nu d / sin^3 g_s. In one medium it is the path squared.
  double spreading_m2 = 0.0;
};

/// From `height_m` above the bed to `depth_m` below it, `along_m` apart along the bed; height and
/// depth are positive. sound_speed_ratio: nu, the sediment's over the water's.
BuriedPath buried_path(double height_m, double depth_m, double along_m, double sound_speed_ratio);

/// 4 k delta / nu, nepers of energy per metre for sound that goes out and back: the sediment's
/// wavenumber is k (1 + i delta) / nu (TR 9407 eq. 31). wavelength_m: in water.
double two_way_attenuation_per_m(const Sediment& sediment, double wavelength_m);

/// What is left of the energy that goes this way and back: (1 - |R|^2)^2 at the bed, with
/// Rayleigh's reflection coefficient (reflection.h), and the attenuation over the path in the
/// sediment.
double buried_gain(const BuriedPath& path, const Sediment& sediment, double wavelength_m);

}  // namespace ensonify::scatter
