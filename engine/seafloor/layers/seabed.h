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

/// Another sediment, or a cover, on a part of the seabed. A later patch covers an earlier one.
struct Patch {
  Area area;
  std::string material = "coarse silt";
  std::string class_name = "seabed";
  double rise_m = 0.0;  ///< height of the patch over the bed around it, e.g. of seagrass
};

/// A layer of relief with its area, class and material. If class or material is empty, points keep
/// the class or material that the map has.
template <class Relief>
struct ReliefLayer {
  Area area{kind_of(Relief{}).area};
  Relief relief;
  std::string class_name{kind_of(Relief{}).class_name};
  std::string material{kind_of(Relief{}).material};
};

/// What lies on the base of a seabed: patches of other materials, and layers of relief. A new kind
/// of layer needs a member here, with the name of the kind's list, and a row of relief_lists.
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

/// The material, class and feature of each point of a grid.
struct SeabedMap {
  struct Kind {
    std::string material;
    std::string class_name;
    friend bool operator==(const Kind&, const Kind&) = default;
  };
  /// The first kind is that of the seafloor without patches and layers.
  std::vector<Kind> kinds;
  /// Index into kinds, one per grid point; empty: all points have kinds[0].
  std::vector<std::uint16_t> point_kind;
  /// For each feature (a trawl mark, a pit, a boulder) its layer: "boulders.0" is the first layer
  /// of boulders. Features that are too small for the grid or covered have no point.
  std::vector<std::string> feature_layer;
  /// Index into feature_layer plus 1, one per grid point; 0: no feature. Empty: no features.
  std::vector<std::uint32_t> point_feature;
  /// Warnings of layers of a whole grid that lie nowhere, because no point has the material `on`.
  std::vector<std::string> warnings;
};

/// Lays patches and layers on `field`, a base of one material. Rock outcrops rise from the base, so
/// relief of the sediment is not visible on them. Features of a layer without a class get no
/// numbers. `seed` is the seed of the seabed. Throws SceneError, with the scene's key of the layer,
/// for options that cannot be laid.
SeabedMap lay_seabed(Heightfield& field, const SeabedOptions& options, const std::string& material,
                     std::uint64_t seed, RoughnessInWindows* roughness = nullptr,
                     const WorkControl& control = {});

/// The warning of a layer that has no effect because its area has no point with the material `on`.
/// `layer` is as in SeabedMap::feature_layer.
std::string nowhere_on_warning(const std::string& layer);

/// Warnings, one per layer, of layers whose features are too small for the cells of the grid.
std::vector<std::string> coarse_cell_warnings(const Heightfield& grid, const SeabedOptions& seabed);

}  // namespace ensonify::engine
