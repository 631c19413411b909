#pragma once

#include <cstddef>
#include <limits>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::scatter {

/// Where a ray of sound has come to, counted from its source.
struct SoundRayPoint {
  double range_m = 0.0;  ///< horizontal
  double depth_m = 0.0;
  double time_s = 0.0;
  double path_m = 0.0;  ///< along the ray
  double along = 1.0;   ///< its unit direction: the cosine, never negative,
  double down = 0.0;    ///< and the sine of its angle below the horizontal
  double sound_speed_mps = 1500.0;
  double absorption_db = 0.0;  ///< along the ray, where the profile has absorption
};

/// A ray of sound on its way through a profile. In a layer of constant gradient g it is an arc of a
/// circle of curvature g cos(angle) / c, where by Snell's law cos(angle) / c is the same all along
/// the ray; range, time and path of an arc are closed forms (Cervený, Seismic Ray Theory,
/// 2001, 3.7.2), here written so that they hold for any gradient, none included. Moved on by
/// advance().
class SoundRay {
 public:
  /// From a depth, towards `down` (the sine of the angle below the horizontal) and `along` (its
  /// cosine, not negative). It is reflected at `surface_m` and `bottom_m`, between which the source
  /// must lie. The profile must outlive the ray. Throws std::invalid_argument for a source outside
  /// and for a direction that is not unit.
  SoundRay(const SoundSpeedProfile& profile, double depth_m, double along, double down,
           double surface_m = -std::numeric_limits<double>::infinity(),
           double bottom_m = std::numeric_limits<double>::infinity());

  const SoundRayPoint& point() const { return point_; }

  /// Of the arc that it is on; positive where it turns upwards.
  double curvature_per_m() const { return snell_s_per_m_ * gradient_per_s_; }
  /// What remains of that arc, to the layer's edge, the surface or the bottom; infinite if all
  /// does.
  double path_to_edge_m() const { return exit_.path_m; }
  /// Path to a range ahead; infinite if the arc ends before.
  double path_to_range_m(double range_m) const;

  /// Along the arc, no farther than its end; there it enters the next layer, or is reflected. Less
  /// than 0 goes back along the same arc, to look at what is no more than a little behind.
  void advance(double path_m);

  int reflections() const { return reflections_; }

  /// What a solid angle of 1 sr at the source has spread to, across the ray: J = r q / cos(launch
  /// angle), where q is the distance between neighbouring rays of one azimuth for each radian
  /// between their launch angles; the path squared in water of one speed. At a caustic q is 0 and
  /// ray theory ends: J is held to a hundredth of the path squared, 20 dB, about what diffraction
  /// leaves there.
  double spreading_m2() const;
  /// The same of the way back: what 1 sr here has spread to at the source. J / c^2 of where it
  /// comes from is the same both ways (reciprocity), so it is J (c_source / c)^2.
  double spreading_back_m2() const;
  /// q, not held back.
  double spread_m() const { return spread_m_; }
  /// r / cos(launch angle), finite for vertical rays, too.
  double sideways_m() const { return swept_m2_per_s_ / source_mps_; }
  /// 10 log10(J c_source / c): of the pressure's amplitude, re 1 m; 0 at the source itself.
  double loss_db() const;

 private:
  struct Exit {
    double path_m;
    double depth_m;
    double down;
    double range_m;  // all it gains
  };
  void enter(std::size_t layer);
  void cross();
  void settle_level();
  Exit find_exit() const;
  double arc_m(double chord_m) const;
  void move(double chord_m, double path_m, double range_m, double depth_m, double along,
            double down);

  const SoundSpeedProfile* profile_;
  double surface_m_, bottom_m_;
  SoundRayPoint point_;
  double source_mps_;
  double snell_s_per_m_;  // cos / c
  std::size_t layer_ = 0;
  double top_m_ = 0.0, lower_m_ = 0.0;  // of the layer, between surface and bottom
  double gradient_per_s_ = 0.0;
  Exit exit_{};
  int reflections_ = 0;
  double swept_m2_per_s_ = 0.0;  // the integral of c along the ray, which is range / snell
  double spread_m_ = 0.0;        // q: dq = c p ds,
  double spread_rate_s_per_m_;   // p, which changes where the gradient does
};

}  // namespace ensonify::scatter
