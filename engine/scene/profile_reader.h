#pragma once

#include <filesystem>
#include <string_view>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// Reads a sound speed profile from CSV: a header row with `depth_m` and `soundspeed_mps`, in any
/// order, other columns being passed over; then a sample a row, in any order. Blank lines, lines
/// that begin with #, a byte-order mark, CRLF and quotes about a field are fine. At most 4 MiB.
/// Throws SceneError with `file:line: what is wrong, what was expected`.
scatter::SoundSpeedProfile read_profile(const std::filesystem::path& file);

/// The same from text; `name` stands for the file in messages.
scatter::SoundSpeedProfile parse_profile(std::string_view text, std::string_view name);

}  // namespace ensonify::engine
