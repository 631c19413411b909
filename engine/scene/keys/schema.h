#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/units.h>

namespace ensonify::engine {

/// The types of value that a key can have.
template <class... Value>
struct ValueTypes {
  using Pointer = std::variant<Value*...>;
  using ConstPointer = std::variant<const Value*...>;
};
using OptionTypes = ValueTypes<bool, int, std::uint64_t, std::optional<std::uint64_t>, double,
                               std::optional<double>, std::string, std::vector<std::string>,
                               std::vector<double>, InputFile, std::vector<Eigen::Vector2d>,
                               RefractionMode, SeafloorKind, FractalSpectrum, TrackKind, Vertical,
                               Sides, Palette, Mapping, DisplayedLayer, PulseKind, PulseWindow,
                               ShadingKind, Detector, TransferCurve, ExrCompression, Conditions>;
/// The option behind a key, to be set.
using Option = OptionTypes::Pointer;
/// The same, to be read.
using ConstOption = OptionTypes::ConstPointer;

/// Where an owner has the option of a key.
template <class Owner>
class OptionAt {
 public:
  /// member(owner) is a reference to the option.
  template <class Member>
  OptionAt(Member member)
      : set_([=](Owner& owner) -> Option { return &member(owner); }),
        get_([=](const Owner& owner) -> ConstOption { return &member(owner); }) {}
  /// The option of a part that the owner has.
  template <class Part>
  OptionAt(const OptionAt<Part>& option, Part Owner::*part)
      : set_([=](Owner& owner) { return option(owner.*part); }),
        get_([=](const Owner& owner) { return option(owner.*part); }) {}
  Option operator()(Owner& owner) const { return set_(owner); }
  ConstOption operator()(const Owner& owner) const { return get_(owner); }

 private:
  std::function<Option(Owner&)> set_;
  std::function<ConstOption(const Owner&)> get_;
};

/// The option at the end of a chain of members, for a row of the key table.
template <class Part, class Owner, class... Rest>
auto at(Part Owner::*first, Rest... rest) {
  return [=](auto& owner) -> auto& { return ((owner.*first).*....*rest); };
}

/// Allowed values, in the key's own unit, the ends among them.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// A row of the key table. The unit of a number is in its name; degrees (_deg) are kept as radians.
template <class Owner>
struct Key {
  std::string_view name;
  std::string_view unit;  ///< "" for what has none
  Range range;            ///< of numbers
  std::string_view help;
  OptionAt<Owner> option;
  /// The words allowed; those of an enumeration in its order. A scene may write - for _ in them.
  std::vector<std::string_view> choices;

  bool in_degrees() const { return name.ends_with("_deg"); }
};

/// A TOML table: its dotted name ("" for the top of the file), and its keys.
template <class Owner>
struct Section {
  std::string_view name;
  std::string_view help;
  std::vector<Key<Owner>> keys;
};

/// All keys except `version`, those of lists ([[objects]] ...), the materials' and the sonars'.
const std::vector<Section<Scene>>& scene_sections();
/// The keys of each [[objects]].
const Section<ObjectOptions>& object_section();
/// The keys of each [[seafloor.patches]].
const Section<Patch>& patch_section();
/// The keys of each [material.NAME].
const Section<Material>& material_section();
/// The keys of each [sonar.NAME].
const Section<Sonar>& sonar_section();

/// The keys that say where a patch or a layer of relief lies.
const std::vector<Key<Area>>& area_keys();

/// The keys of a part of an owner, as keys of the owner.
template <class Owner, class Part>
void append_keys(std::vector<Key<Owner>>& keys, const std::vector<Key<Part>>& part_keys,
                 Part Owner::*part) {
  for (const Key<Part>& key : part_keys)
    keys.push_back({key.name, key.unit, key.range, key.help, {key.option, part}, key.choices});
}

/// The keys of each layer of one kind of relief, from its ReliefKind.
template <class Layer>
const Section<Layer>& relief_section() {
  static const auto& kind = kind_of(Layer{}.relief);
  static const std::string name = "seafloor." + std::string(kind.list);
  static const Section<Layer> section = [] {
    Section<Layer> made{name, kind.help, {}};
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
  }();
  return section;
}

/// Calls f(section, list) for each list of tables that a scene can have. `scene` is a Scene, const
/// or not.
template <class AnyScene, class F>
void for_each_list(AnyScene& scene, F&& f) {
  auto& bed = scene.seafloor.seabed;
  f(patch_section(), bed.patches);
  for_each_relief_list(
      bed, [&]<class List>(List& list) { f(relief_section<typename List::value_type>(), list); });
  f(object_section(), scene.objects);
}

/// What a key accepts, by its option: "a number from 0.5 to 10000 m", "true or false", "one of
/// grey, copper".
std::string expectation(std::string_view unit, const Range& range,
                        std::span<const std::string_view> choices, const ConstOption& option);
template <class Owner>
std::string expectation(const Key<Owner>& key) {
  const Owner owner{};
  return expectation(key.unit, key.range, key.choices, key.option(owner));
}

/// An option's value as TOML, the shortest text that reads back to it; none for an unset one. Empty
/// text counts as unset.
std::optional<std::string> option_text(const ConstOption& option, bool in_degrees,
                                       std::span<const std::string_view> choices);
/// The same of a key. Empty text is a value where the default is another text.
template <class Owner>
std::optional<std::string> option_text(const Key<Owner>& key, const Owner& owner) {
  const ConstOption option = key.option(owner);
  if (const auto* text = std::get_if<const std::string*>(&option); text && (*text)->empty()) {
    const Owner fresh{};
    if (!std::get<const std::string*>(key.option(fresh))->empty()) return "\"\"";
  }
  return option_text(option, key.in_degrees(), key.choices);
}

/// Calls f(dotted name of the key, file) for every file that a scene can name. `scene` is a Scene,
/// and the file an InputFile, const or not.
template <class AnyScene, class F>
void for_each_file(AnyScene& scene, F&& f) {
  using File = std::conditional_t<std::is_const_v<AnyScene>, const InputFile, InputFile>;
  const auto visit = [&](const auto& section, std::string_view name, auto& owner) {
    for (const auto& key : section.keys) {
      const auto option = key.option(owner);
      if (File* const* file = std::get_if<File*>(&option))
        f(std::string(name) + "." + std::string(key.name), **file);
    }
  };
  for (const auto& section : scene_sections()) visit(section, section.name, scene);
  for (auto& material : scene.materials)
    visit(material_section(), "material." + material.name, material);
  for (auto& sonar : scene.sonars) visit(sonar_section(), "sonar." + sonar.name, sonar);
  for_each_list(scene, [&](const auto& section, auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i)
      visit(section, std::string(section.name) + "." + std::to_string(i), list[i]);
  });
}

/// "; did you mean 'x'?" for the known names that are nearest to this one, if any is near.
std::string suggestion(std::string_view word, std::span<const std::string> known);

/// A string as TOML.
std::string toml_string(std::string_view text);

}  // namespace ensonify::engine
