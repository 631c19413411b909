#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/area.h>
#include <ensonify/engine/seafloor/layers/bedforms.h>
#include <ensonify/engine/seafloor/layers/boulders.h>
#include <ensonify/engine/seafloor/layers/outcrops.h>
#include <ensonify/engine/seafloor/layers/pits.h>
#include <ensonify/engine/seafloor/layers/relief_kind.h>
#include <ensonify/engine/seafloor/layers/roughness.h>
#include <ensonify/engine/seafloor/layers/trawl_marks.h>

namespace ensonify::engine {

/// Another sediment, or a cover, on a part of the seabed; a later patch covers an earlier one.
struct Patch {
  Area area;
  std::string material = "coarse silt";
  std::string class_name = "seabed";
  double rise_m = 0.0;  ///< height of its surface over the bed around it, e.g. of a canopy
};

/// A layer of relief with its area and its names. An empty class or material keeps the map's.
template <class Relief>
struct ReliefLayer {
  Area area{kind_of(Relief{}).area};
  Relief relief;
  std::string class_name{kind_of(Relief{}).class_name};
  std::string material{kind_of(Relief{}).material};
};

/// What lies on the base of a seabed: the map of what it is made of, and layers of relief that add
/// up. A new kind of layer is a member here, named as the kind's list is, and a row of
/// relief_lists.
struct SeabedOptions {
  std::vector<Patch> patches;
  std::vector<ReliefLayer<FractalRelief>> roughness;
  std::vector<ReliefLayer<Bedforms>> bedforms;
  std::vector<ReliefLayer<TrawlMarks>> trawl_marks;
  std::vector<ReliefLayer<PitRelief>> pits;
  std::vector<ReliefLayer<OutcropRelief>> outcrops;
  std::vector<ReliefLayer<BoulderField>> boulders;

  bool empty() const;
};

/// The kinds of layers, in the order in which they are laid.
inline constexpr std::tuple relief_lists{
    &SeabedOptions::roughness,    //
    &SeabedOptions::bedforms,     //
    &SeabedOptions::trawl_marks,  //
    &SeabedOptions::pits,         //
    &SeabedOptions::outcrops,     //
    &SeabedOptions::boulders,     //
};
static_assert(sizeof(SeabedOptions) ==
                  (1 + std::tuple_size_v<decltype(relief_lists)>)*sizeof(std::vector<Patch>),
              "relief_lists does not have every list of layers");

/// Calls f(list) for the list of layers of each kind, in the order of relief_lists. `seabed` is a
/// SeabedOptions, const or not.
template <class Options, class F>
void for_each_relief_list(Options& seabed, F&& f) {
  std::apply([&](auto... list) { (f(seabed.*list), ...); }, relief_lists);
}

/// What each point of a grid is made of and called.
struct SeabedMap {
  struct Kind {
    std::string material;
    std::string class_name;
    friend bool operator==(const Kind&, const Kind&) = default;
  };
  /// The seafloor's own first.
  std::vector<Kind> kinds;
  /// Index into kinds, one per grid point; empty: all are kinds[0].
  std::vector<std::uint16_t> point_kind;
  /// For each feature (a trawl mark, a pit, a boulder) the layer that it belongs to: "boulders.0"
  /// is the first layer of boulders. Some features are too small for the grid or covered, and have
  /// no point.
  std::vector<std::string> feature_layer;
  /// Index into feature_layer plus 1, one per grid point; 0: no feature. Empty: no features.
  std::vector<std::uint32_t> point_feature;
  /// Of layers of a whole grid that lie nowhere, because of `on`.
  std::vector<std::string> warnings;
};

/// Lays patches and layers on a base of one material. Rock outcrops rise from the base, so what
/// lies on the sediment does not show on them. Features of a layer without a class get no numbers.
/// `seed` is the seabed's. Throws SceneError with the scene's key of the layer at fault, for
/// options that cannot be laid.
SeabedMap lay_seabed(Heightfield& field, const SeabedOptions& options, const std::string& material,
                     std::uint64_t seed, RoughnessInWindows* roughness = nullptr,
                     const WorkControl& control = {});

/// The warning of a layer that has no effect, because the material of its `on` is not there.
/// `layer` is as in SeabedMap::feature_layer.
std::string nowhere_on_warning(const std::string& layer);

/// Warns of layers whose features lie between the points of the grid: a line for each.
std::vector<std::string> coarse_cell_warnings(const Heightfield& grid, const SeabedOptions& seabed);

}  // namespace ensonify::engine
