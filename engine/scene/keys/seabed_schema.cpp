#include <ensonify/engine/scene/keys/schema.h>

#include <ensonify/engine/base/made_once.h>

namespace ensonify::engine {

// clang-format off
namespace {
std::vector<Key<Area>> made_area_keys() {
  return {
      {"polygon_m", "m", {-1e6, 1e6},
       "Only within this polygon: points east and north of the seabed's middle.",
       at(&Area::polygon_m)},
      {"outline", "", {},
       "Only within the polygons of this GeoJSON file, in the seabed's world coordinates; a path "
       "as for seafloor.survey.",
       at(&Area::outline)},
      {"radius_m", "m", {0, 1e6}, "Only within this distance of a middle; 0: anywhere.",
       at(&Area::radius_m)},
      {"middle_east_m", "m", {-1e6, 1e6}, "That middle, east of the seabed's.",
       at(&Area::middle_east_m)},
      {"middle_north_m", "m", {-1e6, 1e6}, "That middle, north of the seabed's.",
       at(&Area::middle_north_m)},
      {"image", "", {},
       "Only where this image (PNG or GeoTIFF of one channel, north up) has image_value; an "
       "image without coordinates is laid over the whole seabed. A path as for seafloor.survey.",
       at(&Area::image)},
      {"image_value", "", {0, 65535}, "The value of the image's pixels that count.",
       at(&Area::image_value)},
      {"shallowest_m", "m", {-1000, 11000},
       "Only where the depth of the bed, before its layers, is at least this.",
       at(&Area::shallowest_m)},
      {"deepest_m", "m", {-1000, 11000}, "Only where that depth is at most this.",
       at(&Area::deepest_m)},
      {"gentlest_deg", "degrees", {0, 90},
       "Only where the slope of the bed, before its layers and averaged over border_m or six cells, "
       "is at least this.",
       at(&Area::gentlest_rad)},
      {"steepest_deg", "degrees", {0, 90}, "Only where that slope is at most this.",
       at(&Area::steepest_rad)},
      {"on", "", {}, "Only where the bed has this material after the earlier patches.",
       at(&Area::on)},
      {"share", "", {0, 1},
       "Share of the area within all these limits that is covered, in patches with ragged borders.",
       at(&Area::share)},
      {"patch_m", "m", {0.1, 100e3}, "Typical size of such a patch.", at(&Area::patch_m)},
      {"border_m", "m", {0, 10e3}, "Relief fades in over this width, and two sediments mix.",
       at(&Area::border_m)},
      {"ragged_m", "m", {0, 10e3},
       "How far, rms, the border of a polygon, disc or image strays from its line.",
       at(&Area::ragged_m)},
      {"number", "", {0, 1e6},
       "Selects its random numbers; 0: its place in the list, from 1. With a number given here they "
       "stay the same when other layers are added or removed.",
       at(&Area::number)},
  };
}

Section<Patch> made_patch_section() {
  Section<Patch> patch{
      "seafloor.patches",
      "Another sediment, or a cover, on a part of the seabed, any number of them; a later patch "
      "covers an earlier one. Where: all limits that are given hold at once.",
      {
          {"material", "", {}, "What it is made of, a name as for seafloor.material.",
           at(&Patch::material)},
          {"class", "", {}, "What it is called in the labels.", at(&Patch::class_name)},
          {"rise_m", "m", {-100, 100},
           "How far its surface lies over the bed around it, as a meadow's canopy does.",
           at(&Patch::rise_m)},
      }};
  append_keys(patch.keys, area_keys(), &Patch::area);
  return patch;
}
}  // namespace
const std::vector<Key<Area>>& area_keys() { return made_once<made_area_keys>(); }
const Section<Patch>& patch_section() { return made_once<made_patch_section>(); }
// clang-format on

}  // namespace ensonify::engine
