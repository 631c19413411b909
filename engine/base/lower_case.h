#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace ensonify::engine {

/// A text in lower case. Only ASCII letters are changed.
inline std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace ensonify::engine
