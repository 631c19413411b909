#include <ensonify/engine/scene/keys/toml_value.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <type_traits>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/scatter/kind_named.h>
#include <ensonify/scatter/nearest_names.h>

namespace ensonify::engine {
namespace {

std::vector<std::string> strings(const toml::node& node, const RefuseValue& refuse) {
  if (const auto* one = node.as_string()) return {one->get()};
  const toml::array* array = node.as_array();
  if (!array) throw refuse("");
  std::vector<std::string> strings;
  for (const toml::node& element : *array) {
    if (!element.is_string()) throw refuse("");
    strings.push_back(element.as_string()->get());
  }
  return strings;
}

/// The numbers of an array. `refuse` makes the error for a wrong value.
std::vector<double> numbers(const Range& range, const toml::node& node, const RefuseValue& refuse) {
  const toml::array* array = node.as_array();
  if (!array) throw refuse("");
  std::vector<double> numbers;
  for (const toml::node& element : *array) {
    numbers.push_back(number_of(element).value_or(std::nan("")));
    if (!(numbers.back() >= range.low && numbers.back() <= range.high))
      throw refuse(fmt::format("; number {} is not", numbers.size()));
  }
  return numbers;
}

/// The points of an array of pairs. `refuse` makes the error for a wrong value.
std::vector<Eigen::Vector2d> points(const Range& range, const toml::node& node,
                                    const RefuseValue& refuse) {
  const toml::array* array = node.as_array();
  if (!array) throw refuse("");
  std::vector<Eigen::Vector2d> points;
  for (const toml::node& element : *array) {
    const toml::array* pair = element.as_array();
    const std::string place = fmt::format("; point {} is not", points.size() + 1);
    if (!pair || pair->size() != 2) throw refuse(place);
    Eigen::Vector2d& point = points.emplace_back();
    for (int axis = 0; axis < 2; ++axis) {
      point[axis] = number_of((*pair)[static_cast<std::size_t>(axis)]).value_or(std::nan(""));
      if (!(point[axis] >= range.low && point[axis] <= range.high)) throw refuse(place);
    }
  }
  return points;
}

}  // namespace

toml::table parse_toml(std::string_view text) {
  if (const std::optional byte = too_deep_in_toml(text)) {
    const std::string_view before = text.substr(0, *byte);
    const std::size_t line_begin = before.rfind('\n') + 1;  // 0 on the first line
    const toml::source_position place{
        static_cast<toml::source_index>(std::ranges::count(before, '\n') + 1),
        static_cast<toml::source_index>(*byte - line_begin + 1)};
    throw toml::parse_error(
        fmt::format("keys, tables and lists are more than {} deep in each other here; remove some",
                    most_levels)
            .c_str(),
        place);
  }
  return toml::parse(text);
}

std::string description(const toml::node& node) {
  if (const auto* value = node.as_string()) return "the string " + quoted_toml(value->get());
  if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_floating_point()) {
    const std::string text = fmt::format("{}", value->get());
    return text.find_first_of(".ein") == std::string::npos ? text + ".0" : text;
  }
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (node.is_table()) return "a table";
  return node.is_array() ? "an array" : "a date or a time";
}

std::optional<double> number_of(const toml::node& node) {
  if (const auto* real = node.as_floating_point()) return real->get();
  if (const auto* whole = node.as_integer()) return static_cast<double>(whole->get());
  return std::nullopt;
}

void set_option(const Option& option, const toml::node& node, const ExpectedValue& expected,
                const RefuseValue& refuse) {
  const auto whole = [&]() -> std::int64_t {
    const auto* value = node.as_integer();
    if (!value || double(value->get()) < expected.range.low ||
        double(value->get()) > expected.range.high)
      throw refuse("");
    return value->get();
  };
  const auto number = [&]() -> double {
    const std::optional value = number_of(node);
    if (!value || !(*value >= expected.range.low && *value <= expected.range.high))
      throw refuse("");  // the condition also refuses NaN
    return expected.in_degrees ? *value * degree : *value;
  };
  const auto word = [&]() -> std::string {
    if (node.is_date_time()) {  // a time without quotes
      std::ostringstream text;
      text << *node.as_date_time();
      return text.str();
    }
    const auto* value = node.as_string();
    if (!value) throw refuse("");
    return value->get();
  };
  const auto choice = [&]() -> std::size_t {
    const std::string text = word();
    const auto found = std::ranges::find_if(
        expected.choices, [&](std::string_view known) { return scatter::same_name(text, known); });
    if (found == expected.choices.end())
      throw refuse(scatter::suggestion(
          text, std::vector<std::string>(expected.choices.begin(), expected.choices.end())));
    return static_cast<std::size_t>(found - expected.choices.begin());
  };
  std::visit(
      [&](auto* its) {
        using T = std::remove_pointer_t<decltype(its)>;
        if constexpr (std::is_same_v<T, bool>) {
          if (!node.is_boolean()) throw refuse("");
          *its = node.as_boolean()->get();
        } else if constexpr (std::is_integral_v<T>) {
          *its = static_cast<T>(whole());
        } else if constexpr (std::is_same_v<T, std::optional<std::uint64_t>>) {
          *its = static_cast<std::uint64_t>(whole());
        } else if constexpr (std::is_enum_v<T>) {
          *its = static_cast<T>(choice());
        } else if constexpr (std::is_same_v<T, InputFile>) {
          its->name = word();
        } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
          *its = strings(node, refuse);
        } else if constexpr (std::is_same_v<T, std::vector<double>>) {
          *its = numbers(expected.range, node, refuse);
        } else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>) {
          *its = points(expected.range, node, refuse);
        } else if constexpr (std::is_same_v<T, std::string>) {
          *its = expected.choices.empty() ? word() : std::string(expected.choices[choice()]);
        } else {
          *its = number();
        }
      },
      option);
}

}  // namespace ensonify::engine
