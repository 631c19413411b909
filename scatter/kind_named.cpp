#include <ensonify/scatter/kind_named.h>

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace ensonify::scatter {

bool same_name(std::string_view a, std::string_view b) {
  const auto plain = [](char c) { return c == '-' ? '_' : c; };
  return std::ranges::equal(a, b, {}, plain, plain);
}

void throw_unknown_kind(std::string_view what, std::string_view name,
                        std::span<const std::string_view> names) {
  throw std::invalid_argument(fmt::format("there is no {} '{}'; there are: {}", what,
                                          name.substr(0, 64), fmt::join(names, ", ")));
}

}  // namespace ensonify::scatter
