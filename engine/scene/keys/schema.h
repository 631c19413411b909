#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/scene/keys/key.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// All keys except `version` and the keys of lists ([[objects]] ...), materials and sonars.
const std::vector<Section<Scene>>& scene_sections();
/// The keys of each [[objects]].
const Section<ObjectOptions>& object_section();
/// The keys of each [[seafloor.patches]].
const Section<Patch>& patch_section();
/// The keys of each [material.NAME].
const Section<Material>& material_section();
/// The keys of each [sonar.NAME].
const Section<Sonar>& sonar_section();

/// The keys that define where a patch or a layer of relief lies.
const std::vector<Key<Area>>& area_keys();

/// Adds the keys of a part of an owner to the owner's keys.
template <class Owner, class Part>
void append_keys(std::vector<Key<Owner>>& keys, const std::vector<Key<Part>>& part_keys,
                 Part Owner::*part) {
  for (const Key<Part>& key : part_keys)
    keys.push_back({key.name, key.unit, key.range, key.help, {key.option, part}, key.choices});
}

template <class Layer>
std::string made_relief_name() {
  return "seafloor." + std::string(kind_of(Layer{}.relief).list);
}
template <class Layer>
Section<Layer> made_relief_section() {
  const auto& kind = kind_of(Layer{}.relief);
  Section<Layer> made{made_once<made_relief_name<Layer>>(), kind.help, {}};
  for (const auto& value : kind.values)
    std::visit(
        [&](auto member) {
          made.keys.push_back({value.key,
                               value.unit,
                               {value.low, value.high},
                               value.help,
                               at(&Layer::relief, member)});
        },
        value.member);
  made.keys.push_back({"class",
                       "",
                       {},
                       "What it is called in the labels; empty: as the bed it lies on.",
                       at(&Layer::class_name)});
  made.keys.push_back({"material",
                       "",
                       {},
                       "What it is made of, a name as for seafloor.material; empty: as the bed.",
                       at(&Layer::material)});
  append_keys(made.keys, area_keys(), &Layer::area);
  return made;
}

/// The keys of each layer of one kind of relief. They follow from its ReliefKind.
template <class Layer>
const Section<Layer>& relief_section() {
  return made_once<made_relief_section<Layer>>();
}

/// Calls f(section, list) for each list of tables of a scene, which may be const.
template <class AnyScene, class F>
void for_each_list(AnyScene& scene, F&& f) {
  auto& bed = scene.seafloor.seabed;
  f(patch_section(), bed.patches);
  for_each_relief_list(
      bed, [&]<class List>(List& list) { f(relief_section<typename List::value_type>(), list); });
  f(object_section(), scene.objects);
}

/// Calls f(dotted name of the key, key, owner) for every key of a scene: seed, sea.salinity_psu,
/// objects.0.shape, sonar.NAME.range_m. `scene` is a Scene or a const Scene.
template <class AnyScene, class F>
void for_each_key(AnyScene& scene, F&& f) {
  const auto visit = [&](const auto& section, const std::string& table, auto& owner) {
    for (const auto& key : section.keys)
      f((table.empty() ? "" : table + ".") + std::string(key.name), key, owner);
  };
  for (const auto& section : scene_sections()) visit(section, std::string(section.name), scene);
  for (auto& material : scene.materials)
    visit(material_section(), "material." + material.name, material);
  for (auto& sonar : scene.sonars) visit(sonar_section(), "sonar." + sonar.name, sonar);
  for_each_list(scene, [&](const auto& section, auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i)
      visit(section, std::string(section.name) + "." + std::to_string(i), list[i]);
  });
}

/// Calls f(dotted name of the key, file) for every file that a scene can name. The file is an
/// InputFile; it is const if the scene is.
template <class AnyScene, class F>
void for_each_file(AnyScene& scene, F&& f) {
  using File = std::conditional_t<std::is_const_v<AnyScene>, const InputFile, InputFile>;
  for_each_key(scene, [&](const std::string& name, const auto& key, auto& owner) {
    const auto option = key.option(owner);
    if (File* const* file = std::get_if<File*>(&option)) f(name, **file);
  });
}

}  // namespace ensonify::engine
