#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

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

  bool empty() const { return effects_.empty(); }
  /// Changes the direct echo's gain in each bin and adds to the incoherent power.
  void apply(const PingContext& hearing, Side side, std::span<float> gain, std::span<float> power,
             Artefacts& artefacts) const;

 private:
  /// What apply() does for one artefact.
  using Effect = void (Disturbances::*)(const PingContext& hearing, Side side,
                                        std::span<float> gain, std::span<float> power,
                                        Artefacts& artefacts) const;
  void add_interference(const PingContext& hearing, Side side, std::span<float> gain,
                        std::span<float> power, Artefacts& artefacts) const;
  void add_wake(const PingContext& hearing, Side side, std::span<float> gain,
                std::span<float> power, Artefacts& artefacts) const;
  void add_fish(const PingContext& hearing, Side side, std::span<float> gain,
                std::span<float> power, Artefacts& artefacts) const;
  void add_one_fish(const PingContext& hearing, Side side, const Eigen::Vector3d& from_array,
                    double over_bed_m, std::span<float> gain, std::span<float> power,
                    Artefacts& artefacts) const;
  void shimmer(const PingContext& hearing, Side side, std::span<float> gain, std::span<float> power,
               Artefacts& artefacts) const;

  ArtefactOptions options_;
  const EchoLaw& law_;
  double interference_;
  double interference_begin_m_;
  std::uint64_t seed_;
  std::array<double, 4> phases_;
  std::vector<Effect> effects_;  // those that are on
};

}  // namespace ensonify::engine
