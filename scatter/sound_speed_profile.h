#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace ensonify::scatter {

/// A measured sound speed. Depth is positive below the surface.
struct SoundSpeedSample {
  double depth_m = 0.0;
  double sound_speed_mps = 0.0;
  double absorption_db_per_m = 0.0;  ///< at one frequency, if known
};

/// Throws std::invalid_argument unless the depth is in 0..12000 m and the speed in 1000..2000 m/s.
void check_sound_speed_sample(const SoundSpeedSample& sample);

/// A layer with sound speed and absorption linear in depth: top_mps + gradient_per_s (depth -
/// top_m).
struct SoundSpeedLayer {
  double top_m, bottom_m;  ///< -inf and inf at the profile's ends
  double top_mps, bottom_mps;
  double gradient_per_s;  ///< 0 if the top or the bottom is infinite
  double top_db_per_m = 0.0;
  double db_per_m2 = 0.0;  ///< gradient of absorption; 0 if the top or the bottom is infinite

  double absorption_db_per_m(double depth_m) const {
    return db_per_m2 == 0.0 ? top_db_per_m : top_db_per_m + db_per_m2 * (depth_m - top_m);
  }
};

/// Sound speed as a function of depth: linear between samples, without jumps, and constant above
/// the first and below the last sample. The bed is often deeper than the cast, and a cast's last
/// gradient does not predict the water below it, so the speed is constant there. If the properties
/// of that water were constant, its speed would grow by 1.6 m/s per 100 m because of the pressure,
/// which is less than the uncertainty. remarks() informs the user. Absorption is treated in the
/// same way.
class SoundSpeedProfile {
 public:
  /// Takes one or more samples in any order. Samples less than a millimetre below another sample
  /// are merged with it: the result has their mean speed and the upper depth. Throws
  /// std::invalid_argument as check_sound_speed_sample does, and if there is no sample.
  explicit SoundSpeedProfile(std::vector<SoundSpeedSample> samples);

  double speed_mps(double depth_m) const;

  /// Returns a profile with the same speeds, and with an absorption (dB/m) that `db_per_m` computes
  /// from depth and speed. The absorption is exact at the samples and within 0.1 % between them:
  /// where it is not nearly linear between two samples, samples are added.
  SoundSpeedProfile with_absorption(
      const std::function<double(double depth_m, double sound_speed_mps)>& db_per_m) const;
  /// The mean absorption between two depths, in either order, along any straight line that joins
  /// them. If the depths are equal, the absorption there.
  double mean_absorption_db_per_m(double from_m, double to_m) const;

  /// The harmonic mean speed between two depths, in either order: distance over travel time
  /// straight down. If they are equal, the speed there. Throws std::invalid_argument unless both
  /// depths are finite.
  double mean_speed_mps(double from_m, double to_m) const;

  /// All layers, downwards: a constant one above the first sample, one between each two samples, a
  /// constant one below the last sample. A depth at an edge belongs to the lower layer.
  const std::vector<SoundSpeedLayer>& layers() const { return layers_; }
  std::size_t layer_index(double depth_m) const;

  double shallowest_m() const { return layers_.front().bottom_m; }
  double deepest_m() const { return layers_.back().top_m; }

  /// Remarks for a user who needs the profile from upper_m down to lower_m, one sentence each: that
  /// the cast starts below upper_m or ends above lower_m, that it is a single sample, that the
  /// samples had to be sorted, that samples at one depth differ by more than 2 m/s.
  std::vector<std::string> remarks(double upper_m, double lower_m) const;

 private:
  double absorbed_db(double depth_m) const;
  /// The depth of some samples, and the greatest difference of their speeds.
  struct Spread {
    double depth_m = 0.0, spread_mps = 0.0;
  };
  bool sorted_;  // whether the given samples were in order of depth
  Spread widest_;
  std::vector<SoundSpeedLayer> layers_;
  std::vector<double> absorbed_db_;  // from the first sample straight down to each layer's top
};

}  // namespace ensonify::scatter
