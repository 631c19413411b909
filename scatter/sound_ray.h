#pragma once

#include <cstddef>
#include <limits>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::scatter {

/// A point on a ray of sound. Range, time, path and absorption count from the ray's source.
struct SoundRayPoint {
  double range_m = 0.0;  ///< horizontal
  double depth_m = 0.0;
  double time_s = 0.0;
  double path_m = 0.0;  ///< along the ray
  // Its unit direction: cosine (never negative) and sine of the ray's angle below the horizontal.
  double along = 1.0;
  double down = 0.0;
  double sound_speed_mps = 0.0;
  double absorption_db = 0.0;  ///< along the ray, if the profile has absorption
};

/// A ray of sound that moves through a profile, by advance(). In a layer of constant gradient g it
/// is an arc of a circle of curvature g cos(angle) / c. By Snell's law cos(angle) / c is constant
/// along the ray. Range, time and path of an arc have closed forms (Cervený, Seismic Ray Theory,
/// 2001, 3.7.2). Here they are written so that they hold for any gradient, also for 0.
class SoundRay {
 public:
  /// Starts at a depth, in the direction whose components are `along` (the cosine of the angle
  /// below the horizontal, not negative) and `down` (its sine). The ray is reflected at `surface_m`
  /// and `bottom_m`; the source must be between them. The profile must outlive the ray. Throws
  /// std::invalid_argument if the source is not between them, or if the direction is not a unit
  /// vector.
  SoundRay(const SoundSpeedProfile& profile, double depth_m, double along, double down,
           double surface_m = -std::numeric_limits<double>::infinity(),
           double bottom_m = std::numeric_limits<double>::infinity());

  const SoundRayPoint& point() const { return point_; }

  /// The curvature of the present arc; positive if the ray turns upwards.
  double curvature_per_m() const { return snell_s_per_m_ * gradient_per_s_; }
  /// The path along the rest of the present arc, to the layer's edge, the surface or the bottom;
  /// infinite if the arc meets none of them.
  double path_to_edge_m() const { return exit_.path_m; }
  /// The path along the arc to a range ahead; infinite if the arc ends before.
  double path_to_range_m(double range_m) const;

  /// Moves the point along the arc, at most to the arc's end, where the ray enters the next layer
  /// or is reflected. A negative path moves it back along the arc; use this only for small steps.
  void advance(double path_m);

  int reflections() const { return reflections_; }

  /// J, the area across the ray that a solid angle of 1 sr at the source has spread to. J = r q /
  /// cos(launch angle), where r is the range and q the distance between two neighbouring rays of
  /// one azimuth per radian between their launch angles. In water of one speed, J is the squared
  /// path. At a caustic q is 0 and ray theory fails. So J is at least a hundredth of the squared
  /// path, which limits the gain to 20 dB, about what diffraction gives there.
  double spreading_m2() const;
  /// The spreading from this point back to the source: the area at the source of 1 sr at this
  /// point. By reciprocity, J c^2 is the same for both directions, where c is the sound speed at
  /// the start of each. So the spreading back is J (c_source / c)^2.
  double spreading_back_m2() const;
  /// q, without the limit of spreading_m2().
  double spread_m() const { return spread_m_; }
  /// The growth of q per metre of path: the angle between those rays per radian at their launch.
  double spread_rate() const { return spread_rate_s_per_m_ * point_.sound_speed_mps; }
  /// r / cos(launch angle), also finite for vertical rays.
  double sideways_m() const { return swept_m2_per_s_ / source_mps_; }
  /// 10 log10(J c_source / c): the loss of pressure amplitude, re 1 m; 0 at the source.
  double loss_db() const;

 private:
  struct Exit {
    double path_m;
    double depth_m;
    double down;
    double range_m;  // range gained up to the exit
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
  double top_m_ = 0.0, lower_m_ = 0.0;  // of the layer, clipped to surface and bottom
  double gradient_per_s_ = 0.0;
  Exit exit_{};
  int reflections_ = 0;
  double swept_m2_per_s_ = 0.0;  // the integral of c along the ray; it equals range / snell
  double spread_m_ = 0.0;        // q: dq = c p ds
  double spread_rate_s_per_m_;   // p, which changes where the gradient changes
};

}  // namespace ensonify::scatter
