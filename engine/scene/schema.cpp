#include <ensonify/engine/scene/schema.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include <ensonify/engine/scene/option_at.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/surface.h>

namespace ensonify::engine {
namespace {

constexpr double largest_seed =  // TOML's largest integer
    static_cast<double>(std::numeric_limits<std::int64_t>::max());

std::vector<std::string_view> intersector_names() {
  std::vector<std::string_view> names;
  for (const IntersectorKind& kind : intersector_kinds()) names.push_back(kind.name);
  return names;
}

std::string number_text(double value) {
  if (value == 0.0) return std::signbit(value) ? "-0.0" : "0";  // TOML's integer -0 has no sign
  return fmt::format("{}", value);
}

/// The shortest degrees that convert to the same radians.
std::string degrees_text(double rad) {
  const double degrees = rad / radians_per_degree;
  std::string text;
  for (int digits = 1; digits <= 17; ++digits) {
    text = fmt::format("{:.{}g}", degrees, digits);
    double back = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), back);
    if (back * radians_per_degree == rad) return number_text(back);
  }
  return text;
}

std::string polygon_text(const Polygon& polygon) {
  std::string text;
  for (const Eigen::Vector2d& p : polygon)
    text +=
        fmt::format("{}[{}, {}]", text.empty() ? "" : ", ", number_text(p.x()), number_text(p.y()));
  return "[" + text + "]";
}

template <class Owner>
bool has_text_by_default(const Key<Owner>& key) {
  Owner fresh;
  const Option option = key.option(fresh);
  return !(*std::get<std::string*>(option)).empty();
}

}  // namespace

// A row a key.
// clang-format off
const std::vector<Section<Scene>>& scene_sections() {
  using scatter::SeaWater;
  static const std::vector<Section<Scene>> sections = {
      {"",
       "The whole run.",
       {
           {"seed", "", {0, largest_seed}, "All that is random follows from it.", at(&Scene::seed)},
           {"speckle", "", {}, "Fading of the echoes; false gives their expectation.",
            at(&Scene::speckle)},
       }},
      {"sea",
       "The water, from its temperature, salinity and acidity, or by plain numbers.",
       {
           {"temperature_c", "degrees Celsius", {-2, 40}, "Temperature.",
            at(&Scene::sea, &Sea::water, &SeaWater::temperature_c)},
           {"salinity_psu", "psu", {0, 45}, "Salinity.",
            at(&Scene::sea, &Sea::water, &SeaWater::salinity_psu)},
           {"ph", "", {6, 9}, "Acidity; it matters to absorption below some kilohertz.",
            at(&Scene::sea, &Sea::water, &SeaWater::ph)},
           {"profile", "", {},
            "A cast, CSV with columns depth_m and soundspeed_mps, whose mean down to the bed is taken; "
            "a path as for seafloor.survey.",
            at(&Scene::sea, &Sea::profile)},
           {"sound_speed_mps", "m/s", {1000, 2000},
            "Sound speed; unset: from the profile, or the water at half the bed's depth.",
            at(&Scene::sea, &Sea::sound_speed_mps)},
           {"absorption_db_per_km", "dB/km", {0, 10000},
            "Absorption; unset: from the water at half the bed's depth.",
            at(&Scene::sea, &Sea::absorption_db_per_km)},
       }},
      {"seafloor",
       "Where the seabed comes from and what it is made of.",
       {
           {"kind", "", {}, "A generated seabed, a survey's grid, or a mesh.",
            at(&Scene::seafloor, &SeafloorOptions::kind), {"fractal", "survey", "mesh"}},
           {"extent_east_m", "m", {0.01, 100e3}, "Size of a generated seabed from west to east.",
            at(&Scene::seafloor, &SeafloorOptions::extent_east_m)},
           {"extent_north_m", "m", {0.01, 100e3}, "Size of a generated seabed from south to north.",
            at(&Scene::seafloor, &SeafloorOptions::extent_north_m)},
           {"cell_m", "m", {0.001, 1000}, "Spacing of a generated seabed's grid.",
            at(&Scene::seafloor, &SeafloorOptions::cell_m)},
           {"depth_m", "m", {0.1, 11000}, "Mean depth of a generated seabed.",
            at(&Scene::seafloor, &SeafloorOptions::depth_m)},
           {"survey", "", {},
            "A survey's grid (GeoTIFF, BAG, ESRI ASCII, netCDF): a path under the scene's folder, "
            "or data:path under the data folder.",
            at(&Scene::seafloor, &SeafloorOptions::survey)},
           {"mesh", "", {},
            "A mesh (PLY, OBJ, STL, OFF) with z up as the whole seabed; a path as for survey.",
            at(&Scene::seafloor, &SeafloorOptions::mesh)},
           {"weld_m", "m", {-1, 1000},
            "Vertices of the mesh this close become one; 0: only equal ones, less: none.",
            at(&Scene::seafloor, &SeafloorOptions::weld_m)},
           {"water_level_m", "m", {-11000, 9000},
            "Height of the sea surface in the survey's or the mesh's own heights.",
            at(&Scene::seafloor, &SeafloorOptions::water_level_m)},
           {"material", "", {},
            "What it is made of: a name that `ensonify sediments` lists, or a [material.NAME].",
            at(&Scene::seafloor, &SeafloorOptions::material)},
       }},
      {"seafloor.fractal",
       "Relief of a generated seabed that looks alike at every scale.",
       {
           {"height_at_1m_m", "m", {0, 100},
            "Rms height difference of points 1 m apart; 0: no such relief.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::height_at_1m_m)},
           {"hurst", "", {0.01, 0.99}, "Hurst exponent: small is jagged, large is rolling.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::hurst)},
           {"spectrum", "", {},
            "variogram: height differences grow as distance^hurst; paper: the smoother field of "
            "the paper's own exponent.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::spectrum),
            {"variogram", "paper"}},
           {"longest_m", "m", {0, 1e6},
            "Waves longer than this bring no more height; 0: they do, to the seabed's own length.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::longest_m)},
           {"sediments_own", "", {},
            "Whether this is the relief that the material's roughness stands for: its slopes are then "
            "not counted twice.",
            at(&Scene::seafloor, &SeafloorOptions::fractal, &FractalRelief::sediments_own)},
       }},
      {"seafloor.ripples",
       "Relief of a generated seabed with crests in one direction, added to the fractal one.",
       {
           {"rms_height_m", "m", {0, 10}, "Rms height; 0: no ripples.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::rms_height_m)},
           {"wavelength_m", "m", {0.01, 1000}, "From crest to crest; four cells or more.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::wavelength_m)},
           {"across_crests_deg", "degrees", {-360, 360},
            "Heading of the direction across the crests, clockwise from north.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::across_crests_rad)},
           {"relative_width", "", {0.01, 1},
            "Spectral half width over wavenumber: small is regular, large is broken up.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::relative_width)},
           {"hurst", "", {0.01, 5},
            "How fast the spectrum falls off its maximum; beyond 1 the crests are smooth.",
            at(&Scene::seafloor, &SeafloorOptions::ripples, &RippleRelief::hurst)},
       }},
      {"seafloor.detail",
       "Relief of a survey below its cell: its heights smoothly interpolated, and fractal relief that begins "
       "where their spectrum ends.",
       {
           {"cell_m", "m", {0, 1000}, "Spacing of the finer grid; 0: the survey as it is.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::cell_m)},
           {"height_at_1m_m", "m", {0, 100},
            "Rms height difference of points 1 m apart; unset: what the survey's finest scales tell.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::height_at_1m_m)},
           {"hurst", "", {0.01, 0.99}, "Hurst exponent; unset: what the survey's finest scales tell.",
            at(&Scene::seafloor, &SeafloorOptions::detail, &SurveyDetail::hurst)},
       }},
      {"track",
       "A straight line at constant depth. Its middle is counted from the middle of the seabed.",
       {
           {"pings", "", {1, 10e6}, "How many pings.", at(&Scene::track, &StraightTrack::pings)},
           {"speed_mps", "m/s", {0, 50}, "Speed over ground.",
            at(&Scene::track, &StraightTrack::speed_mps)},
           {"heading_deg", "degrees", {-360, 360}, "Heading, clockwise from north.",
            at(&Scene::track, &StraightTrack::heading_rad)},
           {"middle_east_m", "m", {-1e6, 1e6}, "The line's middle, east of the seabed's.",
            at(&Scene::track, &StraightTrack::middle_east_m)},
           {"middle_north_m", "m", {-1e6, 1e6}, "The line's middle, north of the seabed's.",
            at(&Scene::track, &StraightTrack::middle_north_m)},
           {"altitude_m", "m", {0.01, 11000}, "Height over the mean seabed along the line.",
            at(&Scene::track, &StraightTrack::altitude_m)},
           {"ping_interval_s", "s", {0, 3600},
            "Time between pings; 0: the longest range's two-way time.",
            at(&Scene::track, &StraightTrack::ping_interval_s)},
       }},
      {"run",
       "How a run is computed.",
       {
           {"surface", "", {},
            "Which triangles a ping sees. static: all, in one tree; refined: those in the fan, unchanged, "
            "of a mesh refined at each ping; footprint: the same by a query.",
            at(&Scene::run, &RunOptions::surface), surface_names()},
           {"intersector", "", {}, "What finds the nearest hits (`ensonify intersectors`).",
            at(&Scene::run, &RunOptions::intersector), intersector_names()},
           {"robust", "", {}, "Whether no ray may slip between faces, at some cost in speed.",
            at(&Scene::run, &RunOptions::intersection, &IntersectorOptions::robust)},
           {"instruction_set", "", {},
            "What embree's last bits follow (sse4.2, avx2, avx512 ...); empty: avx2.",
            at(&Scene::run, &RunOptions::intersection, &IntersectorOptions::instruction_set)},
           {"tree_pings", "", {1, 1000},
            "For how many pings a tree of the fan's faces is meant to do; more faces, fewer trees.",
            at(&Scene::run, &RunOptions::tree_pings)},
           {"block_pings", "", {1, 100000}, "Pings are handed to threads in blocks of this many.",
            at(&Scene::run, &RunOptions::block_pings)},
       }},
      {"display",
       "From echoes to the picture; the layers of NAME.exr stay as received.",
       {
           {"spreading", "", {0, 80},
            "Gain over range, in dB per factor of ten: 30 levels a bed of constant strength, 50 "
            "one of Lambert's law.",
            at(&Scene::display, &Display::spreading)},
           {"absorption", "", {}, "Whether the gain makes up for absorption too.",
            at(&Scene::display, &Display::absorption)},
           {"gain_db", "dB", {-100, 100},
            "Added to the automatic gain, which puts the seabed's median at mid-brightness.",
            at(&Scene::display, &Display::gain_db)},
           {"gamma", "", {0.05, 10}, "Brightness is amplitude to this power.",
            at(&Scene::display, &Display::gamma)},
           {"palette", "", {}, "Colours.",
            at(&Scene::display, &Display::palette), {"grey", "copper"}},
       }},
      {"output",
       "Which files there are beside NAME.png, NAME.exr, NAME_pings.csv and manifest.json.",
       {
           {"npz", "", {}, "The layers as NAME.npz too.", at(&Scene::output, &OutputOptions::npz)},
       }},
  };
  return sections;
}

const Section<ObjectOptions>& object_section() {
  static const Section<ObjectOptions> section = {
      "objects",
      "A thing on the seabed, or over it; as many as wanted. It stands where its mesh first touches.",
      {
          {"mesh", "", {},
           "Its mesh (PLY, OBJ, STL, OFF) with z up: a path under the scene's folder, or data:path "
           "under the data folder.",
           at(&ObjectOptions::mesh)},
          {"class", "", {}, "What it is called in the labels.", at(&ObjectOptions::class_name)},
          {"material", "", {}, "What it is made of: steel, wood, rock ..., or a [material.NAME].",
           at(&ObjectOptions::material)},
          {"east_m", "m", {-1e6, 1e6}, "Its middle, east of the seabed's.",
           at(&ObjectOptions::east_m)},
          {"north_m", "m", {-1e6, 1e6}, "Its middle, north of the seabed's.",
           at(&ObjectOptions::north_m)},
          {"height_m", "m", {-1000, 11000},
           "Between it and the bed where they come nearest: 0 stands, more floats, less is sunk in.",
           at(&ObjectOptions::height_m)},
          {"heading_deg", "degrees", {-360, 360},
           "Turns the mesh's y axis from north, clockwise seen from above.",
           at(&ObjectOptions::heading_rad)},
          {"pitch_deg", "degrees", {-180, 180}, "Then lifts its y end.",
           at(&ObjectOptions::pitch_rad)},
          {"roll_deg", "degrees", {-180, 180}, "Then lowers its x side.",
           at(&ObjectOptions::roll_rad)},
          {"scale", "", {1e-6, 1e6}, "Metres a unit of the file.", at(&ObjectOptions::scale)},
          {"weld_m", "m", {-1, 1000},
           "Vertices this close become one; 0: only equal ones, less: none.",
           at(&ObjectOptions::weld_m)},
      }};
  return section;
}

const Section<Material>& material_section() {
  static const Section<Material> section = {
      "material.NAME",
      "A material of the scene's own: a known one, and what differs. NAME (letters, digits, _ and -) is "
      "what seafloor.material and the objects' call it by.",
      {
          {"model", "", {},
           "tr9407: APL-UW's for sediments; small-slope: its successor, for them too; lambert; solid.",
           at(&Material::model), {"tr9407", "small-slope", "lambert", "solid"}},
          {"like", "", {},
           "The sediment (`ensonify sediments` lists them) or solid (steel, aluminium, concrete, stone, "
           "wood, glass fibre, rubber) to start from.",
           at(&Material::like)},
          {"mean_grain_size_phi", "phi", {-1, 9}, "The sediment of that mean grain size instead.",
           at(&Material::mean_grain_size_phi)},
          {"density_ratio", "", {1, 3}, "A sediment's density over the water's.",
           at(&Material::density_ratio)},
          {"sound_speed_ratio", "", {0.8, 3}, "Its sound speed over the water's.",
           at(&Material::sound_speed_ratio)},
          {"loss", "", {0, 0.1}, "Imaginary over real part of its wavenumber.", at(&Material::loss)},
          {"volume", "", {0, 1}, "Its volume scattering cross-section over attenuation.",
           at(&Material::volume)},
          {"exponent", "", {2.001, 3.999}, "Exponent of its relief's spectrum.",
           at(&Material::exponent)},
          {"strength_cm4", "cm^4", {0, 1}, "Strength of its relief's spectrum.",
           at(&Material::strength_cm4)},
          {"strength_offset_db", "dB", {-100, 100}, "Added to its scattering strength.",
           at(&Material::strength_offset_db)},
          {"lambert_mu_db", "dB", {-100, -5}, "For lambert: 10 log10(mu).",
           at(&Material::lambert_mu_db)},
          {"diffuse_db", "dB", {-100, -4.98}, "A solid's diffuse part, 10 log10(mu).",
           at(&Material::diffuse_db)},
          {"specular", "", {0, 1}, "Share of the energy that a solid reflects.",
           at(&Material::specular)},
          {"lobe_width_deg", "degrees", {0.001, 45}, "Rms lean of its facets: the lobe's half width.",
           at(&Material::lobe_width_rad)},
      }};
  return section;
}

const Section<Sonar>& sonar_section() {
  static const Section<Sonar> section = {
      "sonar.NAME",
      "One instrument, looking to port and starboard; as many as wanted. NAME (letters, digits, _ "
      "and -) names its files.",
      {
          {"frequency_hz", "Hz", {1e3, 10e6}, "Centre frequency.", at(&Sonar::frequency_hz)},
          {"source_level_db", "dB re 1 uPa at 1 m", {0, 300}, "Source level on the beam's axis.",
           at(&Sonar::source_level_db)},
          {"bandwidth_hz", "Hz", {10, 10e6},
           "Bandwidth of the pulse; its effective length is 1 / bandwidth.",
           at(&Sonar::bandwidth_hz)},
          {"range_m", "m", {0.1, 20000}, "Slant range of the last bin's far edge.",
           at(&Sonar::range_m)},
          {"bins", "", {1, 65536}, "Range bins a side.", at(&Sonar::bins)},
          {"array_length_m", "m", {0.001, 100}, "Length of the line array.",
           at(&Sonar::array_length_m)},
          {"vertical_beamwidth_deg", "degrees", {0, 180},
           "Width of the vertical beam, -3 dB to -3 dB; 0: alike in all directions.",
           at(&Sonar::vertical, &VerticalPattern::beamwidth_rad)},
          {"tilt_deg", "degrees", {-90, 90}, "The vertical beam's axis below the horizontal.",
           at(&Sonar::vertical, &VerticalPattern::tilt_rad)},
          {"vertical_floor_db", "dB", {-200, 0},
           "The vertical beam never falls lower, below its peak.",
           at(&Sonar::vertical, &VerticalPattern::floor_db)},
          {"sector_low_deg", "degrees", {-90, 180},
           "Depression where the rays begin; negative is above the horizontal.",
           at(&Sonar::sector_low_rad)},
          {"sector_high_deg", "degrees", {-90, 180},
           "Depression where they end; 90 is straight down, more looks past it.",
           at(&Sonar::sector_high_rad)},
          {"planes", "", {2, 1024}, "Planes of rays across the main lobe, an even number.",
           at(&Sonar::planes)},
          {"elevations", "", {2, 1 << 20}, "Rays a plane.", at(&Sonar::elevations)},
      }};
  return section;
}
// clang-format on

template <class Owner>
std::string expectation(const Key<Owner>& key) {
  if (!key.choices.empty())
    return fmt::format("{}{}", key.choices.size() > 1 ? "one of " : "",
                       fmt::join(key.choices, ", "));
  Owner owner;
  const Option option = key.option(owner);
  if (std::holds_alternative<bool*>(option)) return "true or false";
  if (std::holds_alternative<InputFile*>(option)) return "a path";
  if (std::holds_alternative<std::string*>(option)) return "a name";
  if (std::holds_alternative<Polygon*>(option))
    return "three to 1000 points, [[east, north], ...], in metres";
  const std::string_view space = key.unit.empty() ? "" : " ";
  if (std::holds_alternative<std::uint64_t*>(option) || std::holds_alternative<int*>(option))
    return fmt::format("a whole number from {:.0f} to {}", key.range.low,
                       key.range.high == largest_seed
                           ? std::to_string(std::numeric_limits<std::int64_t>::max())
                           : fmt::format("{:.0f}", key.range.high));
  return fmt::format("a number from {} to {}{}{}", key.range.low, key.range.high, space, key.unit);
}

template <class Owner>
std::optional<std::string> option_text(const Key<Owner>& key, Owner& owner) {
  const auto number = [&](double value) {
    return key.in_degrees() ? degrees_text(value) : number_text(value);
  };
  return std::visit(
      [&](const auto* value) -> std::optional<std::string> {
        using T = std::remove_cvref_t<decltype(*value)>;
        if constexpr (std::is_same_v<T, double>)
          return number(*value);
        else if constexpr (std::is_same_v<T, std::optional<double>>)
          return *value ? std::optional(number(**value)) : std::nullopt;
        else if constexpr (std::is_same_v<T, std::string>)
          return value->empty() && !has_text_by_default(key) ? std::nullopt
                                                             : std::optional(toml_string(*value));
        else if constexpr (std::is_same_v<T, Polygon>)
          return value->empty() ? std::nullopt : std::optional(polygon_text(*value));
        else if constexpr (std::is_same_v<T, InputFile>)
          return value->name.empty() ? std::nullopt : std::optional(toml_string(value->name));
        else if constexpr (std::is_enum_v<T>)
          return toml_string(key.choices[static_cast<std::size_t>(*value)]);
        else
          return fmt::format("{}", *value);
      },
      key.option(owner));
}

template std::string expectation(const Key<Scene>&);
template std::string expectation(const Key<ObjectOptions>&);
template std::string expectation(const Key<Patch>&);
template std::string expectation(const Key<Layer<FractalRelief>>&);
template std::string expectation(const Key<Layer<CrestRelief>>&);
template std::string expectation(const Key<Layer<TrawlMarks>>&);
template std::string expectation(const Key<Layer<PitRelief>>&);
template std::string expectation(const Key<Layer<OutcropRelief>>&);
template std::string expectation(const Key<Layer<BoulderField>>&);
template std::string expectation(const Key<Material>&);
template std::string expectation(const Key<Sonar>&);
template std::optional<std::string> option_text(const Key<Scene>&, Scene&);
template std::optional<std::string> option_text(const Key<ObjectOptions>&, ObjectOptions&);
template std::optional<std::string> option_text(const Key<Patch>&, Patch&);
template std::optional<std::string> option_text(const Key<Layer<FractalRelief>>&,
                                                Layer<FractalRelief>&);
template std::optional<std::string> option_text(const Key<Layer<CrestRelief>>&,
                                                Layer<CrestRelief>&);
template std::optional<std::string> option_text(const Key<Layer<TrawlMarks>>&, Layer<TrawlMarks>&);
template std::optional<std::string> option_text(const Key<Layer<PitRelief>>&, Layer<PitRelief>&);
template std::optional<std::string> option_text(const Key<Layer<OutcropRelief>>&,
                                                Layer<OutcropRelief>&);
template std::optional<std::string> option_text(const Key<Layer<BoulderField>>&,
                                                Layer<BoulderField>&);
template std::optional<std::string> option_text(const Key<Material>&, Material&);
template std::optional<std::string> option_text(const Key<Sonar>&, Sonar&);

void for_each_file(Scene& scene, const std::function<void(std::string_view, InputFile&)>& f) {
  const auto visit = [&](const auto& section, std::string_view name, auto& owner) {
    for (const auto& key : section.keys) {
      const Option option = key.option(owner);
      if (InputFile* const* file = std::get_if<InputFile*>(&option))
        f(fmt::format("{}.{}", name, key.name), **file);
    }
  };
  for (const auto& section : scene_sections()) visit(section, section.name, scene);
  for_each_list(scene, [&](const auto& section, auto& list) {
    for (std::size_t i = 0; i < list.size(); ++i)
      visit(section, fmt::format("{}.{}", section.name, i), list[i]);
  });
}

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", c);
    else
      out += c;
  }
  return out + '"';
}

}  // namespace ensonify::engine
