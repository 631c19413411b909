#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/prepared_water.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/echo/echo_former.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/reception/signal_chain.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// A sonar with all that its pings need and that does not change from ping to ping. Threads share
/// it.
struct PreparedSonar {
  Sonar sonar;  ///< with the bins of its digitiser
  /// The cast with absorption at the sonar's frequency; none if the scene has no cast.
  std::optional<scatter::SoundSpeedProfile> profile;
  Medium medium;                                       ///< may refer to the profile
  std::vector<scatter::BackscatterTable> by_material;  ///< by the number of the material
  std::unique_ptr<const SignalChain> chain;
  Calibration calibration;  ///< refers to the chain's recorder
};

/// Makes a sonar of the scene ready, with these settings: tables for all of the materials, whose
/// number 0 is none and whose number 1 is the bed's own. `number` is the sonar's place in the
/// scene. Odd parameters are added to the warnings, each once. Throws as
/// read_vertical_pattern() and material_named().
std::shared_ptr<const PreparedSonar> prepare_sonar(const Scene& scene, const PreparedWater& water,
                                                   std::size_t number, const Sonar& settings,
                                                   const std::vector<std::string>& materials,
                                                   std::vector<std::string>& warnings);

}  // namespace ensonify::engine
