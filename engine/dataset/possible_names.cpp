#include <ensonify/engine/dataset/recipe_text.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <type_traits>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {
namespace {

/// Whether the items of a list have instances and so are targets: objects, features of the bed.
template <class Item>
bool has_instances() {
  if constexpr (requires(Item item) { kind_of(item.relief); })
    return kind_of(Item{}.relief).has_instances();
  else
    return std::is_same_v<Item, ObjectOptions>;
}

/// Adds the names of the classes and materials that the labels of objects can have. Classes of
/// parts are not classes of targets.
void collect_object_labels(const RecipeText& text, std::span<const ObjectOptions> objects,
                           std::set<std::string>& targets, std::set<std::string>& part_classes,
                           std::set<std::string>& materials) {
  const auto possible = [&](std::size_t number, std::string_view key, const std::string& value) {
    return possible_values(text, fmt::format("objects.{}.{}", number, key), value);
  };
  const auto may_be = [&](std::size_t number, std::string_view key, std::string_view value,
                          const std::string& given) {
    const auto plain = text.values.find(fmt::format("objects.{}.{}", number, key));
    return std::ranges::count(possible(number, key, given), value) > 0 ||
           (plain != text.values.end() && plain->second == value);
  };
  const std::vector<std::size_t> bases = bases_of(objects);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    // The objects that can be the base: the first one of the assembly, the next one if the first
    // can be absent, and so on.
    std::vector<std::size_t> may_be_bases;
    for (std::size_t j = bases[i]; j <= i; ++j) {
      if (bases[j] != bases[i]) continue;
      may_be_bases.push_back(j);
      if (!may_be(j, "present", "false", "true")) break;
    }
    const bool with_parts = std::ranges::any_of(may_be_bases, [&](std::size_t base) {
      return may_be(base, "part_classes", "true", objects[base].part_classes ? "true" : "false");
    });
    const bool may_be_base = std::ranges::count(may_be_bases, i) > 0;
    for (const std::string& class_name : possible(i, "class", objects[i].class_name)) {
      if (may_be_base) targets.insert(class_name);
      for (const std::string& shape : possible(i, "shape", objects[i].shape)) {
        ObjectOptions one = objects[i];
        one.shape = shape;
        one.class_name = class_name;
        one.part_classes = with_parts && may_be_base;
        try {
          for (const ObjectPart& part : parts_of(one)) {
            materials.insert(part.material);
            if (with_parts) part_classes.insert(part.class_name);
          }
        } catch (const std::invalid_argument&) {
          continue;  // no such shape: the sample that draws it is refused
        }
      }
    }
  }
}

/// Adds the names in the files of seafloors that were analysed before. Throws refine::MeshError if
/// one is not such a file.
void collect_analysed_labels(const RecipeText& text, const Scene& scene, const ScenePaths& paths,
                             PossibleNames& names) {
  constexpr const char* key = "seafloor.progressive";
  const std::vector<std::string> files =
      possible_values(text, key, scene.seafloor.progressive.name);
  for (const std::string& file : std::set(files.begin(), files.end())) {
    std::filesystem::path path;
    try {
      if (!file.empty()) path = resolve(key, file, paths);
    } catch (const SceneError&) {  // no such file: the sample that draws it is refused
    }
    if (path.empty()) continue;
    const Seafloor seafloor = open_analysed(path);
    const auto add_targets = [&](const auto& things) {
      for (const auto& thing : things)
        names.targets.insert(seafloor.classes.at(thing.label.class_id));
    };
    add_targets(seafloor.objects);
    add_targets(seafloor.features);
    // Without the name of number 0. possible_names() removes classes of targets from `grounds`.
    names.grounds.insert(seafloor.classes.begin() + 1, seafloor.classes.end());
    names.materials.insert(seafloor.materials.begin() + 1, seafloor.materials.end());
  }
}

}  // namespace

std::vector<std::string> possible_values(const RecipeText& text, const std::string& key,
                                         const std::string& value) {
  std::vector<std::string> values;
  if (const auto drawn = text.distributions.find(key); drawn != text.distributions.end())
    drawn->second.collect_values(values);
  for (std::string& drawn : values) drawn = plain_text(drawn);
  values.push_back(value);
  return values;
}

PossibleNames possible_names(const RecipeText& text, Scene& scene, const ScenePaths& paths) {
  PossibleNames names;
  names.materials.insert(scene.seafloor.material);
  std::set<std::string>&targets = names.targets, &grounds = names.grounds;
  std::set<std::string>& materials = names.materials;
  std::vector<std::string_view> lists_of_targets;
  for_each_list(scene,
                [&]<class Item>(const Section<Item>& section, const std::vector<Item>& list) {
                  if (has_instances<Item>()) lists_of_targets.push_back(section.name);
                  if constexpr (!std::is_same_v<Item, ObjectOptions>)
                    for (const Item& item : list) {
                      (has_instances<Item>() ? targets : grounds).insert(item.class_name);
                      materials.insert(item.material);
                    }
                });
  for (const auto& [key, distribution] : text.distributions) {
    std::vector<std::string> values;
    distribution.collect_values(values);
    const bool of_instances = std::ranges::any_of(
        lists_of_targets, [&whole = key](auto list) { return in_table(whole, list); });
    if (key.ends_with(".class") && !in_table(key, "objects"))
      for (const std::string& value : values)
        (of_instances ? targets : grounds).insert(plain_text(value));
    if (key.ends_with(".material"))
      for (const std::string& value : values) materials.insert(plain_text(value));
  }
  collect_object_labels(text, scene.objects, targets, grounds, materials);
  collect_analysed_labels(text, scene, paths, names);
  for (std::set<std::string>* all : {&targets, &grounds, &materials}) all->erase("");
  for (const std::string& target : targets) grounds.erase(target);
  return names;
}

}  // namespace ensonify::engine
