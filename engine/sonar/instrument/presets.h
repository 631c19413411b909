#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// An instrument whose values scenes can use as defaults. An instrument with two frequencies has
/// two presets.
struct Preset {
  std::string_view name;        ///< e.g. "klein-3000-low"
  std::string_view instrument;  ///< maker and model
  double beamwidth_rad;         ///< horizontal, one way, -3 dB to -3 dB; gives the array's length
  Sonar sonar;
  /// Keys whose values come from a document of the maker or of a survey, separated by blanks; the
  /// other values are typical of such instruments.
  std::string_view documented;
};

/// The default values of a sonar of this kind that has no preset.
Sonar usual_sonar(SonarKind kind);

std::span<const Preset> presets();
std::vector<std::string_view> preset_names();
/// The sonar of the preset with this name, in which - and _ are equal. Throws std::invalid_argument
/// if no preset has this name.
const Sonar& preset_sonar(std::string_view name);

}  // namespace ensonify::engine
