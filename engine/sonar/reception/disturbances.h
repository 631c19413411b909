#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <ensonify/engine/sonar/reception/artefacts.h>
#include <ensonify/engine/sonar/reception/other_paths.h>

namespace ensonify::engine {

/// What of the artefacts meets the sound in the water: fish, wakes, internal waves and other
/// sonars.
class Disturbances {
 public:
  /// noise: uPa^2, which an interference's level is counted from. The law must outlive it.
  Disturbances(const ArtefactOptions& options, const EchoLaw& law, double noise,
               std::uint64_t seed);

  /// Whether there are any.
  bool any() const;
  /// Changes the direct echo's gain in each bin and adds to the incoherent power.
  void apply(const PingContext& hearing, Side side, std::span<float> gain, std::span<float> power,
             Artefacts& artefacts) const;

 private:
  void add_interference(const PingContext& hearing, std::span<float> power) const;
  void add_wake(const PingContext& hearing, Side side, std::span<float> power,
                Artefacts& artefacts) const;
  void add_fish(const PingContext& hearing, Side side, std::span<float> gain,
                std::span<float> power, Artefacts& artefacts) const;
  void add_fish(const PingContext& hearing, Side side, const Eigen::Vector3d& from_array,
                double over_bed_m, std::span<float> gain, std::span<float> power,
                Artefacts& artefacts) const;
  void shimmer(const PingContext& hearing, std::span<float> gain) const;

  ArtefactOptions options_;
  const EchoLaw& law_;
  double interference_;
  double interference_begin_m_;
  std::uint64_t seed_;
  std::array<double, 4> phases_;
};

}  // namespace ensonify::engine
