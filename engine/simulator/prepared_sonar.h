#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/simulator/prepared_water.h>
#include <ensonify/engine/sonar/reception/signal_chain.h>

namespace ensonify::engine {

/// A sonar and all data that are equal for all of its pings. Threads share one object.
struct PreparedSonar {
  Sonar settings;  ///< as given
  Sonar sonar;     ///< with the bins that its digitiser makes
  /// The cast with absorption at the sonar's frequency; none if the scene has no cast.
  std::optional<scatter::SoundSpeedProfile> profile;
  Medium medium;                                       ///< may refer to the profile
  std::optional<scatter::BackscatterTable> bed_table;  ///< strength of the median bed
  std::vector<MaterialInSonar> materials;              ///< by the number of the material
  std::unique_ptr<const SignalChain> chain;
  Calibration calibration;  ///< refers to the chain's recorder
};

/// The usual values of a scene's pings.
struct UsualPing {
  double altitude_m = 0.0;  ///< of the vehicle, over the bed straight below
  double speed_mps = 0.0;
  double interval_s = 0.0;  ///< 0: unknown
};

/// Prepares a sonar of the scene with these settings. Makes a backscatter table for each of
/// `materials`: number 0 means no material, number 1 is the material of the bed. `bed_shares` are
/// the shares of the bed's area that the first of the materials have. `number` is the sonar's index
/// in the scene. Adds a warning for parameters of a material that are outside their valid range;
/// the same warning is added once. stop_check is called often. Throws as stop_check,
/// read_vertical_pattern() and material_named().
std::shared_ptr<const PreparedSonar> prepare_sonar(const Scene& scene, const PreparedWater& water,
                                                   const UsualPing& usual, std::size_t number,
                                                   const Sonar& settings,
                                                   const std::vector<std::string>& materials,
                                                   std::span<const double> bed_shares,
                                                   std::vector<std::string>& warnings,
                                                   const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
