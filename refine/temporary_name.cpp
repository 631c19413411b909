#include <ensonify/refine/temporary_name.h>

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace ensonify::refine {

std::string temporary_name(const std::filesystem::path& of, int n) {
  return fmt::format(".{}.{}.tmp", of.filename().string(), n);
}

bool is_temporary_of(const std::filesystem::path& of, const std::filesystem::path& path) {
  const std::string name = path.filename().string(),
                    begin = fmt::format(".{}.", of.filename().string());
  constexpr std::string_view end = ".tmp";
  if (name.size() <= begin.size() + end.size() || !name.starts_with(begin) || !name.ends_with(end))
    return false;
  const auto number = std::string_view(name)
                          .substr(begin.size())
                          .substr(0, name.size() - begin.size() - end.size());
  return std::ranges::all_of(number, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace ensonify::refine
