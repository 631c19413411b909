#include <ensonify/scatter/nearest_names.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>

#include <fmt/format.h>

namespace ensonify::scatter {
namespace {

constexpr std::size_t max_parts = 12;
constexpr std::size_t longest_word = 100;
constexpr std::size_t shortest_part = 3;  // "m" is part of too many names

/// Changes a name to lower case, with a space in place of each hyphen and underscore.
std::string normalised(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    c = c == '-' || c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

bool contains_words(std::string_view name, std::string_view words) {
  const auto ends_word = [](std::string_view text, std::size_t at) {
    return at >= text.size() || text[at] == ' ' || text[at] == '.';
  };
  for (std::size_t at = name.find(words); at != name.npos; at = name.find(words, at + 1))
    if ((at == 0 || ends_word(name, at - 1)) && ends_word(name, at + words.size())) return true;
  return false;
}

/// Whether the word is made of letters of the name in their order, and begins like the name.
bool abbreviates(std::string_view word, std::string_view name) {
  if (word.empty() || name.empty() || word.front() != name.front()) return false;
  for (const char letter : name)
    if (!word.empty() && word.front() == letter) word.remove_prefix(1);
  return word.empty();
}

std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::vector<std::string_view> nearest_names(std::string_view word,
                                            std::span<const std::string_view> names,
                                            std::size_t most, std::size_t letters) {
  if (word.size() > longest_word) return {};
  const std::string wanted = normalised(word);
  std::vector<std::string_view> containing, beginning;
  std::vector<std::pair<std::size_t, std::string_view>> near, longer;
  for (const std::string_view name : names) {
    const std::string whole = normalised(name);
    const std::string_view last = std::string_view(whole).substr(whole.rfind('.') + 1);
    if (wanted.size() >= shortest_part) {
      if (contains_words(whole, wanted)) containing.push_back(name);
      if (last.starts_with(wanted)) beginning.push_back(name);
      if (abbreviates(wanted, last)) longer.emplace_back(last.size(), name);
    }
    if (const std::size_t apart = std::min(edits(wanted, whole), edits(wanted, last));
        apart <= letters)
      near.emplace_back(apart, name);
  }
  if (near.empty()) near = std::move(longer);
  std::ranges::stable_sort(near, {}, [](const auto& one) { return one.first; });
  const bool misspelt = !near.empty() && near.front().first <= 1;
  std::vector<std::string_view>& parts = containing.empty() ? beginning : containing;
  if (!parts.empty() && !misspelt) {
    parts.resize(std::min(parts.size(), max_parts));
    return parts;
  }
  std::vector<std::string_view> nearest;
  for (const auto& [apart, name] : near)
    if (nearest.size() < most) nearest.push_back(name);
  return nearest;
}

std::string suggestion(std::string_view word, std::span<const std::string> known) {
  const std::vector<std::string_view> names(known.begin(), known.end());
  const std::vector<std::string_view> meant =
      nearest_names(word, names, 1, std::max<std::size_t>(2, word.size() / 3));
  std::string text;
  for (std::size_t i = 0; i < meant.size(); ++i)
    text += fmt::format("{}'{}'", i == 0 ? "" : i + 1 < meant.size() ? ", " : " or ", meant[i]);
  return text.empty() ? "" : fmt::format("; did you mean {}?", text);
}

}  // namespace ensonify::scatter
