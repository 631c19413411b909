#pragma once

#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/one_way_beams.h>
#include <ensonify/engine/sonar/reception/sonar_equation.h>

namespace ensonify::engine {

/// Echoes that both a wall and the bed in front of it reflect.
class DoubleBounce {
 public:
  /// The sonar equation, the bed and the beams must outlive this.
  DoubleBounce(const SonarEquation& law, const LevelBed& bed, const OneWayBeams& beams,
               PulseKernel pulse);

  /// Adds the echoes of the line's walls to the intensity `power` in each bin, computed from the
  /// direct echo of each bin. `energies`: working memory.
  void add(const LineContext& context, const EchoLine& line, const BeamPlane& plane,
           std::span<const float> direct, std::span<float> power,
           std::vector<double>& energies) const;

 private:
  struct WallOverBed;
  struct MirroredBeam;
  std::optional<WallOverBed> wall_over_bed(const LineContext& context, const EchoLine& line,
                                           const WallFacet& wall) const;
  bool sees_bed(const LineContext& context, const BinLayers& bins, const WallOverBed& wall,
                double range_m, double before_m) const;
  void add_wall(const LineContext& context, const EchoLine& line, const WallOverBed& wall,
                const BeamPlane& plane, std::span<const float> direct,
                std::span<double> energies) const;
  double mirrored_m(const MirroredBeam& beam) const;
  /// The metres of a way down to the bed that are one bin of range.
  double bin_length_m(const LineContext& context) const {
    return law_.bin_m() / context.range_per_m_down;
  }

  const SonarEquation& law_;
  const LevelBed& bed_;
  const OneWayBeams& beams_;
  PulseKernel pulse_;
  double k_per_cm_;  // wavenumber of the sediment's relief
};

}  // namespace ensonify::engine
