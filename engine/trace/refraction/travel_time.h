#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// Straight rays in a layered sea: they hit what they hit in water of one speed, but their echoes
/// come after the time that sound takes along the straight line at the profile's speeds. The
/// quickest way is bent, and quicker only by the second order of the bend (Fermat). The spreading
/// of a straight ray is the square of its length. The true value is the geometric mean of the
/// spreading of both ways. In water of constant gradient this mean is c_1 c_2 sinh^2(g t) / g^2,
/// which equals the square up to the second order. In other water the level of straight rays is
/// wrong: to the first order, the mean is 1 - ((c_1 + c_2) / c - 2) / sin^2(grazing) times the
/// square, where c is the mean speed along the line and `grazing` is the line's grazing angle.
class TravelTime final : public IncidenceSource {
 public:
  /// The profile must outlive this.
  TravelTime(const scatter::SoundSpeedProfile& profile, double reference_mps);
  /// Sets the t of straight hits, by ray number, to travel time times the reference speed; removes
  /// those beyond the fan's range. The fan must stay until the last incidence_of().
  void apply(const RayFan& fan, std::span<Hit> hits);
  RayIncidence incidence_of(std::size_t number, Hit& hit) override;
  std::optional<RayToPlace> ray_to(const Eigen::Vector3d& origin,
                                   const Eigen::Vector3d& away) const override;

 private:
  struct Depth {
    double time_s;     // straight down to it from the surface
    double speed_mps;  // of sound there
  };
  Depth at(double depth_m) const;

  const scatter::SoundSpeedProfile* profile_;
  double reference_mps_;
  std::vector<double> layer_top_s_;  // by layer: the time straight down to its top
  const RayFan* fan_ = nullptr;
  std::vector<double> straight_m_;  // by ray number: the length of the straight line
};

}  // namespace ensonify::engine
