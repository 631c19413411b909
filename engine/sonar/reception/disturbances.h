#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/artefacts.h>
#include <ensonify/engine/sonar/reception/other_paths.h>

namespace ensonify::engine {

/// The artefacts that arise in the water: fish, wakes, internal waves and other sonars.
class Disturbances {
 public:
  /// `noise`: the noise power, uPa^2, at a speed of the vehicle; the level of an interference is
  /// relative to it. `law` must outlive this object.
  Disturbances(const ArtefactOptions& options, const SonarEquation& law,
               std::function<double(double speed_mps)> noise, std::uint64_t seed);

  /// Whether none of them is switched on.
  bool empty() const { return effects_.empty(); }
  /// Multiplies the gain of the direct echo in each bin, adds to the incoherent power in each bin,
  /// and adds the ping's artefacts to `artefacts`.
  void apply(const LineContext& context, std::span<float> gain, std::span<float> power,
             Artefacts& artefacts) const;

 private:
  /// What apply() changes.
  struct Target {
    std::span<float> gain, power;
    Artefacts& artefacts;
  };
  /// What apply() does for one artefact.
  using Effect = void (Disturbances::*)(const LineContext& context, const Target& to) const;
  void add_interference(const LineContext& context, const Target& to) const;
  void add_wake(const LineContext& context, const Target& to) const;
  void add_fish(const LineContext& context, const Target& to) const;
  void add_one_fish(const LineContext& context, const Eigen::Vector3d& from_array,
                    double over_bed_m, const Target& to) const;
  void shimmer(const LineContext& context, const Target& to) const;

  ArtefactOptions options_;
  const SonarEquation& law_;
  std::function<double(double)> noise_;
  double interference_begin_m_;
  std::uint64_t seed_;
  /// By Sector::number: the phases of three waves, and of their strengths.
  std::array<double, 6 * most_sectors> shimmer_phases_;
  std::vector<Effect> effects_;  // those that are on
};

}  // namespace ensonify::engine
