#pragma once

#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/one_way_beams.h>
#include <ensonify/engine/sonar/reception/sonar_equation.h>
#include <ensonify/scatter/surface_scatter.h>

namespace ensonify::engine {

/// Echoes of the bed by way of the sea surface, which is a plane, and of the bed once more.
class Multiples {
 public:
  /// The sonar equation, the bed and the beams must outlive this. bottom_loss_db: loss of a
  /// reflection by the bed; unset: the loss of the bed's sediment.
  Multiples(const SonarEquation& law, const LevelBed& bed, const OneWayBeams& beams,
            double wind_mps, std::optional<double> bottom_loss_db);

  /// Adds the multiples to the intensity `power` in each bin, computed from the direct echo of each
  /// bin. Depth and altitude are ranges. `sums`: working memory.
  void add(double depth_m, double altitude_m, const BeamPlane& plane, std::span<const float> direct,
           std::span<float> power, std::vector<double>& sums) const;

 private:
  struct Path;
  struct Source;
  void sum_bed(double slant_m, const BeamPlane& plane, std::span<const float> direct,
               std::vector<double>& sums) const;
  Source source_of(const Path& path, double apparent_m, double bed_m, const BeamPlane& plane) const;

  const SonarEquation& law_;
  const LevelBed& bed_;
  const OneWayBeams& beams_;
  scatter::SeaSurface surface_;
  double surface_slope_, bed_slope_;    // rms, along the track
  std::vector<double> bed_reflection_;  // of energy, by the sine of the grazing angle
};

}  // namespace ensonify::engine
