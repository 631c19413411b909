#include <ensonify/engine/scene/checks/name_check.h>

#include <algorithm>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/key_text.h>

namespace ensonify::engine {

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

std::optional<std::string> fault_of_name(std::string_view kind, std::string_view name) {
  constexpr std::size_t longest = 64;
  if (!name.empty() && name.size() <= longest && std::ranges::all_of(name, is_name_character))
    return std::nullopt;
  return fmt::format("the {}'s name is {}, expected 1 to {} letters, digits, _ and -", kind,
                     quoted_toml(name), longest);
}

std::optional<std::string> fault_of_file_names(std::string_view name,
                                               std::span<const Sonar> sonars) {
  const auto fault = [&](std::string_view whose) {
    return fmt::format(
        "a sonar named {} would have files of the same name as {}; give it another name",
        quoted_toml(name), whose);
  };
  const auto named = [&](std::string_view other) {
    return std::ranges::count(sonars, other, &Sonar::name);
  };
  for (const std::string_view file : {"manifest", "sample"})
    if (name == file) return fault(fmt::format("{}.json", file));
  for (const std::string_view ending :
       {"_ground", "_targets", "_truth", "_background", "_hard_negative", "_ground_background",
        "_ground_hard_negative"})
    if (name.ends_with(ending)) {
      const std::string_view other = name.substr(0, name.size() - ending.size());
      if (named(other) > 0) return fault(fmt::format("the sonar {}", other));
    }
  if (named(name) > 1) return fault("another sonar");
  return std::nullopt;
}

}  // namespace ensonify::engine
