#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/layers/area.h>
#include <ensonify/engine/seafloor/layers/bedforms.h>
#include <ensonify/engine/seafloor/layers/boulders.h>
#include <ensonify/engine/seafloor/layers/outcrops.h>
#include <ensonify/engine/seafloor/layers/pits.h>
#include <ensonify/engine/seafloor/layers/trawl_marks.h>

namespace ensonify::engine {

/// A sediment or a cover of its own on a part of the seabed; a later patch covers an earlier one.
struct Patch {
  Area area;
  std::string material = "coarse silt";
  std::string class_name = "seabed";
  double rise_m = 0.0;  ///< how far its surface lies over the bed around it, as a canopy does
};

/// What an interpreter would call a relief: forms of the sediment are seabed, things have names.
inline const char* usual_class(const FractalRelief&) { return ""; }
inline const char* usual_class(const Bedforms&) { return ""; }
inline const char* usual_class(const TrawlMarks&) { return "trawl_mark"; }
inline const char* usual_class(const PitRelief&) { return "pockmark"; }
inline const char* usual_class(const OutcropRelief&) { return "outcrop"; }
inline const char* usual_class(const BoulderField&) { return "boulder"; }
/// What it is made of, if not of the bed's own material.
template <class Relief>
const char* usual_material(const Relief&) {
  return "";
}
inline const char* usual_material(const OutcropRelief&) { return "rock"; }
inline const char* usual_material(const BoulderField&) { return "rock"; }

/// Where it lies: nearly always everywhere.
template <class Relief>
Area usual_area(const Relief&) {
  return {};
}
inline Area usual_area(const OutcropRelief&) {
  Area area;
  area.share = 0.3;
  area.border_m = 30.0;  // over which the rock rises
  return area;
}

/// A layer of relief: where, which, and what it is called. An empty class or material leaves the
/// map's.
template <class Relief>
struct ReliefLayer {
  Area area{usual_area(Relief{})};
  Relief relief;
  std::string class_name{usual_class(Relief{})};
  std::string material{usual_material(Relief{})};
};

/// What lies on the base of a seabed: the map of what it is made of, and layers of relief that add
/// up.
struct SeabedOptions {
  std::vector<Patch> patches;
  std::vector<ReliefLayer<FractalRelief>> roughness;
  std::vector<ReliefLayer<Bedforms>> crests;
  std::vector<ReliefLayer<TrawlMarks>> trawl_marks;
  std::vector<ReliefLayer<PitRelief>> pits;
  std::vector<ReliefLayer<OutcropRelief>> outcrops;
  std::vector<ReliefLayer<BoulderField>> boulders;

  bool empty() const {
    return patches.empty() && roughness.empty() && crests.empty() && trawl_marks.empty() &&
           pits.empty() && outcrops.empty() && boulders.empty();
  }
};

/// What each point of a grid is made of and called.
struct SeabedMap {
  struct Kind {
    std::string material;
    std::string class_name;
    friend bool operator==(const Kind&, const Kind&) = default;
  };
  std::vector<Kind> kinds;                ///< the seafloor's own first
  std::vector<std::uint16_t> point_kind;  ///< into kinds, one a grid point; empty: all are kinds[0]
  /// Trawl marks, pits and boulders one by one: the layer that each belongs to, "boulders.0" for
  /// the first list's entry of that name. Some may be too small for the grid or covered, and have
  /// no point.
  std::vector<std::string> feature_layer;
  std::vector<std::uint32_t>
      point_feature;  ///< from 1, 0: none, one a grid point; empty: none at all
};

/// Lays patches and layers on a base of one material. Rock outcrops rise from the base, so what
/// lies on the sediment does not show on them. Features of a layer without a class are not told
/// apart. Throws std::invalid_argument and refine::MeshError, beginning with the scene's key of the
/// layer at fault, for what cannot be.
SeabedMap lay_seabed(Heightfield& field, const SeabedOptions& options, const std::string& material,
                     std::uint64_t seed);

}  // namespace ensonify::engine
