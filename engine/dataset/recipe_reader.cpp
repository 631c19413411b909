#include <ensonify/engine/dataset/recipe_text.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/toml_value.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/refine/printable.h>
#include <ensonify/scatter/nearest_names.h>

namespace ensonify::engine {
namespace {

constexpr std::array<std::string_view, 13> words{
    "uniform", "log_uniform", "normal", "int",   "choice", "weights",   "between",
    "times",   "plus",        "by",     "table", "unset",  "stratified"};

// The least share of a normal distribution's draws that must lie in `between`, because a draw is
// repeated until it lies in `between`.
constexpr double least_share_between = 1e-3;

// Whole numbers are drawn as doubles. Beyond this number, two whole numbers can be the same double.
constexpr double most_drawn = 0x1p53 - 1.0;

bool is_word(std::string_view key) { return std::ranges::count(words, key) > 0; }

/// A value as TOML; empty if the node is not a value.
std::string text_of(const toml::node& node) {
  if (const auto* value = node.as_string()) return toml_string(value->get());
  if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  const toml::array* array = node.as_array();
  if (!array) return "";
  std::string text;
  for (const toml::node& element : *array) {
    const std::string inner = text_of(element);
    if (inner.empty()) return "";
    text += (text.empty() ? "" : ", ") + inner;
  }
  return fmt::format("[{}]", text);
}

class RecipeReader {
 public:
  RecipeReader(std::string_view name, const std::filesystem::path& data_folder)
      : name_(name), data_folder_(data_folder) {}

  RecipeText read(std::string_view text, std::span<const std::string> overrides) {
    read_table(parse(text), "");
    for (const std::string& override_text : overrides) {
      override_ = place_of_override(override_text);
      read_table(parse(toml_override(override_text)), "");
    }
    return std::move(result_);
  }

 private:
  toml::table parse(std::string_view text) const {
    try {
      return parse_toml(text);
    } catch (const toml::parse_error& error) {
      throw SceneError(fmt::format("{}: {}", place(error.source()), error.description()));
    }
  }

  std::string place(const toml::source_region& region) const {
    if (!override_.empty()) return override_;
    return fmt::format("{}:{}:{}", name_, region.begin.line, region.begin.column);
  }
  SceneError fault(const toml::node& node, std::string_view message) const {
    return SceneError(fmt::format("{}: {}", place(node.source()), message));
  }
  SceneError fault(const toml::node& node, const std::string& path,
                   std::string_view message) const {
    return fault(node, fmt::format("'{}': {}", path, message));
  }

  void read_table(const toml::table& table, const std::string& path) {
    for (const auto& [key, node] : table) {
      const std::string inner =
          path.empty() ? std::string(key.str()) : path + "." + std::string(key.str());
      if (inner != "dataset") read(node, inner);
    }
  }

  void read(const toml::node& node, const std::string& path) {
    if (const toml::table* table = node.as_table()) {
      const bool drawn =
          std::ranges::any_of(*table, [](const auto& entry) { return is_word(entry.first.str()); });
      if (drawn && path == "seed")
        throw fault(node, "'seed' is that of all draws, expected a whole number");
      if (!drawn && table->size() == 1 && table->begin()->second.is_array()) {
        const std::string_view word = table->begin()->first.str();
        const std::string near =
            scatter::suggestion(word, std::vector<std::string>(words.begin(), words.end()));
        if (!near.empty())
          throw fault(node, path,
                      fmt::format("unknown distribution {}{}", toml_string(word), near));
      }
      if (drawn)
        draw(path, distribution(*table, path));
      else
        read_table(*table, path);
    } else if (const toml::array* array = node.as_array(); array && array->is_array_of_tables()) {
      std::size_t& tables = result_.lists[path];  // an override may have fewer than the text
      tables = std::max(tables, array->size());
      for (std::size_t i = 0; i < array->size(); ++i)
        read((*array)[i], fmt::format("{}.{}", path, i));
    } else if (path == "seed") {
      if (node.is_integer()) result_.seed = static_cast<std::uint64_t>(node.as_integer()->get());
      result_.values[path] = text_of(node);
    } else if (std::vector<std::string> values = values_of(node);
               !override_.empty() || values.size() > 1 || values.front() != text_of(node)) {
      if (values.front().empty()) throw fault(node, path, "expected a value or a distribution");
      Distribution d;
      d.place = place(node.source());
      d.kind = Distribution::Kind::choice;
      d.choices = std::move(values);
      draw(path, std::move(d));
    } else if (node.is_value()) {
      result_.values[path] = values.front();
      result_.has_seafloor_seed |= path == "seafloor.seed";
    }
  }

  void draw(const std::string& path, Distribution d) {
    result_.values.erase(path);
    result_.distributions.insert_or_assign(path, std::move(d));
    if (!override_.empty() && !path.starts_with("draw.") && !path.ends_with(".present"))
      result_.overridden.insert(path);
  }

  /// The value as TOML. For a file data:PATH with a *: the files that match it.
  std::vector<std::string> values_of(const toml::node& node) {
    const auto* text = node.as_string();
    if (!text || !text->get().starts_with(data_prefix) ||
        text->get().find('*') == std::string::npos)
      return {text_of(node)};
    std::vector<std::string> files = files_like(node, text->get());
    for (std::string& file : files) file = toml_string(file);
    return files;
  }

  std::vector<std::string> files_like(const toml::node& node, const std::string& pattern) {
    const std::string_view path = std::string_view(pattern).substr(data_prefix.size());
    // Length of the folder before the first *, with its slash.
    const std::size_t fixed = path.substr(0, path.find('*')).rfind('/') + 1;
    const std::filesystem::path folder = data_folder_ / path.substr(0, fixed);
    const auto depth = static_cast<int>(std::ranges::count(path.substr(fixed), '/'));
    std::vector<std::string> files;
    std::error_code error, unknown;
    std::filesystem::recursive_directory_iterator entry, end;
    if (!data_folder_.empty()) entry = std::filesystem::recursive_directory_iterator(folder, error);
    for (; !error && entry != end; entry.increment(error)) {
      const std::string name = entry->path().lexically_relative(data_folder_).generic_string();
      if (entry.depth() == depth) entry.disable_recursion_pending();
      if (!matches(name, path) || !entry->is_regular_file(unknown)) continue;
      if (!refine::is_utf8(name))
        throw fault(node,
                    fmt::format("{} matches {}, a name that is not UTF-8 as TOML is: rename it",
                                toml_string(pattern), name));
      files.push_back(std::string(data_prefix) + name);
    }
    if (files.empty())
      throw fault(node, fmt::format("{} matches no file{}", toml_string(pattern),
                                    data_folder_.empty() ? ": give the data folder, with --data DIR"
                                                         : " in " + data_folder_.string()));
    std::ranges::sort(files);
    return files;
  }

  Distribution distribution(const toml::table& table, const std::string& path) {
    Distribution d;
    d.place = place(table.source());
    int kinds = 0;
    for (const auto& [key, node] : table) {
      if (!is_word(key.str()))
        throw SceneError(fmt::format(
            "{}: unknown word {} in the distribution of '{}'{}", place(key.source()),
            toml_string(key.str()), path,
            scatter::suggestion(key.str(), std::vector<std::string>(words.begin(), words.end()))));
      const std::string_view word = key.str();
      if (word == "uniform") {
        ++kinds, ends(node, path, word, d, Distribution::Kind::uniform);
      } else if (word == "log_uniform") {
        ++kinds, ends(node, path, word, d, Distribution::Kind::log_uniform);
        if (!(d.a > 0.0))
          throw fault(node, path,
                      fmt::format("log_uniform begins at {}, expected more than 0", d.a));
      } else if (word == "normal") {
        ++kinds, ends(node, path, word, d, Distribution::Kind::normal);
      } else if (word == "int") {
        ++kinds, ends(node, path, word, d, Distribution::Kind::whole);
        if (d.a != std::floor(d.a) || d.b != std::floor(d.b))
          throw fault(node, path, "expected whole numbers, int = [2, 5]");
        if (d.a < -most_drawn || d.b > most_drawn)
          throw fault(node, path,
                      fmt::format("expected whole numbers from {0:.0f} to {1:.0f}, int = [2, 5]; "
                                  "a choice can have others",
                                  -most_drawn, most_drawn));
      } else if (word == "choice") {
        ++kinds, choices(node, path, d);
      } else if (word == "table") {
        ++kinds, entries(node, path, d);
      } else if (word == "unset") {
        ++kinds;
        d.kind = Distribution::Kind::unset;
        if (!node.is_boolean() || !node.as_boolean()->get())
          throw fault(node, path, "expected unset = true");
      } else if (word == "weights") {
        for (const double weight : numbers(node, path, word)) d.weights.push_back(weight);
      } else if (word == "between") {
        const auto both = numbers(node, path, word);
        if (both.size() != 2 || !(both[0] < both[1]))
          throw fault(node, path, "expected between = [least, most]");
        d.between = {both[0], both[1]};
      } else if (word == "times") {
        d.times = keys(node, path, word);
      } else if (word == "plus") {
        d.plus = keys(node, path, word);
      } else if (word == "by") {
        if (!node.is_string()) throw fault(node, path, "expected by = \"KEY\"");
        d.by = node.as_string()->get();
      } else if (word == "stratified") {
        if (!node.is_boolean()) throw fault(node, path, "expected stratified = true");
        d.stratified = node.as_boolean()->get();
      }
    }
    check(d, kinds, table, path);
    return d;
  }

  void check(const Distribution& d, int kinds, const toml::table& table, const std::string& path) {
    using Kind = Distribution::Kind;
    const auto require = [&](bool holds, std::string_view message) {
      if (!holds) throw fault(table, path, message);
    };
    require(
        kinds <= 1,
        "more than one distribution, expected one of uniform, log_uniform, normal, int, choice, "
        "table, unset");
    require(kinds == 1 || !d.times.empty() || !d.plus.empty(),
            "no distribution, expected one of uniform, log_uniform, normal, int, choice, table, "
            "unset, times, plus");
    require(d.by.empty() == (d.kind != Kind::table),
            "by = \"KEY\" and table = { ... } belong together");
    require(d.weights.empty() || d.kind == Kind::choice, "weights belong to a choice");
    require(d.weights.empty() || d.weights.size() == d.choices.size(),
            "expected as many weights as there are choices");
    double sum = 0.0;
    for (const double weight : d.weights) {
      require(weight >= 0.0, "weights are expected to be 0 or more");
      sum += weight;
    }
    require(d.weights.empty() || sum > 0.0, "expected at least one weight above 0");
    require(!d.between || d.kind == Kind::normal, "between belongs to normal");
    if (d.between && d.share_between() < least_share_between)
      throw fault(table, path,
                  fmt::format("hardly any draw lies between {} and {}, expected a share "
                              "of {} or more; widen this range",
                              d.between->first, d.between->second, least_share_between));
    require(!d.stratified || (d.kind != Kind::normal && d.kind != Kind::table &&
                              d.kind != Kind::unset && d.kind != Kind::constant),
            "stratified belongs to uniform, log_uniform, int or choice");
  }

  std::vector<double> numbers(const toml::node& node, const std::string& path,
                              std::string_view word) {
    const toml::array* array = node.as_array();
    std::vector<double> all;
    if (array)
      for (const toml::node& element : *array) {
        const std::optional number = number_of(element);
        if (!number || !std::isfinite(*number)) break;
        all.push_back(*number);
      }
    if (!array || all.size() != array->size())
      throw fault(node, path, fmt::format("expected numbers, {} = [1, 2]", word));
    return all;
  }

  void ends(const toml::node& node, const std::string& path, std::string_view word, Distribution& d,
            Distribution::Kind kind) {
    const std::vector<double> both = numbers(node, path, word);
    const bool fit = both.size() == 2 &&
                     (kind == Distribution::Kind::normal ? both[1] >= 0.0 : both[0] <= both[1]);
    if (both.size() == 2 && !fit && kind != Distribution::Kind::normal)
      throw fault(node, path,
                  fmt::format("{} begins at {}, above its end at {}", word, both[0], both[1]));
    if (!fit)
      throw fault(
          node, path,
          fmt::format("expected {} = [{}]", word,
                      kind == Distribution::Kind::normal ? "mean, deviation" : "least, most"));
    d.kind = kind;
    d.a = both[0];
    d.b = both[1];
  }

  void choices(const toml::node& node, const std::string& path, Distribution& d) {
    d.kind = Distribution::Kind::choice;
    if (const toml::array* array = node.as_array())
      for (const toml::node& element : *array) {
        const std::vector<std::string> values = values_of(element);
        if (values.size() > 1 && array->size() > 1)
          throw fault(element, path,
                      "a * that matches several files is a choice by "
                      "itself: it expects no others next to it");
        d.choices.insert(d.choices.end(), values.begin(), values.end());
      }
    if (d.choices.empty() || std::ranges::count(d.choices, "") > 0)
      throw fault(node, path, "expected values, choice = [\"a\", \"b\"]");
  }

  void entries(const toml::node& node, const std::string& path, Distribution& d) {
    d.kind = Distribution::Kind::table;
    const toml::table* table = node.as_table();
    if (!table || table->empty())
      throw fault(node, path,
                  "expected a value for each of the other key's, table = { a = 1, b = 2 }");
    for (const auto& [key, entry] : *table) {
      const std::string value(key.str());
      if (const toml::table* inner = entry.as_table()) {
        d.table.emplace(value, distribution(*inner, path));
        if (d.table[value].stratified)
          throw fault(entry, path, "a table's entries cannot be stratified");
        continue;
      }
      Distribution& one = d.table[value];
      one.kind = Distribution::Kind::choice;
      one.choices = values_of(entry);
      if (one.choices.front().empty())
        throw fault(entry, path, "expected a value or a distribution");
    }
  }

  std::vector<std::string> keys(const toml::node& node, const std::string& path,
                                std::string_view word) {
    std::vector<std::string> all;
    if (const auto* one = node.as_string()) all.push_back(one->get());
    if (const toml::array* array = node.as_array())
      for (const toml::node& element : *array)
        if (const auto* one = element.as_string()) all.push_back(one->get());
    if (all.empty() || (node.is_array() && all.size() != node.as_array()->size()))
      throw fault(node, path,
                  fmt::format("expected another key, {} = \"sonar.NAME.range_m\"", word));
    return all;
  }

  std::string name_;
  const std::filesystem::path& data_folder_;
  std::string override_;  // place of the override that is being read; empty: the text is being read
  RecipeText result_;
};

}  // namespace

RecipeText parse_recipe_text(std::string_view text, std::string_view name,
                             const std::filesystem::path& data_folder,
                             std::span<const std::string> overrides) {
  return RecipeReader(name, data_folder).read(text, overrides);
}

std::string plain_text(const std::string& value) {
  if (!value.starts_with('"')) return value;
  return parse_toml("text = " + value)["text"].value_or(std::string());
}

bool in_table(std::string_view key, std::string_view table) {
  return key.starts_with(table) && (key.size() == table.size() || key[table.size()] == '.');
}

}  // namespace ensonify::engine
