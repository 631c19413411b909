#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>

namespace ensonify::engine {
namespace {

using json = nlohmann::ordered_json;

json number(const Range& range) {
  return {{"type", "number"}, {"minimum", range.low}, {"maximum", range.high}};
}

json list_of(const json& items) { return {{"type", "array"}, {"items", items}}; }

json whole_number(const Range& range) {
  return {{"type", "integer"},
          {"minimum", whole_limit(range.low)},
          {"maximum", whole_limit(range.high)}};
}

/// Any text, or one of the words. Of each word also the form with - and _ exchanged, since the
/// reader accepts both.
json text(const std::vector<std::string_view>& choices) {
  if (choices.empty()) return {{"type", "string"}};
  json list = json::array();
  for (const std::string_view choice : choices) {
    list.push_back(choice);
    for (const auto& [from, to] : {std::pair('-', '_'), std::pair('_', '-')}) {
      std::string other(choice);
      std::ranges::replace(other, from, to);
      if (other != choice) list.push_back(other);
    }
  }
  return {{"type", "string"}, {"enum", list}};
}

/// The schema of the values that a key accepts; expectation() states the same in words.
json value_schema(const ConstOption& option, const Range& range,
                  const std::vector<std::string_view>& choices) {
  return std::visit(
      [&](const auto* value) -> json {
        using T = std::remove_cvref_t<decltype(*value)>;
        if constexpr (std::is_same_v<T, bool>)
          return {{"type", "boolean"}};
        else if constexpr (std::is_same_v<T, int> || std::is_same_v<T, std::uint64_t> ||
                           std::is_same_v<T, std::optional<std::uint64_t>>)
          return whole_number(range);
        else if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::optional<double>>)
          return number(range);
        else if constexpr (std::is_same_v<T, std::vector<double>>)
          return list_of(number(range));
        else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>)
          return list_of(
              {{"type", "array"}, {"items", number(range)}, {"minItems", 2}, {"maxItems", 2}});
        else if constexpr (std::is_same_v<T, std::vector<std::string>>)
          return list_of(text(choices));
        else
          return text(choices);
      },
      option);
}

/// Writes the schema of a scene or of a recipe. In a recipe, any value may be a distribution.
class SchemaWriter {
 public:
  explicit SchemaWriter(bool recipe) : recipe_(recipe) {}

  json whole() {
    json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                   {"title", recipe_ ? "ensonify dataset recipe" : "ensonify scene"},
                   {"type", "object"},
                   {"required", json::array({"version"})},
                   {"additionalProperties", false}};
    schema["properties"]["version"] = {{"const", 1}};
    if (recipe_) {
      schema["required"].push_back("dataset");
      for (const auto& section : dataset_sections())
        add_keys(table(schema, section.name, section.help), section, DatasetOptions{}, false);
      schema["properties"]["draw"] = {
          {"type", "object"},
          {"description", "Keys that you define for distributions to refer to."}};
    }
    const Scene scene;
    for (const auto& section : scene_sections())
      add_keys(table(schema, section.name, section.help), section, scene, recipe_);
    add_named(schema, "material", material_section());
    add_named(schema, "sonar", sonar_section());
    for_each_list(scene, [&]<class Item>(const Section<Item>& section, const std::vector<Item>&) {
      const std::size_t dot = section.name.rfind('.');
      const bool inside = dot != std::string_view::npos;
      json& owner = inside ? table(schema, section.name.substr(0, dot), "") : schema;
      json& list = owner["properties"][inside ? section.name.substr(dot + 1) : section.name];
      list = {{"type", "array"}, {"description", section.help}, {"items", item(section)}};
      if (recipe_) list["items"]["properties"]["present"] = true;
    });
    return schema;
  }

 private:
  /// The schema of the table with a dotted name. Tables that are missing are made.
  static json& table(json& schema, std::string_view name, std::string_view help) {
    json* at = &schema;
    while (!name.empty()) {
      const std::size_t dot = name.find('.');
      json& next = (*at)["properties"][name.substr(0, dot)];
      next["type"] = "object";
      next["additionalProperties"] = false;
      at = &next;
      name = dot == std::string_view::npos ? "" : name.substr(dot + 1);
    }
    if (at != &schema && !help.empty()) (*at)["description"] = help;
    return *at;
  }

  template <class Owner>
  static void add_keys(json& to, const Section<Owner>& section, const Owner& owner, bool drawn) {
    for (const Key<Owner>& key : section.keys) {
      json value = value_schema(key.option(owner), key.range, key.choices);
      json& property = to["properties"][key.name];
      if (drawn)  // or a distribution
        property["anyOf"] = json::array({std::move(value), {{"type", "object"}}});
      else
        property = std::move(value);
      property["description"] = help_text(key);
    }
  }

  template <class Owner>
  json item(const Section<Owner>& section) const {
    json schema = {{"type", "object"}, {"additionalProperties", false}};
    add_keys(schema, section, Owner{}, recipe_);
    return schema;
  }

  /// Adds the schema of tables [kind.NAME].
  template <class Owner>
  void add_named(json& schema, std::string_view kind, const Section<Owner>& section) const {
    schema["properties"][kind] = {{"type", "object"},
                                  {"description", section.help},
                                  {"patternProperties", {{"^[A-Za-z0-9_-]+$", item(section)}}},
                                  {"additionalProperties", false}};
  }

  bool recipe_;
};

}  // namespace

std::string json_schema(bool recipe) { return SchemaWriter(recipe).whole().dump(2) + "\n"; }

}  // namespace ensonify::engine
