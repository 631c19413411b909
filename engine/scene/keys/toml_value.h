#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/keys/key.h>

namespace toml {
inline namespace v3 {
class node;
class table;
}  // namespace v3
}  // namespace toml

namespace ensonify::engine {

/// The tables of a TOML text: the only way in which the engine parses it. Throws toml::parse_error,
/// also for a statement with more than `most_levels` (untrusted.h).
toml::table parse_toml(std::string_view text);

/// What a TOML value is, for a message: "the string \"a\"", "3.0", "a table".
std::string description(const toml::node& node);

/// The number that a TOML value is, if it is one. A whole number without a double of its own (most
/// above 2^53) becomes the nearest one, as the same number with a decimal point does. (toml++'s
/// value<double>() has no value for it.)
std::optional<double> number_of(const toml::node& node);

/// What a key accepts, as in Key.
struct ExpectedValue {
  Range range;
  std::span<const std::string_view> choices;
  bool in_degrees = false;
};

/// The error for a value that a key does not accept; `hint` is added to its message.
using RefuseValue = std::function<SceneError(const std::string& hint)>;

/// Sets the option of a key from a TOML value. Throws what `refuse` makes.
void set_option(const Option& option, const toml::node& node, const ExpectedValue& expected,
                const RefuseValue& refuse);

}  // namespace ensonify::engine
