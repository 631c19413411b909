#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// Whether two names are equal when - counts as _.
bool same_name(std::string_view a, std::string_view b);

/// Throws std::invalid_argument: no `what` has this name; the message lists `names`.
[[noreturn]] void throw_unknown_kind(std::string_view what, std::string_view name,
                                     std::span<const std::string_view> names);

/// Returns the row with this name of a table whose rows have a member `name`; - and _ count as
/// equal. `what` is the word for a row in the message. If there is no such row, throws
/// std::invalid_argument with a list of all names.
template <class Kinds>
const auto& kind_named(const Kinds& kinds, std::string_view what, std::string_view name) {
  for (const auto& kind : kinds)
    if (same_name(kind.name, name)) return kind;
  std::vector<std::string_view> names;
  for (const auto& kind : kinds) names.push_back(kind.name);
  throw_unknown_kind(what, name, names);
}

}  // namespace ensonify::scatter
