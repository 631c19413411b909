#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace ensonify::engine {

/// The number that the whole text consists of, as std::from_chars() reads it: without spaces and
/// without a leading '+'. None if the text is not a number or does not fit into T. (A double may be
/// infinite or NaN.)
template <typename T>
std::optional<T> number_in(std::string_view text) {
  T number{};
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

}  // namespace ensonify::engine
