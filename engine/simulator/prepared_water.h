#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/echo/echo_former.h>

namespace ensonify::engine {

/// The water over a scene's seafloor. All sonars of the scene share it.
class PreparedWater {
 public:
  /// `mean_bed_m` is the mean height of the bed, `lowest_m` the height of the seafloor's lowest
  /// vertex. Reads the scene's cast, if there is one; throws as read_profile().
  PreparedWater(const Sea& sea, double mean_bed_m, double lowest_m);

  /// Converts time to range.
  double sound_speed_mps() const { return sound_speed_mps_; }
  /// The sound speed of the water at the mean bed, with which the bed's backscatter is computed.
  double bed_sound_speed_mps() const {
    return cast_ ? cast_->speed_mps(bed_depth_m_) : sound_speed_mps_;
  }
  /// The cast, with absorption at this frequency; none if the scene has no cast.
  std::optional<scatter::SoundSpeedProfile> profile(double frequency_hz) const;
  /// The medium of a sonar at an altitude. `profile` is profile(frequency_hz), or null; it must
  /// outlive the medium, which may refer to it.
  Medium medium(double frequency_hz, double altitude_m,
                const scatter::SoundSpeedProfile* profile) const;
  /// Warnings about the cast: speeds that sea water does not have.
  std::span<const std::string> warnings() const { return warnings_; }

 private:
  void warn_of_odd_speeds();

  Sea sea_;
  double bed_depth_m_;
  double sound_speed_mps_;
  std::optional<scatter::SoundSpeedProfile> cast_;
  std::vector<std::string> warnings_;
};

}  // namespace ensonify::engine
