#include <ensonify/engine/dataset/distribution.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

std::uint32_t reversed(std::uint32_t bits) {
  std::uint32_t result = 0;
  for (int i = 0; i < 32; ++i, bits >>= 1) result = result << 1 | (bits & 1);
  return result;
}

/// Flips bits. For each bit, a hash of the seed and of the higher bits decides whether it is
/// flipped (Laine & Karras, Computer Graphics Forum 30, 1265, 2011; constants by Burley).
std::uint32_t scrambled(std::uint32_t bits, std::uint32_t seed) {
  std::uint32_t x = reversed(bits) + seed;
  for (const std::uint32_t factor : {0x6c50b47cu, 0xb82f1e52u, 0xc7afe638u, 0x8d22f6e6u})
    x ^= x * factor;
  return reversed(x);
}

}  // namespace

std::vector<std::string> Distribution::needs() const {
  std::vector<std::string> keys = times;
  keys.insert(keys.end(), plus.begin(), plus.end());
  if (!by.empty()) keys.push_back(by);
  for (const auto& [value, entry] : table)
    for (std::string& key : entry.needs()) keys.push_back(std::move(key));
  return keys;
}

double Distribution::share_between() const {
  if (!between) return 1.0;
  const auto [least, most] = *between;
  if (b == 0.0) return least <= a && a <= most ? 1.0 : 0.0;
  const auto twice_below = [&](double x) { return std::erfc((a - x) / (b * std::numbers::sqrt2)); };
  return 0.5 * (twice_below(most) - twice_below(least));
}

void Distribution::collect_values(std::vector<std::string>& values) const {
  values.insert(values.end(), choices.begin(), choices.end());
  for (const auto& [value, entry] : table) entry.collect_values(values);
}

bool Distribution::gives_only_words() const {
  if (!times.empty() || !plus.empty()) return false;
  return kind == Kind::choice ||
         (kind == Kind::table && std::ranges::all_of(table, [](const auto& entry) {
            return entry.second.gives_only_words();
          }));
}

bool matches(std::string_view text, std::string_view pattern) {
  constexpr std::size_t none = std::string_view::npos;
  std::size_t in_text = 0, in_pattern = 0;
  // The last * of the pattern so far, and the place in the text from which on the rest of the
  // pattern is tried. An earlier * need not be tried again, because the last * can skip the same.
  std::size_t star = none, tried = 0;
  while (in_text < text.size()) {
    if (in_pattern < pattern.size() && pattern[in_pattern] == '*') {
      star = in_pattern++;
      tried = in_text;
    } else if (in_pattern < pattern.size() && pattern[in_pattern] == text[in_text]) {
      ++in_pattern;
      ++in_text;
    } else if (star != none && text[tried] != '/') {
      in_pattern = star + 1;
      in_text = ++tried;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', in_pattern) == none;
}

const std::pair<const std::string, Distribution>* Distribution::entry_for(
    const std::string& value) const {
  auto entry = table.find(value);
  std::ptrdiff_t most_given = -1;  // characters of a matching name that are not *
  if (entry == table.end())
    for (auto one = table.begin(); one != table.end(); ++one) {
      const std::string& name = one->first;
      const std::ptrdiff_t stars = std::ranges::count(name, '*');
      const std::ptrdiff_t given = std::ssize(name) - stars;
      if (stars > 0 && given > most_given && matches(value, name)) entry = one, most_given = given;
    }
  if (entry == table.end()) entry = table.find("default");
  return entry == table.end() ? nullptr : &*entry;
}

std::string Distribution::value(double u, double v) const {
  switch (kind) {
    case Kind::constant: return times.empty() && !plus.empty() ? "0" : "1";
    case Kind::uniform: return value_text(a + (b - a) * u);
    case Kind::log_uniform: return value_text(std::clamp(a * std::pow(b / a, u), a, b));
    case Kind::normal:  // Box-Muller
      return value_text(a +
                        b * std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v));
    case Kind::whole: return value_text(std::min(b, std::ceil(a - 1.0 + (b - a + 1.0) * u)));
    case Kind::choice: {
      const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
      double left = u * (weights.empty() ? static_cast<double>(choices.size()) : sum);
      std::size_t last = 0;
      for (std::size_t i = 0; i < choices.size(); ++i) {
        const double weight = weights.empty() ? 1.0 : weights[i];
        if (weight == 0.0) continue;
        last = i;
        if ((left -= weight) <= 0.0) break;
      }
      return choices[last];
    }
    case Kind::table:
    case Kind::unset: break;
  }
  return "";
}

double stratified_number(std::uint32_t index, std::uint32_t order_seed, std::uint32_t digit_seed) {
  const std::uint32_t placed = scrambled(index, order_seed);
  return (static_cast<double>(scrambled(reversed(placed), digit_seed)) + 1.0) * 0x1p-32;
}

std::string value_text(double number) { return fmt::format("{}", number == 0.0 ? 0.0 : number); }

}  // namespace ensonify::engine
