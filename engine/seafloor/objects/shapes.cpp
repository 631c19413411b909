#include <ensonify/engine/seafloor/objects/shapes.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/objects/shape_family.h>
#include <ensonify/scatter/kind_named.h>

namespace ensonify::engine {
namespace {

using Size = ShapeSize;

constexpr Dimension length(double m) { return {"length_m", &Size::length_m, m}; }
constexpr Dimension width(double m) { return {"width_m", &Size::width_m, m}; }
constexpr Dimension tall(double m) { return {"tall_m", &Size::shape_height_m, m}; }
constexpr Dimension diameter(double m) { return {"diameter_m", &Size::diameter_m, m}; }
constexpr Dimension top_diameter(double m) { return {"top_diameter_m", &Size::top_diameter_m, m}; }
constexpr Dimension rod(double m) { return {"rod_m", &Size::rod_m, m}; }
/// A size that a family draws, from the usual size of `dimension` to max_m.
Dimension drawn(Dimension dimension, double max_m) {
  dimension.max_m = max_m;
  return dimension;
}
constexpr double follows = 0.0;  // the size follows from the form that a family draws

constexpr std::array every_dimension{length(0),   width(0),        tall(0),
                                     diameter(0), top_diameter(0), rod(0)};

/// A kind that is laid along a path.
ShapeKind line(std::string_view name, std::string_view help, const Dimension& size) {
  return {.name = name, .help = help, .dimensions = {size}, .along_path = true};
}

// Usual sizes without a source are typical values, rounded.
std::vector<ShapeKind> made_shape_kinds() {
  return {
      {"cylinder", "lying, as a bottom mine of torpedo calibre", {diameter(0.53), length(2.0)}},
      {"cone",
       "truncated, standing on its wide end, as a shallow-water mine (Manta-like)",
       {diameter(0.98), top_diameter(0.5), tall(0.44)}},
      {"wedge",
       "a flat-bottomed mine, high at its back and low in front (Rockan-like)",
       {length(1.02), width(0.8), tall(0.385)}},
      {"sphere", "a moored mine's case, a buoy", {diameter(1.0)}},
      {"box", "a crate, a block", {length(1.0), width(1.0), tall(1.0)}},
      {"barrel", "a drum of 200 l lying, with rims and hoops", {diameter(0.585), length(0.88)}},
      {"tyre", "a car's, lying flat", {diameter(0.65), tall(0.2)}},
      {"anchor", "stockless, lying, its flukes up", {length(2.0), width(1.4), tall(0.6)}},
      {"pot",
       "a lobster pot: boards, three arches, bars and netting",
       {length(0.9), width(0.6), tall(0.4), rod(0.03)}},
      {"net",
       "a lost net, its floats holding up one side",
       {length(8.0), width(3.0), tall(0.8), rod(0.02)},
       {{"twine", ""}, {"rope", ""}, {"float", ""}}},
      {"boulder", "every one different; diameter_m is its longest size", {diameter(1.0)}},
      {"debris",
       "a piece of a wreck, every one different: plate, beam, pipe, rib or machine",
       {length(2.5)}},
      {"wreck",
       "a ship or boat that sank: steamer, trawler, barge, sailing ship or submarine; frames is a "
       "wooden one of which the ribs are left",
       {drawn(length(8.0), 120.0), width(follows), tall(follows)},
       {{"hull", ""},
        {"deck", "wood"},
        {"superstructure", ""},
        {"mast", ""},
        {"frame", ""},
        {"cargo", "stone"},
        {"machinery", "fouled steel"},
        {"debris", ""}},
       {"upright", "listing", "broken", "collapsed", "frames"},
       make_wreck,
       true},
      {"aircraft",
       "one that ditched or crashed, upright or inverted, whole or broken, with its wings or "
       "without; the variants are of its wings",
       {drawn(length(7.0), 24.0), width(follows), tall(follows)},
       {{"fuselage", ""},
        {"wing", ""},
        {"tail", ""},
        {"engine", "fouled steel"},
        {"canopy", "glass fibre"},
        {"gear", "rubber"},
        {"debris", ""}},
       {"straight", "swept", "flying_wing"},
       make_aircraft,
       true},
      {"boat",
       "a small one, upright, on its side or capsized",
       {drawn(length(3.0), 9.0), width(follows), tall(follows)},
       {{"hull", ""}, {"deck", "wood"}, {"engine", "fouled steel"}},
       {"rowing", "motor", "sailing", "inflatable"},
       make_boat},
      {"car",
       "on its wheels, on its side or on its roof",
       {drawn(length(3.6), 5.2), width(follows), tall(follows)},
       {{"body", ""}, {"wheel", "rubber"}, {"frame", ""}},
       {"saloon", "van", "pickup"},
       make_car},
      {"container",
       "of 20 feet (ISO 668), with corrugated walls, its doors shut, open or lost",
       {length(6.058), width(follows), tall(follows)},
       {{"wall", ""}, {"frame", ""}, {"door", ""}},
       {"upright", "tilted"},
       make_container},
      {"cable_drum",
       "two flanges and what is left of the cable between them",
       {drawn(diameter(1.0), 3.0), width(follows)},
       {{"flange", ""}, {"cable", "rubber"}},
       {"standing", "lying"},
       make_cable_drum},
      {"ladder",
       "two rails with rungs, straight or bent",
       {drawn(length(2.0), 6.0), width(follows)},
       {{"rail", ""}, {"rung", ""}},
       {},
       make_ladder},
      {"mooring",
       "a sinker, a line upwards and a float that leans with the current",
       {drawn(tall(1.5), 8.0)},
       {{"sinker", "concrete"}, {"line", ""}, {"float", ""}},
       {},
       make_mooring,
       true},
      {"mannequin",
       "a person, lying, arms and legs stretched out or bent",
       {drawn(length(1.5), 1.9), width(follows), tall(follows)},
       {{"torso", ""}, {"head", ""}, {"limb", ""}},
       {},
       make_mannequin},
      {"ordnance",
       "unexploded: a bomb with its tail, a shell or a torpedo; the length is its variant's",
       {length(follows), diameter(follows)},
       {{"body", ""}, {"tail", ""}},
       {"bomb", "shell", "torpedo"},
       make_ordnance},
      {"mine",
       "with domes, rims, fins, lugs and horns, unlike plain bodies; its length is its variant's",
       {length(follows), width(follows), tall(follows)},
       {{"body", ""}, {"fitting", ""}, {"sinker", ""}},
       {"cylindrical", "conical", "wedge", "moored"},
       make_mine},
      line("pipeline", "along a path", diameter(0.6)),
      line("cable", "along a path", diameter(0.1)),
      line("rope", "along a path", diameter(0.05)),
      line("chain", "of open links along a path; rod_m is the links' thickness", rod(0.05)),
  };
}

}  // namespace

const std::vector<ShapeKind>& shape_kinds() { return made_once<made_shape_kinds>(); }

const ShapeKind& shape_named(std::string_view name) {
  return scatter::kind_named(shape_kinds(), "shape", name);
}

std::span<const Dimension> all_dimensions() { return every_dimension; }

double ShapeKind::size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const {
  const auto found = std::ranges::find(dimensions, which, &Dimension::size);
  if (found == dimensions.end())
    throw std::invalid_argument(fmt::format("a {} has no such size", name));
  return (given.*which).value_or(found->usual_m);
}

}  // namespace ensonify::engine
