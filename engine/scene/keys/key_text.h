#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include <ensonify/engine/scene/keys/key.h>

namespace ensonify::engine {

/// A limit of the range of whole numbers, as a whole number. The largest whole number of TOML, 2^63
/// - 1, is not a double; a range has 2^63 instead, which becomes 2^63 - 1 here.
std::int64_t whole_limit(double limit);

/// What a key accepts, as a text that follows from its option: "a number from 0.5 to 10000 m",
/// "true or false", "one of grey, copper".
std::string expectation(std::string_view unit, const Range& range,
                        std::span<const std::string_view> choices, const ConstOption& option);
template <class Owner>
std::string expectation(const Key<Owner>& key) {
  if (!key.expected.empty()) return std::string(key.expected);
  const Owner owner{};
  return expectation(key.unit, key.range, key.choices, key.option(owner));
}

/// What a key is and what it accepts.
template <class Owner>
std::string help_text(const Key<Owner>& key) {
  return std::string(key.help) + " (" + expectation(key) + ")";
}

/// The value of an option as TOML: the shortest text that gives the same value when it is read.
/// None if the option is unset. An empty text counts as unset.
std::optional<std::string> option_text(const ConstOption& option, bool in_degrees,
                                       std::span<const std::string_view> choices);
/// The value of a key as TOML. An empty text is a value if the default is another text.
template <class Owner>
std::optional<std::string> option_text(const Key<Owner>& key, const Owner& owner) {
  const ConstOption option = key.option(owner);
  if (const auto* text = std::get_if<const std::string*>(&option); text && (*text)->empty()) {
    const Owner fresh{};
    if (!std::get<const std::string*>(key.option(fresh))->empty()) return "\"\"";
  }
  return option_text(option, key.in_degrees(), key.choices);
}

/// A text as a TOML string.
std::string toml_string(std::string_view text);
/// The first characters of a text as a TOML string, for a message.
std::string quoted_toml(std::string_view text);

}  // namespace ensonify::engine
