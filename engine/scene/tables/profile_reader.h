#pragma once

#include <filesystem>
#include <string_view>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// Reads a sound speed profile from CSV (see CsvTable) with the columns `depth_m` and
/// `soundspeed_mps`, or from the file of a CastAway: one sample per row, in any order. Throws
/// SceneError with `file:line: what is wrong, what was expected`.
scatter::SoundSpeedProfile read_profile(const std::filesystem::path& file);

/// Reads the profile from a text; `name` replaces the file's name in messages.
scatter::SoundSpeedProfile parse_profile(std::string_view text, std::string_view name);

}  // namespace ensonify::engine
