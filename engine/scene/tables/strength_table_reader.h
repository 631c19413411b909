#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include <ensonify/scatter/strength_table.h>

namespace ensonify::engine {

/// Reads measured backscatter strengths from CSV, as a CsvTable: `grazing_deg` from 0 to 90,
/// `strength_db` from -200 to 60, and `frequency_hz` where there are several frequencies. Rows are
/// in order: the frequencies increase, and for each frequency two or more angles increase. Throws
/// SceneError with `file:line: what is wrong, what was expected`.
std::shared_ptr<const scatter::StrengthTable> read_strength_table(
    const std::filesystem::path& file);

/// The same from text; `name` stands for the file in messages.
std::shared_ptr<const scatter::StrengthTable> parse_strength_table(std::string_view text,
                                                                   std::string_view name);

}  // namespace ensonify::engine
