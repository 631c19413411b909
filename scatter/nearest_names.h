#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// What somebody who wrote `word` may have meant, of the names there are: those that contain it as
/// whole words, or else begin with it, at most 12, in their own order. If there are none, or one
/// edit (insert, drop, change, swap neighbours) makes a name of it: the `most` that are nearest, as
/// far as `letters` edits are enough. Case does not matter, and space, hyphen and underscore are
/// the same; of a name with dots the last part will do. For a word of more than 100 letters there
/// are none.
std::vector<std::string_view> nearest_names(std::string_view word,
                                            std::span<const std::string_view> names,
                                            std::size_t most, std::size_t letters);

}  // namespace ensonify::scatter
