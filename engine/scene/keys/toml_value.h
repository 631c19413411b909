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

/// The tables of a TOML text. The engine parses TOML only with this function. Throws
/// toml::parse_error, also if a statement has more than `most_levels` levels (untrusted.h).
toml::table parse_toml(std::string_view text);

/// A TOML value as text for a message: "the string \"a\"", "3.0", "a table".
std::string description(const toml::node& node);

/// The number that a TOML value is; none if it is not a number. A whole number that is not a double
/// (most above 2^53) becomes the nearest double, as it would with a decimal point. (toml++'s
/// value<double>() has no value for it.)
std::optional<double> number_of(const toml::node& node);

/// What a key accepts: the members of Key with these names.
struct ExpectedValue {
  Range range;
  std::span<const std::string_view> choices;
  bool in_degrees = false;
};

/// Makes the error for a value that a key does not accept. `hint` is added to the message.
using RefuseValue = std::function<SceneError(const std::string& hint)>;

/// Sets the option of a key to a TOML value. If the key refuses it, throws what `refuse` makes.
void set_option(const Option& option, const toml::node& node, const ExpectedValue& expected,
                const RefuseValue& refuse);

}  // namespace ensonify::engine
