#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include <ensonify/scatter/strength_table.h>

namespace ensonify::engine {

/// Reads measured backscatter strengths from CSV (see CsvTable): `grazing_deg` from 0 to 90,
/// `strength_db` from -200 to 60, and, for several frequencies, `frequency_hz`. The rows are in
/// order: frequencies increase, and for each frequency the angles, two or more, increase. Throws
/// SceneError with `file:line: what is wrong, what was expected`.
std::shared_ptr<const scatter::StrengthTable> read_strength_table(
    const std::filesystem::path& file);

/// Reads the strengths from a text; `name` replaces the file's name in messages.
std::shared_ptr<const scatter::StrengthTable> parse_strength_table(std::string_view text,
                                                                   std::string_view name);

}  // namespace ensonify::engine
