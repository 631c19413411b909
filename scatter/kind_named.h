#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// Whether two names are the same, where - and _ are alike.
bool same_name(std::string_view a, std::string_view b);

/// Throws std::invalid_argument: there is no `what` of this name, only those of these names.
[[noreturn]] void throw_unknown_kind(std::string_view what, std::string_view name,
                                     std::span<const std::string_view> names);

/// The kind of this name in a table whose rows have a member `name`; - and _ are alike. `what` is
/// what the rows are, for the message. Throws std::invalid_argument, listing the names.
template <class Kinds>
const auto& kind_named(const Kinds& kinds, std::string_view what, std::string_view name) {
  for (const auto& kind : kinds)
    if (same_name(kind.name, name)) return kind;
  std::vector<std::string_view> names;
  for (const auto& kind : kinds) names.push_back(kind.name);
  throw_unknown_kind(what, name, names);
}

}  // namespace ensonify::scatter
