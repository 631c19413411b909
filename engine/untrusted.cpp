#include <ensonify/engine/untrusted.h>

#include <algorithm>
#include <stdexcept>

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

void require_shallow_json(std::string_view json) {
  constexpr int deepest = 64;
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text && c == '\\')
      ++i;
    else if (c == '"')
      in_text = !in_text;
    else if (!in_text && (c == '[' || c == '{') && ++depth > deepest)
      throw std::invalid_argument(
          fmt::format("the JSON has lists or objects more than {} levels deep", deepest));
    else if (!in_text && (c == ']' || c == '}'))
      --depth;
  }
}

}  // namespace ensonify::engine
