#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// A sonar as its rays see it: the fan's grid, and what of the beam does not change from ping to
/// ping.
///
/// A ray stands for a cell of azimuth about its plane, over which the beam is integrated: two Gauss
/// points in parts of half a null's width, and of more where only the near field is that wide.
struct RayLayout {
  /// Rays [from, until) of a plane are within the beam.
  struct Stretch {
    std::size_t from, until;
  };
  std::shared_ptr<const FanGrid> grid;
  std::vector<BeamSample> samples;           ///< plane by plane
  std::vector<std::size_t> first_sample;     ///< of each plane, and their end
  std::vector<std::vector<Stretch>> within;  ///< by plane
  std::uint64_t rays = 0;                    ///< within the beam, in all
  std::vector<double> edge_rad;  ///< halfway from each elevation to the one before it; the last
                                 ///< one itself
  std::vector<double> cosines, sines;  ///< of the elevations, and of those halfway, in turns
  std::vector<std::uint8_t>
      longest;  ///< how many rays from each on can count as one where all hit one face

  std::span<const BeamSample> samples_of(std::size_t plane) const {
    return std::span(samples).subspan(first_sample[plane],
                                      first_sample[plane + 1] - first_sample[plane]);
  }
};

/// The aperture for flying so high that range_over_height is the sonar's range over its altitude,
/// and for leaning so: its rays are laid for what they will meet, and mean the same wherever they
/// lie.
RayLayout make_aperture(const Sonar& sonar, double wavelength_m, double range_over_height,
                        double lean_rad = 0.0);

/// How much lower than level a side looks at a pose, because of roll.
double lean_rad(const Pose& pose, Side side);

/// Rays end a little beyond the last bin, so that the pulse finds its energy there too.
double trace_range_m(const Sonar& sonar, double sound_speed_mps);

/// The fan of one side at a pose, from the place nearest to it that floats can tell
/// (nearest_floats.h).
RayFan place_fan(const RayLayout& aperture, const Pose& pose, Side side, double range_m);

/// A sonar's apertures over altitude, made as they are needed: altitudes within a step of 19 % and
/// leans within half a degree share one, so that a steady ping makes none.
class Apertures {
 public:
  Apertures(const Sonar& sonar, double wavelength_m) : sonar_(sonar), wavelength_m_(wavelength_m) {}
  const RayLayout& at(double altitude_m, double lean_rad);

 private:
  Sonar sonar_;
  double wavelength_m_;
  std::map<std::pair<int, int>, RayLayout> made_;  ///< by steps of altitude and lean
};

}  // namespace ensonify::engine
