#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// Whether a name or a TOML key may have this character: A to Z, a to z, digits, _ and -.
bool is_name_character(char character);

/// What is wrong with the name of a sonar or a material (`kind`); none if it may have that name.
std::optional<std::string> fault_of_name(std::string_view kind, std::string_view name);

/// A sonar's files begin with its name. What is wrong with a name whose files would be those of
/// another one of these sonars, of a run or of a sample; none if it may be used.
std::optional<std::string> fault_of_file_names(std::string_view name,
                                               std::span<const Sonar> sonars);

}  // namespace ensonify::engine
