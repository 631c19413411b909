#include <ensonify/engine/dataset/recipe_text.h>

#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/manifest.h>

namespace ensonify::engine {

std::uint64_t key_number(std::string_view key) {
  const std::string digits = xxh128(key);
  std::uint64_t number = 0;
  std::from_chars(digits.data(), digits.data() + 16, number, 16);
  return number;
}

double stratified(const RandomStream& stream, std::uint64_t index) {
  std::array<double, 2> seeds{};
  stream.uniform(seeds);
  const auto seed = [](double u) { return static_cast<std::uint32_t>(u * 0xffffffffp0); };
  return stratified_number(static_cast<std::uint32_t>(index), seed(seeds[0]), seed(seeds[1]));
}

const std::string& SampleDraws::value(const std::string& key, const std::string& asked_by) {
  if (const auto known = known_.find(key); known != known_.end()) {
    if (const std::optional<std::string>& value = known->second) return *value;
    throw SceneError(
        fmt::format("{}: '{}' depends on itself through other keys (circular reference)",
                    text_.distributions.find(key)->second.place, key));
  }
  if (const auto plain = text_.values.find(key); plain != text_.values.end()) return plain->second;
  const auto found = text_.distributions.find(key);
  if (found == text_.distributions.end())
    throw SceneError(fmt::format(
        "{}: the recipe gives no value to '{}', which is needed here: add it", asked_by, key));
  if (open_ == most_levels)
    throw SceneError(fmt::format(
        "{}: more than {} keys depend on each other one after the other; give this one a value",
        found->second.place, most_levels));
  known_[key] = std::nullopt;
  ++open_;
  std::string drawn = draw(key, found->second, key);
  --open_;
  return known_[key].emplace(std::move(drawn));
}

double SampleDraws::number(const std::string& key, const Distribution& d) {
  const std::string& text = value(key, d.place);
  const std::optional number = number_in<double>(text);
  if (!number) {
    const auto distribution = text_.distributions.find(key);
    const bool overridden =
        distribution != text_.distributions.end() && distribution->second.place.starts_with("-D ");
    throw SceneError(fmt::format("{}: '{}' is {}, expected a number here",
                                 overridden ? distribution->second.place : d.place, key,
                                 text.empty() ? "left out" : text));
  }
  return *number;
}

/// Draws a key's value from d. `stream_name` is the key's name, followed by the names of the
/// entries of tables that lead to d.
std::string SampleDraws::draw(const std::string& stream_name, const Distribution& d,
                              const std::string& key) {
  if (d.kind == Distribution::Kind::table) {
    const std::string by = plain_text(value(d.by, d.place));
    const auto* entry = d.entry_for(by);
    if (!entry)
      throw SceneError(
          fmt::format("{}: the table has no entry for {} = {}, and no default", d.place, d.by, by));
    return adjusted(draw(stream_name + "." + entry->first, entry->second, key), d);
  }
  const bool bed = text_.of_seafloor.contains(key);
  const std::size_t number = bed ? seafloor_ : sample_;
  const bool each_render = in_table(key, "display");
  const std::size_t render = each_render ? render_ : 0;
  const RandomStream stream(text_.seed, Purpose::recipe, {key_number(stream_name), number, render});
  std::array<double, 2> u{};
  stream.uniform(u);
  if (d.stratified) {
    const RandomStream seeds(text_.seed, Purpose::recipe,
                             {key_number(stream_name), ~std::uint64_t{0}, 0});
    u[0] = stratified(seeds, each_render ? number * text_.renders + render : number);
  }
  std::string drawn = d.value(u[0], u[1]);
  const auto lies_between = [&] {
    const std::optional value = number_in<double>(drawn);
    return value && *value >= d.between->first && *value <= d.between->second;
  };
  // This ends soon, because the reader refuses a range in which hardly any draw lies.
  for (std::uint64_t again = 1; d.between && !lies_between(); ++again) {
    stream.uniform(u, 2 * again);
    drawn = d.value(u[0], u[1]);
  }
  return adjusted(std::move(drawn), d);
}

/// The drawn value times the values of the keys in `times`, plus those of the keys in `plus`.
std::string SampleDraws::adjusted(std::string drawn, const Distribution& d) {
  if ((d.times.empty() && d.plus.empty()) || drawn.empty()) return drawn;
  const std::optional number_drawn = number_in<double>(drawn);
  if (!number_drawn)
    throw SceneError(fmt::format("{}: {} is drawn, expected a number here", d.place, drawn));
  double result = *number_drawn;
  for (const std::string& key : d.times) result *= number(key, d);
  for (const std::string& key : d.plus) result += number(key, d);
  return value_text(d.kind == Distribution::Kind::whole ? std::round(result) : result);
}

}  // namespace ensonify::engine
