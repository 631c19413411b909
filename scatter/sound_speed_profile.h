#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace ensonify::scatter {

/// A measured sound speed; depth counts down from the surface.
struct SoundSpeedSample {
  double depth_m = 0.0;
  double sound_speed_mps = 0.0;
  double absorption_db_per_m = 0.0;  ///< at one frequency, if known
};

/// Throws std::invalid_argument unless the depth is within 0..12000 m and the speed within
/// 1000..2000 m/s.
void check_sound_speed_sample(const SoundSpeedSample& sample);

/// A layer in which sound speed is linear in depth: c = speed at the top + gradient (depth - top);
/// and so is absorption.
struct SoundSpeedLayer {
  double top_m, bottom_m;  ///< -inf and inf at the profile's ends
  double top_mps, bottom_mps;
  double gradient_per_s;  ///< 0 if the top or the bottom is infinite
  double top_db_per_m = 0.0;
  double db_per_m2 = 0.0;  ///< growth of absorption with depth; 0 wherever gradient_per_s must be 0

  double absorption_db_per_m(double depth_m) const {
    return db_per_m2 == 0.0 ? top_db_per_m : top_db_per_m + db_per_m2 * (depth_m - top_m);
  }
};

/// Sound speed over depth, linear between samples, without jumps; constant above the first and
/// below the last sample. A bed below the cast is common, and a cast's last gradient does not
/// predict the water below; the same water would gain 1.6 m/s per 100 m from its pressure alone,
/// less than the uncertainty. remarks() informs the user. Absorption is treated in the same way.
class SoundSpeedProfile {
 public:
  /// Takes samples in any order, at least one. Samples within a millimetre below another are merged
  /// with it: the mean speed at the upper depth. Throws std::invalid_argument as
  /// check_sound_speed_sample does.
  explicit SoundSpeedProfile(std::vector<SoundSpeedSample> samples);

  double speed_mps(double depth_m) const;

  /// The same speeds with an absorption (dB/m) that follows from depth and speed: at the samples
  /// exactly, between them within 0.1 %. Where it is not linear between two, samples are added.
  SoundSpeedProfile with_absorption(
      const std::function<double(double depth_m, double sound_speed_mps)>& db_per_m) const;
  /// The mean absorption between two depths, in either order; it holds for any straight line
  /// between them. If they are equal, the absorption there.
  double mean_absorption_db_per_m(double from_m, double to_m) const;

  /// The harmonic mean speed between two depths, in either order: distance over travel time
  /// straight down. If they are equal, the speed there. Throws std::invalid_argument unless both
  /// are finite.
  double mean_speed_mps(double from_m, double to_m) const;

  /// From the surface down: constant above the first sample, one layer between each two, constant
  /// below the last. A depth at a layer's edge belongs to the layer below.
  const std::vector<SoundSpeedLayer>& layers() const { return layers_; }
  std::size_t layer_index(double depth_m) const;

  double shallowest_m() const { return layers_.front().bottom_m; }
  double deepest_m() const { return layers_.back().top_m; }

  /// Remarks for a user who needs the profile from upper_m down to lower_m, one sentence each: that
  /// it starts below or ends above them, that it is a single sample, that the samples had to be
  /// sorted, that samples at one depth differ by more than 2 m/s.
  std::vector<std::string> remarks(double upper_m, double lower_m) const;

 private:
  double absorbed_db(double depth_m) const;
  /// Samples at one depth, and their greatest difference.
  struct Spread {
    double depth_m = 0.0, spread_mps = 0.0;
  };
  bool sorted_;  // the given samples were in order of depth
  Spread widest_;
  std::vector<SoundSpeedLayer> layers_;
  std::vector<double> absorbed_db_;  // straight down from the first sample to each layer's top
};

}  // namespace ensonify::scatter
