#include <ensonify/engine/base/untrusted.h>

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace ensonify::engine {

bool lies_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const std::filesystem::path inner = std::filesystem::canonical(path),
                              outer = std::filesystem::canonical(folder);
  return std::ranges::mismatch(outer, inner).in1 == outer.end();
}

bool stays_inside(const std::filesystem::path& path) {
  return !path.empty() && path.is_relative() && *path.lexically_normal().begin() != "..";
}

std::optional<std::size_t> too_deep_in_json(std::string_view json) {
  int levels = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text && c == '\\')
      ++i;
    else if (c == '"')
      in_text = !in_text;
    else if (!in_text && (c == '[' || c == '{') && ++levels > most_levels)
      return i;
    else if (!in_text && (c == ']' || c == '}'))
      --levels;
  }
  return std::nullopt;
}

namespace {

/// The byte after the TOML string that begins at `i`. Without an end, the end of its line or text.
std::size_t end_of_toml_string(std::string_view toml, std::size_t i) {
  const char quote = toml[i];
  const std::string three(3, quote);
  const bool many_lines = toml.substr(i).starts_with(three);
  for (i += many_lines ? 3 : 1; i < toml.size(); ++i) {
    if (toml[i] == '\\' && quote == '"')
      ++i;
    else if (toml[i] == '\n' && !many_lines)
      return i;
    else if (toml[i] == quote && !many_lines)
      return i + 1;
    else if (toml.substr(i).starts_with(three))  // up to two more quotes belong to the string
      return std::min(toml.find_first_not_of(quote, i), toml.size());
  }
  return toml.size();
}

}  // namespace

std::optional<std::size_t> too_deep_in_toml(std::string_view toml) {
  std::vector<int> brackets;  // the number of levels inside each open bracket
  int levels = 0;             // the number of levels at byte i
  for (std::size_t i = 0; i < toml.size(); ++i) {
    switch (toml[i]) {
      case '"':
      case '\'': i = end_of_toml_string(toml, i) - 1; break;
      case '#': i = std::min(toml.find('\n', i), toml.size()) - 1; break;
      case '[':
      case '{': brackets.push_back(++levels); break;
      case '.': ++levels; break;
      case ']':
      case '}':
        if (!brackets.empty()) brackets.pop_back();
        [[fallthrough]];
      case ',':
      case '\n': levels = brackets.empty() ? 0 : brackets.back(); break;
      default: break;
    }
    if (levels > most_levels) return i;
  }
  return std::nullopt;
}

}  // namespace ensonify::engine
