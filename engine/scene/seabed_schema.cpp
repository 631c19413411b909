#include <ensonify/engine/scene/option_at.h>
#include <ensonify/engine/scene/schema.h>

namespace ensonify::engine {
namespace {

template <class Owner>
void add_row(Section<Owner>& section, std::string_view name, std::string_view unit, Range range,
             std::string_view help, std::function<Option(Owner&)> option) {
  Key<Owner>& key = section.keys.emplace_back();
  key.name = name;
  key.unit = unit;
  key.range = range;
  key.help = help;
  key.option = std::move(option);
}

// clang-format off
/// The section with the keys that say where a patch or a layer lies.
template <class Owner>
Section<Owner> with_area(Section<Owner> section) {
  const auto row = [&](std::string_view name, std::string_view unit, Range range, std::string_view help,
                      auto Area::*option) {
    add_row<Owner>(section, name, unit, range, help, at(&Owner::area, option));
  };
  row("polygon_m", "m", {-1e6, 1e6}, "Only within this polygon: points east and north of the seabed's middle.",
      &Area::polygon_m);
  row("outline", "", {},
      "Only within the polygons of this GeoJSON file, in the seabed's world coordinates; a path as for "
      "seafloor.survey.",
      &Area::outline);
  row("radius_m", "m", {0, 1e6}, "Only within this distance of a middle; 0: anywhere.",
      &Area::radius_m);
  row("middle_east_m", "m", {-1e6, 1e6}, "That middle, east of the seabed's.",
      &Area::middle_east_m);
  row("middle_north_m", "m", {-1e6, 1e6}, "That middle, north of the seabed's.",
      &Area::middle_north_m);
  row("image", "", {},
      "Only where this image (PNG or GeoTIFF of one channel, north up) has image_value; without "
      "coordinates of its own it is laid over the whole seabed. A path as for seafloor.survey.",
      &Area::image);
  row("image_value", "", {0, 65535}, "The value of the image's pixels that count.",
      &Area::image_value);
  row("shallowest_m", "m", {-1000, 11000}, "Only where the bed, before its layers, is as deep or deeper.",
      &Area::shallowest_m);
  row("deepest_m", "m", {-1000, 11000}, "Only where it is as shallow or shallower.",
      &Area::deepest_m);
  row("gentlest_deg", "degrees", {0, 90},
      "Only where the bed, before its layers and averaged over border_m, is as steep or steeper.",
      &Area::gentlest_rad);
  row("steepest_deg", "degrees", {0, 90}, "Only where it is as gentle or gentler.",
      &Area::steepest_rad);
  row("on", "", {}, "Only where the patches so far have left this material.",
      &Area::on);
  row("share", "", {0, 1}, "Of all that, a share in patches with smooth borders.",
      &Area::share);
  row("patch_m", "m", {0.1, 100e3}, "Typical size of such a patch.", &Area::patch_m);
  row("border_m", "m", {0, 10e3}, "Relief fades in over this width.",
      &Area::border_m);
  row("ragged_m", "m", {0, 10e3},
      "How far, rms, the border of a polygon, disc or image strays from its line.",
      &Area::ragged_m);
  row("number", "", {0, 1e6},
      "Which draw of all that is random in it; 0: its place in the list, from 1. With a number of its own "
      "it stays as it is when others come and go.",
      &Area::number);
  return section;
}

/// The section of a layer of relief, with the keys that all have.
template <class Relief>
Section<ReliefLayer<Relief>> layer(Section<ReliefLayer<Relief>> section) {
  using Owner = ReliefLayer<Relief>;
  add_row<Owner>(section, "class", "", {},
                 "What it is called in the labels; empty: as the bed it lies on.",
                 at(&Owner::class_name));
  add_row<Owner>(section, "material", "", {},
                 "What it is made of, a name as for seafloor.material; empty: as the bed.",
                 at(&Owner::material));
  return with_area(std::move(section));
}

}  // namespace

const Section<Patch>& patch_section() {
  static const Section<Patch> section = with_area<Patch>(
      {"seafloor.patches",
       "A sediment or a cover on a part of the seabed, as many as wanted; a later one covers an earlier. "
       "Where: all the limits that are given hold at once.",
       {
           {"material", "", {}, "What it is made of, a name as for seafloor.material.",
            at(&Patch::material)},
           {"class", "", {}, "What it is called in the labels.", at(&Patch::class_name)},
           {"rise_m", "m", {-100, 100},
            "How far its surface lies over the bed around it, as a meadow's canopy does.",
            at(&Patch::rise_m)},
       }});
  return section;
}

const Section<ReliefLayer<FractalRelief>>& roughness_section() {
  using Owner = ReliefLayer<FractalRelief>;
  static const Section<Owner> section = layer<FractalRelief>(
      {"seafloor.roughness",
       "A layer of fractal relief, as [seafloor.fractal] is.",
       {
           {"height_at_1m_m", "m", {0, 100}, "Rms height difference of points 1 m apart.",
            at(&Owner::relief, &FractalRelief::height_at_1m_m)},
           {"hurst", "", {0.01, 0.99}, "Hurst exponent: small is jagged, large is rolling.",
            at(&Owner::relief, &FractalRelief::hurst)},
           {"longest_m", "m", {0, 1e6}, "Waves longer than this bring no more height; 0: they do.",
            at(&Owner::relief, &FractalRelief::longest_m)},
       }});
  return section;
}

const Section<ReliefLayer<Bedforms>>& crest_section() {
  using Owner = ReliefLayer<Bedforms>;
  static const Section<Owner> section = layer<Bedforms>(
      {"seafloor.crests",
       "A layer of crests that bend, end and fork but do not fade: ripples (typically 0.1 to 1.5 m long and "
       "0.05 to 0.17 as high), megaripples (0.6 to 10 m, 0.1 to 0.5 m high), sand waves (50 to 500 m, 1 to "
       "10 m high).",
       {
           {"wavelength_m", "m", {0.01, 10e3}, "From crest to crest; four cells or more.",
            at(&Owner::relief, &Bedforms::wavelength_m)},
           {"height_m", "m", {0, 100}, "From trough to crest.",
            at(&Owner::relief, &Bedforms::height_m)},
           {"across_crests_deg", "degrees", {-360, 360},
            "Heading across the crests, clockwise from north; steep sides face that way.",
            at(&Owner::relief, &Bedforms::across_crests_rad)},
           {"sharpness", "", {0, 1}, "0: a cosine; 1: crests are edges between round troughs.",
            at(&Owner::relief, &Bedforms::sharpness)},
           {"asymmetry", "", {0, 0.95}, "0: both sides alike; towards 1: a steep lee side.",
            at(&Owner::relief, &Bedforms::asymmetry)},
           {"bend_deg", "degrees", {0, 45},
            "How much, rms, the crests turn; their spacing changes alike, in radians of itself.",
            at(&Owner::relief, &Bedforms::bend_rad)},
           {"drift_m", "m", {0, 1e6}, "Over what distance they do; 0: 20 wavelengths.",
            at(&Owner::relief, &Bedforms::drift_m)},
           {"height_spread", "", {0, 2}, "How much, rms, the height's logarithm changes over such distances.",
            at(&Owner::relief, &Bedforms::height_spread)},
           {"forks", "", {0, 25}, "How many crests begin and end in a square of 10 x 10 wavelengths.",
            at(&Owner::relief, &Bedforms::forks)},
       }});
  return section;
}

const Section<ReliefLayer<TrawlMarks>>& trawl_mark_section() {
  using Owner = ReliefLayer<TrawlMarks>;
  static const Section<Owner> section = layer<TrawlMarks>(
      {"seafloor.trawl_marks",
       "A layer of paired furrows with berms, left by the doors of otter trawls.",
       {
           {"count", "", {0, 1000}, "How many tows cross the seabed.",
            at(&Owner::relief, &TrawlMarks::count)},
           {"depth_m", "m", {0, 10},
            "Of a fresh furrow: some centimetres in sand, up to 0.4 m in mud; berms rise 0.45 of it.",
            at(&Owner::relief, &TrawlMarks::depth_m)},
           {"width_m", "m", {0.01, 100}, "Of a furrow, between its berms; typically 0.2 to 2 m.",
            at(&Owner::relief, &TrawlMarks::width_m)},
           {"door_spacing_m", "m", {0.1, 1000}, "Between a pair's furrows; typically 20 to 120 m.",
            at(&Owner::relief, &TrawlMarks::door_spacing_m)},
           {"heading_deg", "degrees", {-360, 360}, "Of the tows, there and back.",
            at(&Owner::relief, &TrawlMarks::heading_rad)},
           {"heading_spread_deg", "degrees", {0, 180}, "Its standard deviation.",
            at(&Owner::relief, &TrawlMarks::heading_spread_rad)},
           {"wander_m", "m", {0, 1000}, "How far, rms, a tow strays from a straight line.",
            at(&Owner::relief, &TrawlMarks::wander_m)},
       }});
  return section;
}

const Section<ReliefLayer<PitRelief>>& pit_section() {
  using Owner = ReliefLayer<PitRelief>;
  static const Section<Owner> section = layer<PitRelief>(
      {"seafloor.pits",
       "A layer of scattered hollows: pockmarks, scours.",
       {
           {"per_hectare", "", {0, 1e5}, "How many in 100 x 100 m, on average.",
            at(&Owner::relief, &PitRelief::per_hectare)},
           {"diameter_m", "m", {0.001, 10e3}, "The median's.", at(&Owner::relief, &PitRelief::diameter_m)},
           {"diameter_spread", "", {0, 2}, "Standard deviation of its logarithm.",
            at(&Owner::relief, &PitRelief::diameter_spread)},
           {"depth_ratio", "", {0, 1}, "Depth over diameter; about 0.09 for pockmarks.",
            at(&Owner::relief, &PitRelief::depth_ratio)},
           {"rim_ratio", "", {0, 1}, "Height of the rim over the depth.",
            at(&Owner::relief, &PitRelief::rim_ratio)},
           {"elongation", "", {1, 20}, "Length over width; scours are long.",
            at(&Owner::relief, &PitRelief::elongation)},
           {"heading_deg", "degrees", {-360, 360},
            "Of the long axis, from the steep end to the shallow one.",
            at(&Owner::relief, &PitRelief::heading_rad)},
       }});
  return section;
}

const Section<ReliefLayer<OutcropRelief>>& outcrop_section() {
  using Owner = ReliefLayer<OutcropRelief>;
  static const Section<Owner> section = layer<OutcropRelief>(
      {"seafloor.outcrops",
       "A layer of tilted beds of rock that stand out of the sediment in ledges. Over the width "
       "border_m it rises from as far below the bed as it stands above it.",
       {
           {"height_m", "m", {0, 1000}, "How far the rock rises; at the area's border it stands level.",
            at(&Owner::relief, &OutcropRelief::height_m)},
           {"ledge_m", "m", {0, 1000}, "Height of a ledge: a bed's thickness; 0: no ledges.",
            at(&Owner::relief, &OutcropRelief::ledge_m)},
           {"dip_deg", "degrees", {0, 45}, "How steeply the beds sink.",
            at(&Owner::relief, &OutcropRelief::dip_rad)},
           {"dip_heading_deg", "degrees", {-360, 360}, "Whereto they sink; ledges run across.",
            at(&Owner::relief, &OutcropRelief::dip_heading_rad)},
           {"roughness_at_1m_m", "m", {0, 100}, "Rms height difference of points 1 m apart on the rock.",
            at(&Owner::relief, &OutcropRelief::roughness_at_1m_m)},
           {"hurst", "", {0.01, 0.99}, "Hurst exponent of that.",
            at(&Owner::relief, &OutcropRelief::hurst)},
       }});
  return section;
}

const Section<ReliefLayer<BoulderField>>& boulder_section() {
  using Owner = ReliefLayer<BoulderField>;
  static const Section<Owner> section = layer<BoulderField>(
      {"seafloor.boulders",
       "A layer of many boulders with moats and tails; give the seabed four cells a boulder or more. A few "
       "with a hull's detail are [[objects]].",
       {
           {"per_hectare", "", {0, 1e5}, "How many in 100 x 100 m, on average.",
            at(&Owner::relief, &BoulderField::per_hectare)},
           {"diameter_m", "m", {0.001, 1000}, "The median's.",
            at(&Owner::relief, &BoulderField::diameter_m)},
           {"diameter_spread", "", {0, 2}, "Standard deviation of its logarithm.",
            at(&Owner::relief, &BoulderField::diameter_spread)},
           {"height_ratio", "", {0, 3}, "Height over the bed over the diameter, on average.",
            at(&Owner::relief, &BoulderField::height_ratio)},
           {"scour_ratio", "", {0, 1}, "Depth of the moat over the height.",
            at(&Owner::relief, &BoulderField::scour_ratio)},
           {"tail_ratio", "", {0, 1}, "Height of the tail over the height.",
            at(&Owner::relief, &BoulderField::tail_ratio)},
           {"current_deg", "degrees", {-360, 360}, "Heading that the current, and so the tails, go to.",
            at(&Owner::relief, &BoulderField::current_rad)},
       }});
  return section;
}
// clang-format on

}  // namespace ensonify::engine
