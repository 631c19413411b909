#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/double_bounce.h>
#include <ensonify/engine/sonar/reception/multiples.h>

namespace ensonify::engine {

/// The farthest range from which echoes of earlier pings are added. ping_m: as for OtherPaths.
double farthest_earlier_m(const Sonar& sonar, double ping_m);

/// Integrals of the two-way vertical pattern over parts of the plane abeam.
class VerticalSum {
 public:
  VerticalSum(const SonarEquation& law, std::size_t sector);
  /// The integral from one depression to another, in the sonar's frame; any angles.
  double between(double from_rad, double to_rad) const { return up_to(to_rad) - up_to(from_rad); }

 private:
  double up_to(double depression_rad) const;
  std::vector<double> sums_;  // from depression 0
};

/// Sound that is received incoherently in addition to the direct echo. The sea surface is a plane
/// that moves up and down; for multiples, volume reverberation and echoes of earlier pings the bed
/// is a horizontal plane at the altitude.
class OtherPaths {
 public:
  /// `ping_m`: the range to which sound goes and comes back between two pings, c P / 2. `seed`: of
  /// the water's scatterers; unset: their mean. `law`: the sonar equation of this sonar, which must
  /// outlive this object.
  OtherPaths(const OtherPathsOptions& options, const Sonar& sonar, const SeaState& sea,
             const SonarEquation& law, const LevelBed& bed, double ping_m,
             std::optional<std::uint64_t> seed);
  OtherPaths(const OtherPaths&) = delete;  // its parts refer to each other
  OtherPaths& operator=(const OtherPaths&) = delete;

  /// Adds to the intensity `power` in each bin, which contains the noise. `direct`: the expected
  /// direct echo per bin. `sums`: working memory.
  void add(const LineContext& context, const EchoLine& line, std::span<const float> direct,
           std::span<float> power, std::vector<double>& sums) const;

 private:
  struct BeamPart;
  std::span<const BeamPart> beam_parts(const BeamPlane& plane, double depth_m,
                                       std::span<BeamPart> room) const;
  void add_surface(const LineContext& context, const BeamPlane& plane,
                   std::span<float> power) const;
  void add_volume(const LineContext& context, double depth_m, double altitude_m,
                  const BeamPlane& plane, std::span<float> power,
                  std::vector<double>& random) const;
  double received_m() const;
  void add_earlier_pings(const LineContext& context, const BeamPlane& plane,
                         std::span<float> power) const;

  OtherPathsOptions options_;
  const SonarEquation& law_;
  LevelBed bed_;
  double ping_m_;
  scatter::SeaSurface surface_;
  std::vector<double> surface_strength_;  // by the sine of the grazing angle
  std::vector<double> volume_;            // per bin, for one radian of the vertical beam
  /// Number of scatterers in the water per bin, for one radian of the vertical beam and one metre
  /// of range; empty: very many, or their mean.
  std::vector<double> scatterers_;
  std::uint64_t seed_;                      // of these scatterers
  std::vector<VerticalSum> vertical_sums_;  // by sector
  std::optional<OneWayBeams> beams_;        // if multiples or walls are received
  std::optional<Multiples> multiples_;
  std::optional<DoubleBounce> double_bounce_;
};

}  // namespace ensonify::engine
