#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// An instrument that scenes can start from. Instruments of two frequencies are two presets.
struct Preset {
  std::string_view name;        ///< as in "klein-3000-low"
  std::string_view instrument;  ///< maker and model
  double beamwidth_rad;         ///< horizontal, one way, -3 dB to -3 dB; the array's length follows
  Sonar sonar;
  /// Keys whose values a document of the maker or of a survey gives, separated by blanks; the
  /// others are typical of such instruments.
  std::string_view documented;
};

std::span<const Preset> presets();
std::vector<std::string_view> preset_names();
/// The sonar of that name. Throws std::invalid_argument for no such name.
const Sonar& preset_sonar(std::string_view name);

}  // namespace ensonify::engine
