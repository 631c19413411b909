#include <ensonify/engine/untrusted.h>

#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::engine {

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
