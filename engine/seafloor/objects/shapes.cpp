#include <ensonify/engine/seafloor/objects/shapes.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/kind_named.h>

namespace ensonify::engine {
namespace {

using Size = ShapeSize;

Dimension length(double m) { return {"length_m", &Size::length_m, m}; }
Dimension width(double m) { return {"width_m", &Size::width_m, m}; }
Dimension tall(double m) { return {"tall_m", &Size::shape_height_m, m}; }
Dimension diameter(double m) { return {"diameter_m", &Size::diameter_m, m}; }
Dimension top_diameter(double m) { return {"top_diameter_m", &Size::top_diameter_m, m}; }
Dimension rod(double m) { return {"rod_m", &Size::rod_m, m}; }

}  // namespace

// Where no source is named, the usual sizes are typical values, rounded.
const std::vector<ShapeKind>& shape_kinds() {
  static const std::vector<ShapeKind> kinds = {
      {"cylinder",
       "lying, as a bottom mine of torpedo calibre",
       false,
       {diameter(0.53), length(2.0)}},
      {"cone",
       "truncated, standing on its wide end, as a shallow-water mine (Manta-like)",
       false,
       {diameter(0.98), top_diameter(0.5), tall(0.44)}},
      {"wedge",
       "a flat-bottomed mine, high at its back and low in front (Rockan-like)",
       false,
       {length(1.02), width(0.8), tall(0.385)}},
      {"sphere", "a moored mine's case, a buoy", false, {diameter(1.0)}},
      {"box", "a crate, a block", false, {length(1.0), width(1.0), tall(1.0)}},
      {"barrel",
       "a drum of 200 l lying, with rims and hoops",
       false,
       {diameter(0.585), length(0.88)}},
      {"tyre", "a car's, lying flat", false, {diameter(0.65), tall(0.2)}},
      {"anchor", "stockless, lying, its flukes up", false, {length(2.0), width(1.4), tall(0.6)}},
      {"pot",
       "a lobster pot: boards, three arches, bars and netting",
       false,
       {length(0.9), width(0.6), tall(0.4), rod(0.03)}},
      {"net",
       "a lost net, its floats holding up one side",
       false,
       {length(8.0), width(3.0), tall(0.8), rod(0.02)}},
      {"boulder", "every one different; diameter_m is its longest size", false, {diameter(1.0)}},
      {"debris",
       "a piece of a wreck, every one different: plate, beam, pipe, rib or machine",
       false,
       {length(2.5)}},
      {"pipeline", "along a path", true, {diameter(0.6)}},
      {"cable", "along a path", true, {diameter(0.1)}},
      {"rope", "along a path", true, {diameter(0.05)}},
      {"chain", "of open links along a path; rod_m is the links' thickness", true, {rod(0.05)}},
  };
  return kinds;
}

const ShapeKind& shape_named(std::string_view name) {
  return scatter::kind_named(shape_kinds(), "shape", name);
}

std::span<const Dimension> all_dimensions() {
  static const std::array<Dimension, 6> all{length(0),   width(0),        tall(0),
                                            diameter(0), top_diameter(0), rod(0)};
  return all;
}

double ShapeKind::size_m(const ShapeSize& given, std::optional<double> ShapeSize::*which) const {
  const auto found = std::ranges::find(dimensions, which, &Dimension::size);
  if (found == dimensions.end())
    throw std::invalid_argument(fmt::format("a {} has no such size", name));
  return (given.*which).value_or(found->usual_m);
}

}  // namespace ensonify::engine
