#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// Suggests names for an unknown `word`. These are the names that contain the word as whole words,
/// or, if there are none, the names that begin with it: at most 12, in their given order. If no
/// name contains it or begins with it, or if one edit (insert, remove, change, swap neighbours)
/// makes the word a name, these are the nearest names within `letters` edits, at most `most`. Case
/// is ignored, and space, hyphen and underscore count as equal. If a name has dots, its last part
/// is compared, too. Returns none for a word of more than 100 letters.
std::vector<std::string_view> nearest_names(std::string_view word,
                                            std::span<const std::string_view> names,
                                            std::size_t most, std::size_t letters);
/// Returns "; did you mean 'x'?" with the known names nearest to the word; empty if none is near.
std::string suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace ensonify::scatter
