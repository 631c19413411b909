#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// Whether names and TOML keys may have this character: A to Z, a to z, 0 to 9, _ and -.
bool is_name_character(char character);

/// What is wrong with the name of a sonar or of a material; `kind` says which. None if nothing is
/// wrong.
std::optional<std::string> fault_of_name(std::string_view kind, std::string_view name);

/// The names of a sonar's files begin with the sonar's name. If files of a sonar with this name
/// would have the same names as files of another one of these sonars, or as a file that every run
/// or sample has, returns what is wrong; none otherwise.
std::optional<std::string> fault_of_file_names(std::string_view name,
                                               std::span<const Sonar> sonars);

}  // namespace ensonify::engine
