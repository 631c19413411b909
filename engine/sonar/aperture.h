#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <ensonify/engine/sonar/beam.h>
#include <ensonify/engine/sonar/sonar.h>
#include <ensonify/engine/sonar/track.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// A sonar as its rays see it: the fan's grid, and what of the beam does not change from ping to ping.
///
/// A ray stands for a cell of azimuth about its plane, over which the beam is integrated: two Gauss
/// points in parts of half a null's width, and of more where only the near field is that wide.
struct Aperture {
  std::shared_ptr<const FanGrid> grid;
  std::vector<BeamSample> samples;        ///< plane by plane
  std::vector<std::size_t> first_sample;  ///< of each plane, and their end
  /// By side, then ray number; 0 outside the beam: the vertical pattern's one-way power ...
  std::array<std::vector<float>, 2> vertical;
  /// ... and for a focused array that does not move, which is the same at all ranges, the two-way beam
  /// pattern times the solid angle per radian of elevation, b_t b_r cos(e) dphi.
  std::array<std::vector<float>, 2> weight;

  std::span<const BeamSample> samples_of(std::size_t plane) const {
    return std::span(samples).subspan(first_sample[plane],
                                      first_sample[plane + 1] - first_sample[plane]);
  }
};

/// The aperture for flying so high that range_over_height is the sonar's range over its altitude, and
/// for leaning so: its rays are laid for what they will meet, and mean the same wherever they lie.
Aperture make_aperture(const Sonar& sonar, double wavelength_m, double range_over_height,
                       double lean_rad = 0.0);

/// How much lower than level a side looks at a pose, because of roll.
double lean_rad(const Pose& pose, Side side);

/// Rays end a little beyond the last bin, so that the pulse finds its energy there too.
double trace_range_m(const Sonar& sonar, double sound_speed_mps);

/// The fan of one side at a pose.
RayFan place_fan(const Aperture& aperture, const Pose& pose, Side side, double range_m);

/// A sonar's apertures over altitude, made as they are needed: altitudes within a step of 19 % and
/// leans within half a degree share one, so that a steady ping makes none.
class Apertures {
 public:
  Apertures(const Sonar& sonar, double wavelength_m) : sonar_(sonar), wavelength_m_(wavelength_m) {}
  const Aperture& at(double altitude_m, double lean_rad);

 private:
  Sonar sonar_;
  double wavelength_m_;
  std::map<std::pair<int, int>, Aperture> made_;  ///< by steps of altitude and lean
};

}  // namespace ensonify::engine
