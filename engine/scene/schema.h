#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The option behind a key.
using Option =
    std::variant<bool*, int*, std::uint64_t*, std::optional<std::uint64_t>*, double*,
                 std::optional<double>*, std::string*, std::vector<std::string>*, InputFile*,
                 std::vector<Eigen::Vector2d>*, RefractionMode*, SeafloorKind*, FractalSpectrum*,
                 MaterialModel*, TrackKind*, Vertical*, Sides*, Palette*, Mapping*, DisplayedLayer*,
                 PulseKind*, PulseWindow*, Detector*, TransferCurve*>;

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
  std::function<Option(Owner&)> option;
  std::vector<std::string_view> choices;  ///< the words allowed; an enumeration's in its order

  bool in_degrees() const { return name.ends_with("_deg"); }
};

/// A TOML table: its dotted name ("" for the top of the file), and its keys.
template <class Owner>
struct Section {
  std::string_view name;
  std::string_view help;
  std::vector<Key<Owner>> keys;
};

/// All keys but `version`, those of lists ([[objects]] ...), the materials' and the sonars'.
const std::vector<Section<Scene>>& scene_sections();
/// The keys of each [[objects]].
const Section<ObjectOptions>& object_section();
/// The keys of each [[seafloor.patches]], and of the layers of relief.
const Section<Patch>& patch_section();
const Section<ReliefLayer<FractalRelief>>& roughness_section();
const Section<ReliefLayer<Bedforms>>& crest_section();
const Section<ReliefLayer<TrawlMarks>>& trawl_mark_section();
const Section<ReliefLayer<PitRelief>>& pit_section();
const Section<ReliefLayer<OutcropRelief>>& outcrop_section();
const Section<ReliefLayer<BoulderField>>& boulder_section();
/// The keys of each [material.NAME].
const Section<Material>& material_section();
/// The keys of each [sonar.NAME].
const Section<Sonar>& sonar_section();

/// Calls f(section, list) for each list of tables that a scene can have.
template <class F>
void for_each_list(Scene& scene, F&& f) {
  SeabedOptions& bed = scene.seafloor.seabed;
  f(patch_section(), bed.patches);
  f(roughness_section(), bed.roughness);
  f(crest_section(), bed.crests);
  f(trawl_mark_section(), bed.trawl_marks);
  f(pit_section(), bed.pits);
  f(outcrop_section(), bed.outcrops);
  f(boulder_section(), bed.boulders);
  f(object_section(), scene.objects);
}

/// What a key wants: "a number from 0.5 to 10000 m", "true or false", "one of grey, copper".
template <class Owner>
std::string expectation(const Key<Owner>& key);

/// The option's value as TOML, the shortest text that reads back to it; none for an unset one.
template <class Owner>
std::optional<std::string> option_text(const Key<Owner>& key, Owner& owner);

/// Calls f(dotted name of the key, file) for every file that a scene can name.
void for_each_file(Scene& scene, const std::function<void(std::string_view, InputFile&)>& f);

/// "; did you mean 'x'?" for the known names that are nearest to this one, if any is near.
std::string suggestion(std::string_view word, std::span<const std::string> known);

/// A string as TOML.
std::string toml_string(std::string_view text);

inline constexpr double radians_per_degree = 0.017453292519943295;

}  // namespace ensonify::engine
