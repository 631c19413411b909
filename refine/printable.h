#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ensonify::refine {

// For texts from outside (names of files, words of files and command lines) in messages.

bool is_utf8(std::string_view text);

/// Writes control characters, and bytes that are not UTF-8, as \x and two digits: so a terminal
/// shows them and does not obey them. Other characters stay, and so do those in `kept`.
std::string printable(std::string_view text, std::string_view kept = "");

/// Returns the whole characters within the first `most` bytes, and "..." if the text is longer.
std::string shortened(std::string_view text, std::size_t most);

}  // namespace ensonify::refine
