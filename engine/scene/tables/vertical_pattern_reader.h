#pragma once

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

#include <ensonify/engine/sonar/instrument/beam_pattern.h>

namespace ensonify::engine {

/// Reads a measured vertical pattern from CSV (see CsvTable): `depression_deg` from -90 to 180, and
/// `level_db`, or `port_db` and `starboard_db`. Levels are one-way power in dB re the peak, so at
/// most 0. At least two rows, in any order. Throws SceneError with `file:line: what is wrong, what
/// was expected`.
std::array<std::vector<VerticalLevel>, 2> read_vertical_pattern(const std::filesystem::path& file);

/// Reads the pattern from a text; `name` replaces the file's name in messages.
std::array<std::vector<VerticalLevel>, 2> parse_vertical_pattern(std::string_view text,
                                                                 std::string_view name);

}  // namespace ensonify::engine
