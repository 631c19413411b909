#include <ensonify/engine/scene/keys/key_text.h>

#include <charconv>
#include <cmath>
#include <type_traits>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/refine/printable.h>

namespace ensonify::engine {
namespace {

std::string number_text(double value) {
  if (value == 0.0) return std::signbit(value) ? "-0.0" : "0";  // TOML's integer -0 has no sign
  return fmt::format("{}", value);
}

std::string point_text(const Eigen::Vector2d& p) {
  return fmt::format("[{}, {}]", number_text(p.x()), number_text(p.y()));
}

/// A list; text_of(value) is the text of one value. None for an empty list.
template <class Value, class TextOf>
std::optional<std::string> list_text(const std::vector<Value>& values, const TextOf& text_of) {
  if (values.empty()) return std::nullopt;
  std::string text;
  for (const Value& value : values) text += (text.empty() ? "" : ", ") + text_of(value);
  return fmt::format("[{}]", text);
}

/// The shortest number of degrees that converts to the same radians.
std::string degrees_text(double rad) {
  const double degrees = rad / degree;
  std::string text;
  for (int digits = 1; digits <= 17; ++digits) {
    text = fmt::format("{:.{}g}", degrees, digits);
    double back = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    if (back * degree == rad) return number_text(back);
  }
  return text;
}

}  // namespace

std::int64_t whole_limit(double limit) {
  constexpr auto largest = std::numeric_limits<std::int64_t>::max();
  return limit < static_cast<double>(largest) ? static_cast<std::int64_t>(limit) : largest;
}

std::string expectation(std::string_view unit, const Range& range,
                        std::span<const std::string_view> choices, const ConstOption& option) {
  if (!choices.empty())
    return fmt::format("{}{}", choices.size() > 1 ? "one of " : "", fmt::join(choices, ", "));
  if (std::holds_alternative<const bool*>(option)) return "true or false";
  if (std::holds_alternative<const InputFile*>(option)) return "a path";
  if (std::holds_alternative<const std::vector<std::string>*>(option))
    return "strings [\"...\", ...]";
  if (std::holds_alternative<const std::string*>(option)) return "a name";
  const std::string_view space = unit.empty() ? "" : " ";
  if (std::holds_alternative<const std::vector<double>*>(option))
    return fmt::format("numbers [a, b, ...], each from {} to {}{}{}", range.low, range.high, space,
                       unit);
  if (std::holds_alternative<const std::vector<Eigen::Vector2d>*>(option))
    return fmt::format("points [[east, north], ...], each number from {} to {}{}{}", range.low,
                       range.high, space, unit);
  if (std::holds_alternative<const std::uint64_t*>(option) ||
      std::holds_alternative<const int*>(option) ||
      std::holds_alternative<const std::optional<std::uint64_t>*>(option))
    return fmt::format("a whole number from {} to {}", whole_limit(range.low),
                       whole_limit(range.high));
  return fmt::format("a number from {} to {}{}{}", range.low, range.high, space, unit);
}

std::optional<std::string> option_text(const ConstOption& option, bool in_degrees,
                                       std::span<const std::string_view> choices) {
  const auto number = [&](double value) {
    return in_degrees ? degrees_text(value) : number_text(value);
  };
  return std::visit(
      [&](const auto* value) -> std::optional<std::string> {
        using T = std::remove_cvref_t<decltype(*value)>;
        if constexpr (std::is_same_v<T, double>)
          return number(*value);
        else if constexpr (std::is_same_v<T, std::optional<double>>)
          return *value ? std::optional(number(**value)) : std::nullopt;
        else if constexpr (std::is_same_v<T, std::optional<std::uint64_t>>)
          return *value ? std::optional(fmt::format("{}", **value)) : std::nullopt;
        else if constexpr (std::is_same_v<T, std::string>)
          return value->empty() ? std::nullopt : std::optional(toml_string(*value));
        else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>)
          return list_text(*value, point_text);
        else if constexpr (std::is_same_v<T, std::vector<std::string>>)
          return list_text(*value, toml_string);
        else if constexpr (std::is_same_v<T, std::vector<double>>)
          return list_text(*value, number_text);
        else if constexpr (std::is_same_v<T, InputFile>)
          return value->name.empty() ? std::nullopt : std::optional(toml_string(value->name));
        else if constexpr (std::is_enum_v<T>)
          return toml_string(choices[static_cast<std::size_t>(*value)]);
        else
          return fmt::format("{}", *value);
      },
      option);
}

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", c);
    else
      out += c;
  }
  return out + '"';
}

std::string quoted_toml(std::string_view text) { return toml_string(refine::shortened(text, 60)); }

}  // namespace ensonify::engine
