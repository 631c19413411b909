#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// Suggests names for an unknown `word`: those that contain it as whole words, otherwise those that
/// begin with it, at most 12, in their given order. If there are none, or if one edit (insert,
/// remove, change, swap neighbours) makes the word a name: the at most `most` nearest names within
/// `letters` edits. Case is ignored; space, hyphen and underscore are the same; for a name with
/// dots its last part is compared too. Returns none for a word of more than 100 letters.
std::vector<std::string_view> nearest_names(std::string_view word,
                                            std::span<const std::string_view> names,
                                            std::size_t most, std::size_t letters);
/// "; did you mean 'x'?" for the known names that are nearest to this one, if any is near.
std::string suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace ensonify::scatter
