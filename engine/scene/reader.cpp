#include <ensonify/engine/scene/reader.h>

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene/checks/name_check.h>
#include <ensonify/engine/scene/conditions.h>
#include <ensonify/engine/scene/keys/dataset_options.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/keys/toml_value.h>
#include <ensonify/engine/scene/tables/strength_table_reader.h>
#include <ensonify/engine/seafloor/bed/survey_formats.h>
#include <ensonify/engine/sonar/instrument/presets.h>
#include <ensonify/refine/printable.h>
#include <ensonify/refine/read_file.h>
#include <ensonify/refine/standard_floats.h>
#include <ensonify/scatter/kind_named.h>
#include <ensonify/scatter/nearest_names.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_file_bytes = 1 << 20;

std::string joined(std::string_view section, std::string_view name) {
  return section.empty() ? std::string(name) : fmt::format("{}.{}", section, name);
}

/// The names of keys or of owners.
template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : all) names.emplace_back(one.name);
  return names;
}

/// Fills a scene from TOML tables, and stores the place of each key.
class Reader {
 public:
  explicit Reader(std::string name, const DrawnValues* drawn = nullptr)
      : source_(std::move(name)), name_(source_), drawn_(drawn) {}

  /// Reads the text of a file, then applies overrides.
  Reader& read(std::string_view text, std::span<const std::string> overrides) {
    const toml::table table = parse(text);
    require_no_recipe(table);
    const toml::node* version = table.get("version");
    if (!version)
      throw SceneError(fmt::format("{}:1:1: no 'version', expected version = 1 at the top", name_));
    if (const toml::table* sonars = table["sonar"].as_table()) {
      scene_.sonars = named<Sonar>(*sonars, "sonar");
      if (scene_.sonars.empty()) throw fault(*sonars, "'sonar' is empty, expected [sonar.NAME]");
      for (const auto& [key, node] : *sonars)
        if (const auto wrong = fault_of_file_names(key.str(), scene_.sonars))
          throw fault(key, *wrong);
    }
    if (const toml::table* materials = table["material"].as_table())
      scene_.materials = named<Material>(*materials, "material");
    read_table(table, "");
    for (const std::string& override_text : overrides) {
      overrides_.push_back(override_text);
      const toml::table changed = parse_override(override_text);
      require_no_recipe(changed);
      read_table(changed, "");
    }
    return *this;
  }

  DatasetOptions read_dataset(std::string_view text, std::span<const std::string> overrides) {
    const toml::table file = parse(text);
    const toml::node* node = file.get("dataset");
    if (!node)
      throw SceneError(fmt::format(
          "{}:1:1: no [dataset], expected a recipe: a scene with a [dataset] table", name_));
    DatasetOptions options;
    read_dataset(expect_table(*node, "dataset"), "dataset", options);
    for (const std::string& override_text : overrides) {
      const toml::table changed = parse_override(override_text);
      if (const toml::node* changes = changed.get("dataset"))
        read_dataset(expect_table(*changes, "dataset"), "dataset", options);
    }
    return options;
  }

  Scene unchecked() {
    take_defaults();
    return taken();
  }

  Scene finish(const ScenePaths& paths, std::span<const Material> known = {}) {
    const auto place = [&](std::string_view key) {
      const auto found = places_.find(key);
      return found == places_.end() ? name_ : found->second;
    };
    const auto find_file = [&](std::string_view key, InputFile& file) {
      if (file.name.empty() || !file.path.empty()) return;
      try {
        file.path = resolve(key, file.name, paths);
      } catch (const SceneError& error) {
        throw SceneError(fmt::format("{}: {}", place(key), error.what()));
      }
    };
    take_defaults();
    for (Material& material : scene_.materials) {  // their check needs their tables
      find_file(fmt::format("material.{}.table", material.name), material.table);
      if (!material.table.path.empty())
        material.measured = read_strength_table(material.table.path);
    }
    scene_.materials.insert(scene_.materials.end(), known.begin(), known.end());
    try {
      check_scene(scene_, place);
      for_each_file(scene_, find_file);
      check_seabed_files(scene_, place);
    } catch (const SceneError& error) {
      // The key at this place of the file may be right, but contradict the key of an override.
      const std::string_view message = error.what();
      if (message.starts_with("-D ")) throw;
      throw SceneError(fmt::format("{}{}", message, with_overrides(overrides_)));
    }
    Scene scene = taken();
    if (!drawn_) scene.warnings = unused_keys(scene);  // samples of a recipe may use different keys
    return scene;
  }

 private:
  Scene taken() {
    scene_.places = std::move(places_);
    return std::move(scene_);
  }

  toml::table parse(std::string_view text) const {
    try {
      return parse_toml(text);
    } catch (const toml::parse_error& error) {
      throw SceneError(fmt::format("{}: {}", place(error.source()), error.description()));
    }
  }

  /// The tables of an override; faults found from now on are at this override.
  toml::table parse_override(const std::string& override_text) {
    source_ = place_of_override(override_text);
    in_file_ = false;
    return parse(toml_override(override_text));
  }

  std::string place(const toml::source_region& region) const {
    return in_file_ ? fmt::format("{}:{}:{}", source_, region.begin.line, region.begin.column)
                    : source_;
  }
  template <class Node>
  SceneError fault(const Node& node, std::string_view message) const {
    return SceneError(fmt::format("{}: {}", place(node.source()), message));
  }

  /// Throws SceneError for a recipe. Called before keys are read, because a distribution would be
  /// refused as a wrong value.
  void require_no_recipe(const toml::table& table) const {
    if (drawn_) return;
    for (const auto& [key, node] : table)
      if (key == "dataset" || key == "draw")
        throw fault(key,
                    "this is a dataset's recipe, expected a scene: `ensonify generate` takes it");
  }

  void read_table(const toml::table& table, const std::string& section_name) {
    for (const auto& [key, node] : table) {
      const std::string path = joined(section_name, key.str());
      if (key.str().find('.') != std::string_view::npos) {  // a name in quotes, not a path
        throw unknown(key, section_name, known_names(section_name));
      } else if (path == "version") {
        if (!node.is_integer() || node.as_integer()->get() != 1)
          throw fault(node, fmt::format("'version' is {}, expected 1, the only version",
                                        description(node)));
      } else if (path == "dataset" || path == "draw") {  // Recipe reads these
      } else if (path == "sonar") {
        read_named(node, "sonar", sonar_section(), scene_.sonars);
      } else if (path == "material") {
        read_named(node, "material", material_section(), scene_.materials);
      } else if (read_list(node, path)) {
      } else if (const auto* row = find_key(section_name, key.str())) {
        set(*row, scene_, node, path);
      } else if (std::ranges::any_of(scene_sections(),
                                     [&](const auto& s) { return s.name == path; })) {
        read_table(expect_table(node, path), path);
      } else {
        throw unknown(key, section_name, known_names(section_name));
      }
    }
  }

  void read_dataset(const toml::table& table, const std::string& name, DatasetOptions& options) {
    const auto section = [&](std::string_view wanted) {
      return std::ranges::find(dataset_sections(), wanted, &Section<DatasetOptions>::name);
    };
    const auto& keys = section(name)->keys;
    for (const auto& [key, node] : table) {
      const std::string path = joined(name, key.str());
      const auto row = std::ranges::find(keys, key.str(), &Key<DatasetOptions>::name);
      if (row != keys.end()) {
        set(*row, options, node, path);
      } else if (section(path) != dataset_sections().end()) {
        read_dataset(expect_table(node, path), path, options);
      } else {
        std::vector<std::string> here = names_of(keys);
        for (const auto& s : dataset_sections())
          if (s.name.starts_with(name + ".")) here.emplace_back(s.name.substr(name.size() + 1));
        throw unknown(key, name, std::move(here));
      }
    }
  }

  /// One owner for each table of `tables`, in the file's order, which toml++ does not keep.
  template <class Owner>
  std::vector<Owner> named(const toml::table& tables, std::string_view kind) const {
    std::vector<std::pair<toml::source_position, std::string>> order;
    for (const auto& [key, node] : tables) order.emplace_back(key.source().begin, key.str());
    std::ranges::stable_sort(order, [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Owner> owners;
    for (auto& [position, name] : order) {
      if (const auto wrong = fault_of_name(kind, name))
        throw fault(tables.find(name)->first, *wrong);
      owners.emplace_back().name = std::move(name);
    }
    return owners;
  }

  template <class Owner>
  void read_named(const toml::node& node, std::string_view kind, const Section<Owner>& section,
                  std::vector<Owner>& owners) {
    for (const auto& [name, table] : expect_table(node, section.name)) {
      const std::string path = joined(kind, name.str());
      if (!table.is_table() &&
          std::ranges::count(section.keys, name.str(), &Key<Owner>::name) > 0) {
        const std::string_view whose = in_file_ ? "NAME" : std::string_view(owners.front().name);
        throw fault(name, fmt::format("'{}' does not say which {}, expected {}.{}.{}", path, kind,
                                      kind, whose, name.str()) +
                              (in_file_ ? fmt::format(", in a table [{}.NAME]", kind) : ""));
      }
      const auto owner = std::ranges::find(owners, name.str(), &Owner::name);
      if (owner == owners.end()) {  // only an override can name an owner that is not in the file
        const std::vector<std::string> names = names_of(owners);
        throw fault(
            name, fmt::format("the scene has no {} {}", kind, quoted_toml(name.str())) +
                      (names.empty() ? fmt::format("; define it in the file, as [{}.NAME]", kind)
                                     : fmt::format(", expected one of {}{}", fmt::join(names, ", "),
                                                   scatter::suggestion(name.str(), names))));
      }
      if (in_file_) places_.insert_or_assign(path, place(name.source()));
      read_keys(section, *owner, expect_table(table, path), path);
    }
  }

  /// Sets the keys that were not given to the values that the scene's conditions and presets imply.
  void take_defaults() {
    Scene from;
    from.conditions = scene_.conditions;
    from.track.kind = scene_.track.kind;
    from.sonars.clear();
    for (const Sonar& sonar : scene_.sonars) {
      from.sonars.push_back(sonar.preset.empty() ? usual_sonar(sonar.kind)
                                                 : preset_sonar(sonar.preset));
      from.sonars.back().vertical.file = sonar.vertical.file;
    }
    // A ping of an imaging sonar is a picture of its own, and large.
    if (std::ranges::all_of(from.sonars, &Sonar::steers)) from.track.pings = 20;
    use_conditions(from);
    for (const auto& section : scene_sections()) take_keys(section, from, scene_, section.name);
    for (std::size_t i = 0; i < scene_.sonars.size(); ++i)
      take_keys(sonar_section(), from.sonars[i], scene_.sonars[i],
                joined("sonar", scene_.sonars[i].name));
  }
  template <class Owner>
  void take_keys(const Section<Owner>& section, Owner& from, Owner& to, std::string_view path) {
    for (const Key<Owner>& key : section.keys) {
      if (places_.contains(joined(path, key.name))) continue;
      const Option value = key.option(from);
      std::visit([&](auto* option) { *option = *std::get<decltype(option)>(value); },
                 key.option(to));
    }
  }

  /// Reads a list of tables, if `path` is the name of one. Returns whether it is.
  bool read_list(const toml::node& node, const std::string& path) {
    bool found = false;
    for_each_list(scene_, [&](const auto& section, auto& list) {
      if (section.name != path) return;
      found = true;
      read_list(node, section, list);
    });
    return found;
  }

  // A file has an array of tables. An override names one of these tables by its number:
  // objects.0.height_m.
  template <class Owner>
  void read_list(const toml::node& node, const Section<Owner>& section, std::vector<Owner>& list) {
    if (const toml::array* array = node.as_array(); array && in_file_) {
      for (std::size_t i = 0; i < array->size(); ++i) {
        if (drawn_ && drawn_->absent.contains(fmt::format("{}.{}", section.name, i))) continue;
        const std::string path = fmt::format("{}.{}", section.name, list.size());
        places_.insert_or_assign(path, place((*array)[i].source()));
        read_keys(section, list.emplace_back(),
                  expect_table((*array)[i], fmt::format("[{}]", section.name)), path);
      }
      return;
    }
    const toml::table* numbered = in_file_ ? nullptr : node.as_table();
    if (!numbered)
      throw fault(node,
                  fmt::format("'{}' is {}, expected {}", section.name, description(node),
                              in_file_ ? fmt::format("tables, [[{}]]", section.name)
                                       : fmt::format("one of the scene's tables by its number, as "
                                                     "in {}.0.KEY=VALUE",
                                                     section.name)));
    for (const auto& [number, table] : *numbered) {
      const std::optional i = number_in<std::size_t>(number.str());
      if (!i || *i >= list.size())
        throw fault(
            number,
            list.empty()
                ? fmt::format("the scene has no [[{}]]; add one to the file", section.name)
                : fmt::format("the scene has no {} {}; it has {}, numbered from 0",
                              list_item(section.name), quoted_toml(number.str()), list.size()));
      const std::string path = fmt::format("{}.{}", section.name, *i);
      read_keys(section, list[*i], expect_table(table, path), path);
    }
  }
  static std::string_view list_item(std::string_view section) {
    return section == "objects" ? "object" : section;
  }

  template <class Owner>
  void read_keys(const Section<Owner>& section, Owner& owner, const toml::table& table,
                 const std::string& path) {
    for (const auto& [key, value] : table) {
      if (drawn_ && key.str() == "present") continue;
      const auto row = std::ranges::find(section.keys, key.str(), &Key<Owner>::name);
      if (row == section.keys.end()) throw unknown(key, path, names_of(section.keys));
      set(*row, owner, value, joined(path, key.str()));
    }
  }

  const toml::table& expect_table(const toml::node& node, std::string_view path) const {
    if (const toml::table* table = node.as_table()) return *table;
    throw fault(node,
                fmt::format("'{}' is {}, expected a table, [{}]", path, description(node), path));
  }

  static const Key<Scene>* find_key(std::string_view section_name, std::string_view name) {
    for (const auto& section : scene_sections())
      if (section.name == section_name)
        for (const auto& key : section.keys)
          if (key.name == name) return &key;
    return nullptr;
  }

  /// The names of the keys and tables of a section.
  static std::vector<std::string> known_names(std::string_view section_name) {
    std::vector<std::string> names;
    if (section_name.empty()) names.insert(names.end(), {"sonar", "objects", "material"});
    for (const auto& section : scene_sections()) {
      if (section.name == section_name)
        for (const auto& key : section.keys) names.emplace_back(key.name);
      const std::size_t dot = section.name.rfind('.');
      const std::string_view parent =
          dot == std::string_view::npos ? "" : section.name.substr(0, dot);
      if (!section.name.empty() && parent == section_name)
        names.emplace_back(section.name.substr(dot + 1));
    }
    return names;
  }

  /// The error for an unknown key. It suggests the nearest key of the same section; if there is
  /// none, it lists the section's keys and suggests the nearest key of all sections.
  SceneError unknown(const toml::key& key, std::string_view section_name,
                     std::vector<std::string> here) {
    std::string hint = scatter::suggestion(key.str(), here);
    if (hint.empty()) {
      std::vector<std::string> all;
      const auto add = [&](const auto& section) {
        for (const auto& k : section.keys) all.push_back(joined(section.name, k.name));
      };
      std::ranges::for_each(scene_sections(), add);
      add(sonar_section());
      for_each_list(scene_, [&](const auto& section, const auto&) { add(section); });
      add(material_section());
      if (drawn_) std::ranges::for_each(dataset_sections(), add);
      hint = scatter::suggestion(key.str(), all);
      if (hint.empty() || !section_name.empty())
        hint = fmt::format("; expected one of {}{}", fmt::join(here, ", "), hint);
    }
    return fault(
        key, fmt::format("unknown key {}{}{}", quoted_toml(key.str()),
                         section_name.empty() ? "" : fmt::format(" in [{}]", section_name), hint));
  }

  template <class Owner>
  void set(const Key<Owner>& key, Owner& owner, const toml::node& written,
           const std::string& path) {
    places_.insert_or_assign(path, place(written.source()));
    toml::table drawn;
    if (const std::string* value = drawn_value(path)) {
      if (value->empty()) return;
      drawn = parse("value = " + *value);
    }
    const toml::node& node = drawn.empty() ? written : *drawn.get("value");
    const auto refuse = [&](const std::string& hint = "") {
      return fault(
          written,
          fmt::format(
              "'{}' is {}, expected {}{}{}", path, description(node), expectation(key),
              drawn_ && node.is_table() ? ", or a distribution of it, as { uniform = [1, 2] }" : "",
              hint));
    };
    set_option(key.option(owner), node, {key.range, key.choices, key.in_degrees()}, refuse);
  }

  const std::string* drawn_value(const std::string& path) const {
    if (!drawn_ || !in_file_) return nullptr;
    const auto found = drawn_->values.find(path);
    return found == drawn_->values.end() ? nullptr : &found->second;
  }

  Scene scene_;
  std::map<std::string, std::string, std::less<>> places_;  // places of the keys that were given
  std::string source_;                  // the file or the override that is being read
  const std::string name_;              // the name of the file
  std::vector<std::string> overrides_;  // the overrides that were applied
  const DrawnValues* drawn_;            // values that were drawn for a recipe
  bool in_file_ = true;
};

}  // namespace

std::string read_scene_text(const fs::path& file) {
  refine::require_file<SceneError>(file);
  constexpr std::string_view wanted = "a scene, a TOML file";
  if (const std::optional found = seafloor_file(file))
    throw SceneError(fault_of_kind(file, *found, wanted));
  if (is_recording(file))
    throw SceneError(fmt::format(
        "{}: is a recording, expected {}; `ensonify imitate` makes a scene that looks like it, and "
        "a scene takes its track with kind = \"file\" and file = \"FILE\" in [track]",
        file.string(), wanted));
  std::string text = refine::read_user_file<SceneError>(file, largest_file_bytes);
  if (refine::is_utf16(text))
    throw SceneError(fmt::format("{}: {}", file.string(), refine::utf16_fault));
  return text;
}

std::string toml_override(const std::string& override_text) {
  const auto refuse = [&] {
    return SceneError(fmt::format("{}: expected key=value, as in -D sea.temperature_c=12",
                                  place_of_override(override_text)));
  };
  const std::size_t equals = override_text.find('=');
  if (equals == std::string::npos || equals == 0) throw refuse();
  if (std::ranges::any_of(override_text, [](unsigned char c) { return c < 0x20; }))
    throw SceneError("-D: expected one line of text without control characters");
  const auto is_toml = [&](const std::string& text) {
    try {
      if (parse_toml(text).empty()) throw refuse();
      return true;
    } catch (const toml::parse_error&) {
      return false;
    }
  };
  if (is_toml(override_text)) return override_text;
  return override_text.substr(0, equals + 1) + toml_string(override_text.substr(equals + 1));
}

std::string place_of_override(std::string_view override_text) {
  return "-D " + refine::shortened(override_text, 200);
}

std::string with_overrides(std::span<const std::string> overrides) {
  std::string text;
  for (const std::string& one : overrides)
    text += fmt::format("{} {}", text.empty() ? "; with" : "", place_of_override(one));
  return text;
}

Scene parse_scene(std::string_view text, std::string_view name,
                  std::span<const std::string> overrides, const ScenePaths& paths,
                  std::span<const Material> known) {
  const refine::StandardFloats floats;
  return Reader(std::string(name)).read(text, overrides).finish(paths, known);
}

Scene parse_recipe(std::string_view text, std::string_view name, const DrawnValues& drawn,
                   const ScenePaths& paths) {
  return Reader(std::string(name), &drawn).read(text, drawn.overrides).finish(paths);
}

Scene parse_recipe_unchecked(std::string_view text, std::string_view name,
                             const DrawnValues& drawn) {
  return Reader(std::string(name), &drawn).read(text, drawn.overrides).unchecked();
}

DatasetOptions parse_dataset_options(std::string_view text, std::string_view name,
                                     std::span<const std::string> overrides) {
  return Reader(std::string(name)).read_dataset(text, overrides);
}

Scene read_scene(const fs::path& file, std::span<const std::string> overrides,
                 const fs::path& data_folder) {
  return parse_scene(read_scene_text(file), file.string(), overrides,
                     scene_paths(file, data_folder));
}

}  // namespace ensonify::engine
