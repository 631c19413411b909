#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ensonify::refine {

// Text from outside (names of files, what files and command lines contain) in messages.

bool is_utf8(std::string_view text);

/// The text with its control characters, and bytes that are not UTF-8, as \x and two digits: a
/// terminal shows them and does nothing. Other characters stay, and so do those in `kept`.
std::string printable(std::string_view text, std::string_view kept = "");

/// The whole characters among the first `most` bytes, with "..." if there are more.
std::string shortened(std::string_view text, std::size_t most);

}  // namespace ensonify::refine
