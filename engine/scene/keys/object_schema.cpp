#include <algorithm>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/scatter/solid_target.h>

namespace ensonify::engine {
namespace {

std::vector<std::string_view> variant_names() {
  std::vector<std::string_view> names;
  for (const ShapeKind& kind : shape_kinds())
    for (const std::string_view variant : kind.variants)
      if (std::ranges::count(names, variant) == 0) names.push_back(variant);
  return names;
}

std::string object_material_help() {
  return fmt::format(
      "What it is made of: a solid ({}), or a name as for seafloor.material. Parts of some shapes "
      "have other materials, but not those of an object that a session adds.",
      scatter::solid_names());
}

// clang-format off
Section<ObjectOptions> made_object_section() {
  return {
      "objects",
      "An object on the seabed, or over it; any number of them. It is a mesh or a shape, and "
      "stands where it first touches the bed. With `count` there are many, at random places.",
      {
          {"mesh", "", {},
           "Its mesh (PLY, OBJ, STL, OFF) with z up: a path under the scene's folder, or data:path "
           "under the data folder. A closed mesh scatters on its outside, an open one on both sides.",
           at(&ObjectOptions::mesh)},
          {"shape", "", {}, "Instead of a mesh: a shape by its name; the list below has its sizes.",
           at(&ObjectOptions::shape), words_of(shape_kinds())},
          {"variant", "", {},
           "Which form of the shape, of those listed below; unset: drawn, the first more often.",
           at(&ObjectOptions::variant), variant_names()},
          {"shape_seed", "", {0, largest_seed},
           "Seed of a shape's form, of a wreck or boulder for example; unset: it follows from the "
           "seabed's seed and the object's number.",
           at(&ObjectOptions::shape_seed)},
          {"length_m", "m", {0.001, 1000},
           "A shape's size along its heading; a mesh is scaled until its longer side seen from "
           "above has this length.",
           at(&ObjectOptions::size, &ShapeSize::length_m)},
          {"width_m", "m", {0.001, 1000}, "Its size across the heading.",
           at(&ObjectOptions::size, &ShapeSize::width_m)},
          {"tall_m", "m", {0.001, 1000}, "Height from its lowest point to its highest.",
           at(&ObjectOptions::size, &ShapeSize::shape_height_m)},
          {"diameter_m", "m", {0.001, 1000}, "Diameter of a round shape.",
           at(&ObjectOptions::size, &ShapeSize::diameter_m)},
          {"top_diameter_m", "m", {0.001, 1000}, "Diameter of a cone's upper end.",
           at(&ObjectOptions::size, &ShapeSize::top_diameter_m)},
          {"rod_m", "m", {0.001, 10}, "Thickness of a shape's bars, links or twine.",
           at(&ObjectOptions::size, &ShapeSize::rod_m)},
          {"facet_m", "m", {0.001, 100},
           "Edge of a round shape's facets, and of a line's pieces; unset: a 48th of its "
           "circumference, or less for a material with a narrow lobe.",
           at(&ObjectOptions::size, &ShapeSize::facet_m)},
          {"class", "", {}, "What it is called in the labels.", at(&ObjectOptions::class_name)},
          {"part_classes", "", {},
           "Whether a shape's parts have separate classes in images and masks, CLASS.PART, as "
           "wreck.mast, and an assembly's objects keep their classes. A target has one class.",
           at(&ObjectOptions::part_classes)},
          {"assembly", "", {},
           "Objects with the same name here are one object: turned, scaled, sunk in and labelled "
           "as one. The first is its base; the others' places, angles, scales and heights are "
           "relative to it, with height_m and burial from its lowest point.",
           at(&ObjectOptions::assembly)},
          {"material", "", {},
           made_once<object_material_help>(),
           at(&ObjectOptions::material)},
          {"east_m", "m", {-1e6, 1e6},
           "Its middle, east of the seabed's; the points of its path are relative to it.",
           at(&ObjectOptions::east_m)},
          {"north_m", "m", {-1e6, 1e6}, "Its middle, north of the seabed's.",
           at(&ObjectOptions::north_m)},
          {"height_m", "m", {-1000, 11000},
           "Smallest distance between it and the bed. 0: it stands; above 0: it floats; below 0: it "
           "is sunk in; unset: 0, or what follows from burial.",
           at(&ObjectOptions::height_m)},
          {"burial", "", {0, 1},
           "Share of its height that is sunk in, instead of height_m: 0 touches the bed, 1 is "
           "covered by it. If neither is given, a boat, car, container, cable drum, ladder, "
           "mannequin, mine or ordnance sinks in by itself, by a drawn share. The shape decides "
           "how deep the parts of a wreck, aircraft or mooring lie; both keys then move the whole.",
           at(&ObjectOptions::burial)},
          {"follow_slope", "", {}, "Whether it is tilted as the bed below it.",
           at(&ObjectOptions::follow_slope)},
          {"scour_ratio", "", {0, 1},
           "Depth of the moat that a current has dug around it, over its height above the bed. Only "
           "for a bed of heights that is made at once.",
           at(&ObjectOptions::scour_ratio)},
          {"tail_ratio", "", {0, 1}, "Height of the sand in its lee, over its height.",
           at(&ObjectOptions::tail_ratio)},
          {"current_deg", "degrees", {-360, 360}, "Where that current flows to.",
           at(&ObjectOptions::current_rad)},
          {"heading_deg", "degrees", {-360, 360},
           "Turns the mesh's y axis from north, clockwise seen from above.",
           at(&ObjectOptions::heading_rad)},
          {"pitch_deg", "degrees", {-180, 180}, "Then lifts its y end.",
           at(&ObjectOptions::pitch_rad)},
          {"roll_deg", "degrees", {-180, 180}, "Then lowers its x side.",
           at(&ObjectOptions::roll_rad)},
          {"scale", "", {1e-6, 1e6},
           "Metres per unit of the file; a factor for the sizes of a shape, for the length_m of a "
           "mesh and for the points of a path.",
           at(&ObjectOptions::scale)},
          {"weld_m", "m", {-1, 1000},
           "Vertices this close are joined; 0: only equal ones; negative: none.",
           at(&ObjectOptions::weld_tolerance_m)},
          {"path", "m", {-1e6, 1e6},
           "Where a pipeline, cable, rope or chain lies; with speed_mps, the points to which "
           "another object moves from its place, one after the other.",
           at(&ObjectOptions::path)},
          {"path_file", "", {}, "The path from a CSV file with the header row east_m,north_m.",
           at(&ObjectOptions::path_file)},
          {"speed_mps", "m/s", {1e-3, 100},
           "Speed at which it moves along its path, from time 0 on, at the height that it has at "
           "its place. It looks where it goes, turned by heading_deg, and stays at the last point. "
           "During a ping it is at rest.",
           at(&ObjectOptions::speed_mps)},
          {"poses", "", {},
           "Instead, where it is at which time: a CSV file with the columns t_s, east_m, north_m and "
           "heading_deg of its middle, and perhaps z_m (above the sea surface, so negative), pitch_deg "
           "and roll_deg. Between the rows it moves evenly, before and after them it stays.",
           at(&ObjectOptions::poses)},
          {"sag_radius_m", "m", {0.01, 1e6},
           "Tension of the line divided by its weight in water per metre. A free span of s metres "
           "sags by s^2 / (8 sag_radius_m). Unset: 1000 for a pipeline, 50 for a cable, 3 for a "
           "rope or chain.",
           at(&ObjectOptions::sag_radius_m)},
          {"burial_spread", "", {0, 2},
           "Rms of the change of its burial along its path: sand covers parts of it. Where it would "
           "float, it touches the bed.",
           at(&ObjectOptions::burial_spread)},
          {"burial_scale_m", "m", {0.1, 1e4}, "Distance over which that burial changes.",
           at(&ObjectOptions::burial_scale_m)},
          {"count", "", {0, max_labels - 1},
           "Number of copies at random places, clear of all other objects; 0: one, at its place "
           "(none where a recipe draws it).",
           at(&ObjectOptions::count)},
          {"area", "m", {-1e6, 1e6}, "The polygon they lie in.", at(&ObjectOptions::area)},
          {"area_radius_m", "m", {0, 1e6},
           "Or the radius of a disc about east_m and north_m; with neither they lie all over the "
           "seabed.",
           at(&ObjectOptions::area_radius_m)},
          {"margin_m", "m", {0, 1e5}, "Their distance from its border is at least this.",
           at(&ObjectOptions::margin_m)},
          {"gap_m", "m", {-1e3, 1e5},
           "Their distance from each other and from all other objects is at least this; negative: "
           "they may overlap, as in a heap.",
           at(&ObjectOptions::gap_m)},
          {"heading_spread_deg", "degrees", {0, 180},
           "Their headings are uniform within this of heading_deg, to either side.",
           at(&ObjectOptions::heading_spread_rad)},
          {"scale_min", "", {1e-3, 1e3},
           "Their sizes are uniform between this and scale_max, times scale.",
           at(&ObjectOptions::scale_min)},
          {"scale_max", "", {1e-3, 1e3}, "See scale_min.", at(&ObjectOptions::scale_max)},
      }};
}
}  // namespace
const Section<ObjectOptions>& object_section() { return made_once<made_object_section>(); }
// clang-format on

}  // namespace ensonify::engine
