#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace ensonify::engine {

/// The text in lower case; only ASCII letters change.
inline std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace ensonify::engine
