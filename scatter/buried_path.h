#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// The path of sound from a point in the water to a point in a level bed, by Snell's law: cos(g_s)
/// = nu cos(g_w). By Fermat's principle it is the quickest path.
struct BuriedPath {
  double water_m = 0.0, sediment_m = 0.0;         ///< lengths of the path's two parts
  double cos_water = 0.0, sin_water = 0.0;        ///< of the grazing angle at the bed, in water
  double cos_sediment = 0.0, sin_sediment = 0.0;  ///< of the grazing angle in the sediment
  /// The geometric mean of the spreading downwards and of the spreading back (SoundRay), in two
  /// layers with the speeds 1 and nu: sin g_w sin g_s A B / nu with A = h / sin g_w + nu d / sin
  /// g_s and B = h / sin^3 g_w + nu d / sin^3 g_s. h is the height and d the depth. In a single
  /// medium it is the squared length of the path.
  double spreading_m2 = 0.0;
};

/// The path from a point `height_m` above the bed to a point `depth_m` below the bed, `along_m`
/// apart along the bed. Height and depth are positive. sound_speed_ratio: nu, the sound speed in
/// the sediment divided by that in the water.
BuriedPath buried_path(double height_m, double depth_m, double along_m, double sound_speed_ratio);

/// The attenuation in the sediment for sound that goes out and back, in nepers of energy per metre
/// of the one-way path: 4 k delta / nu, because the sediment's wavenumber is k (1 + i delta) / nu
/// (TR 9407 eq. 31). wavelength_m: in water.
double two_way_attenuation_per_m(const Sediment& sediment, double wavelength_m);

/// The part of the energy that is left after the path down and back: (1 - |R|^2)^2 for crossing the
/// bed twice, with Rayleigh's R (reflection.h), times the attenuation in the sediment.
double buried_gain(const BuriedPath& path, const Sediment& sediment, double wavelength_m);

}  // namespace ensonify::scatter
