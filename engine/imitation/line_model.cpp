#include <ensonify/engine/imitation/line_model.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/scene/conditions.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/scene_paths.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>
#include <ensonify/refine/atomic_file.h>

namespace ensonify::engine {
namespace {

constexpr const char* navigation_file = "navigation.csv";
constexpr const char* beam_file = "beam.csv";
constexpr const char* tones_file = "tones.png";

constexpr double max_vertices = 1.5e6;  // of the generated bed

// These functions round numbers as the text of a scene's files does, so that the simulation uses
// the same numbers as the files.
double number_of_text(const std::string& text) { return number_in<double>(text).value(); }
double rounded(double value, int digits = 6) {
  return number_of_text(fmt::format("{:.{}g}", value, digits));
}
double thousandths(double value) { return number_of_text(fmt::format("{:.3f}", value)); }
double hundredths(double value) { return rounded(std::round(100.0 * value) / 100.0); }

/// The row with this name. Throws std::logic_error if there is none.
template <class Rows, class NameOf>
const auto& row_named(const Rows& rows, std::string_view name, NameOf name_of) {
  const auto row = std::ranges::find(rows, name, name_of);
  if (row == std::ranges::end(rows))
    throw std::logic_error(fmt::format("a scene has no table or key {}", name));
  return *row;
}

/// Sets keys of a scene, and keeps the text of each key, in the order of the scene's file.
class Keys {
 public:
  Keys(const LineModel& model, Scene& scene) : scene(scene), model_(model) {}

  /// Begins a table of the scene.
  void table(std::string_view name) {
    table(std::string(name), row_named(scene_sections(), name, &Section<Scene>::name), scene);
  }
  /// Begins a table of an owner. The owner must stay at its address until the next table begins.
  template <class Owner>
  void table(std::string name, const Section<Owner>& section, Owner& owner) {
    section_ = std::move(name);
    option_of_ = [&](std::string_view key) -> KeyOption {
      const Key<Owner>& row = row_named(section.keys, key, &Key<Owner>::name);
      return {row.option(owner), row.choices, row.in_degrees()};
    };
  }

  /// Sets a key. `value` has the type of the key; a number is in the key's unit.
  template <class Value>
  void add(std::string_view key, Value value, Evidence evidence = {}) {
    const KeyOption its = option_of_(key);
    if constexpr (std::is_same_v<Value, double>)
      if (its.in_degrees) value *= degree;
    const auto set = [&]<class Own>(Own* option) -> ConstOption {
      if constexpr (std::is_same_v<Own, Value> || std::is_same_v<Own, std::optional<Value>>)
        *option = value;
      else
        throw std::logic_error(fmt::format("{}: the value has another type", key));
      return option;
    };
    std::string text =
        option_text(std::visit(set, its.option), its.in_degrees, its.choices).value();
    add_text(key, std::move(text), std::move(evidence));
  }
  template <class Value>
  void assume(std::string_view key, Value value, std::string why) {
    add(key, std::move(value), {Confidence::assumed, std::move(why)});
  }
  /// Adds a key with its text, such as a distribution of a recipe.
  void add_text(std::string_view key, std::string text, Evidence evidence) {
    FoundKey found{section_, std::string(key), std::move(text), std::move(evidence)};
    // For a key that the fit has changed, use the evidence that the fit recorded.
    if (const auto fitted = model_.evidence.find(found.name()); fitted != model_.evidence.end())
      found.evidence = fitted->second;
    found_keys.push_back(std::move(found));
  }

  Scene& scene;
  std::vector<FoundKey> found_keys;

 private:
  struct KeyOption {
    Option option;
    std::span<const std::string_view> choices;
    bool in_degrees;
  };

  const LineModel& model_;
  std::string section_;
  std::function<KeyOption(std::string_view key)> option_of_;
};

/// A bed that reaches beyond the range on all sides. Its cells are two bins wide, or wider if
/// max_vertices or max_cells requires it.
BedExtent extent_of(const LineModel& model, double east_m, double north_m) {
  const double margin_m = 2.0 * model.range_m + 4.0;
  BedExtent extent{std::ceil(east_m + margin_m), std::ceil(north_m + margin_m), 0.0};
  constexpr double max_cells = 8000.0;  // along the longer side
  extent.cell_m =
      std::max({0.05, 2.0 * model.bin_m(), std::max(extent.east_m, extent.north_m) / max_cells,
                std::sqrt(extent.east_m * extent.north_m / max_vertices)});
  extent.cell_m = std::ceil(100.0 * extent.cell_m) / 100.0;
  return extent;
}

void add_sea(const LineModel& model, Keys& keys) {
  keys.table("sea");
  keys.assume("sound_speed_mps", rounded(model.sound_speed_mps), "usual");
  keys.assume("absorption_db_per_km", rounded(std::round(1e3 * model.absorption_db_per_m)),
              "of sea water at that frequency");
}

/// The brightest tone has the sediment's own strength, so that no tone returns more than a surface
/// can. The gain compensates for this shift, unless the gain is automatic.
double headroom_db(const LineModel& model) {
  int brightest = 0;
  for (const std::int8_t step : model.tones.steps) brightest = std::max(brightest, int{step});
  return model.gain_db ? brightest * ToneMap::step_db : 0.0;
}

/// Adds the material of one step of tone.
void add_material(const LineModel& model, const std::string& name, int step, Evidence evidence,
                  Keys& keys) {
  Material& material = keys.scene.materials.emplace_back();
  material.name = name;
  keys.table(fmt::format("material.{}", name), material_section(), material);
  const auto like = model.evidence.find("material.bed.like");
  keys.add("like", model.material, like == model.evidence.end() ? Evidence{} : like->second);
  keys.add("strength_offset_db", step * ToneMap::step_db - headroom_db(model), std::move(evidence));
  if (!model.has_texture()) return;
  keys.add("texture_shape", rounded(model.texture_shape),
           {Confidence::fitted, "contrast at low grazing angles"});
  keys.add("glint_share", rounded(model.glint_share),
           {Confidence::fitted, "kurtosis at 8 to 20 degrees"});
  keys.assume("variation_db", 0.0, "the patches already have the slow changes");
}

void add_bed(const LineModel& model, const BedExtent& extent, Keys& keys) {
  const std::string material = "bed";
  keys.table("seafloor");
  keys.assume("kind", SeafloorKind::fractal,
              "a level bed with relief; the vehicle's altitude contains the slopes");
  keys.assume("extent_east_m", rounded(extent.east_m), "the track and the range");
  keys.assume("extent_north_m", rounded(extent.north_m), "the same");
  keys.assume("cell_m", rounded(extent.cell_m), "two bins, or what fits into memory");
  keys.add("depth_m", hundredths(model.path.bed_depth_m + model.altitude_shift_m),
           model.path.depth);
  keys.assume("material", material, "a name chosen for this scene");
  keys.table("seafloor.fractal");
  keys.assume("height_at_1m_m", rounded(model.height_at_1m_m),
              "usual; fits the correlation of the samples");
  keys.assume("hurst", 0.5, "usual");
  keys.assume("longest_m", 10.0, "the vehicle's altitude contains longer waves");
  add_material(model, material, 0, {Confidence::assumed, "the gain compensates for it"}, keys);
}

/// The value of a pixel of tones.png for a step of tone; 0 for step 0.
int tone_pixel(int step) { return step == 0 ? 0 : step + ToneMap::max_steps + 1; }

/// Adds a patch and its material for each step of tone that the map has.
void add_tones(const LineModel& model, Keys& keys) {
  std::vector<Patch>& patches = keys.scene.seafloor.seabed.patches;
  for (int step = -ToneMap::max_steps; step <= ToneMap::max_steps; ++step) {
    if (step == 0 || std::ranges::count(model.tones.steps, step) == 0) continue;
    const std::string name = fmt::format("{}{}", step < 0 ? "darker" : "brighter", std::abs(step));
    const Evidence from{Confidence::measured,
                        "level of tiles over the line's mean at the same angle and side"};
    Patch& patch = patches.emplace_back();
    keys.table(fmt::format("seafloor.patches.{}", patches.size() - 1), patch_section(), patch);
    keys.add("material", name, from);
    keys.add("image", InputFile{tones_file, {}}, from);
    keys.add("image_value", tone_pixel(step), from);
    add_material(model, name, step, from, keys);
  }
}

/// `beam` is the name of the vertical beam's file.
void add_sonar(const LineModel& model, const std::string& beam, Keys& keys) {
  const RecorderSigns& recorder = model.recorder;
  Sonar& sonar = keys.scene.sonars.front();
  keys.table(fmt::format("sonar.{}", sonar.name), sonar_section(), sonar);
  if (!model.port || !model.starboard)
    keys.add("sides", model.port ? Sides::port : Sides::starboard,
             {Confidence::stated, "the other side is missing or silent"});
  keys.add("frequency_hz", rounded(model.frequency_hz));
  if (model.pulse.kind == PulseKind::lfm) {
    keys.add("pulse", PulseKind::lfm);
    if (model.pulse.window == PulseWindow::hann) keys.add("window", PulseWindow::hann);
    if (model.pulse.length_s > 0.0) keys.add("pulse_length_s", rounded(model.pulse.length_s));
  }
  keys.add("bandwidth_hz", rounded(model.pulse.bandwidth_hz));
  keys.add("range_m", rounded(model.range_m, 8), {Confidence::stated, "of most pings"});
  keys.add("bins", static_cast<int>(model.samples), {Confidence::stated, "samples of a side"});
  keys.add("array_length_m", rounded(model.array_length_m));
  if (model.has_pattern()) {
    keys.add("vertical_pattern", InputFile{beam, {}});
  } else {
    keys.add("vertical_beamwidth_deg", rounded(model.beamwidth_rad / degree));
    keys.add("tilt_deg", rounded(model.tilt_rad / degree));
  }
  keys.assume("planes", 4, "enough for a beam without side lobes");
  keys.assume("elevations", std::clamp(static_cast<int>(model.samples) * 3 / 2, 1000, 8000),
              "some rays per bin");
  keys.assume("noise", false, "all noise is in output_noise_db");
  keys.add("output_noise_db", hundredths(model.output_noise_db));
  keys.add("tvg_spreading", rounded(model.range_law.spreading), model.range_law.from);
  keys.add("tvg_absorption", model.range_law.absorption, model.range_law.from);
  if (model.gain_db) keys.add("gain_db", hundredths(*model.gain_db + headroom_db(model)));
  if (model.ping_gain_db > 0.0)
    keys.add("ping_gain_db", hundredths(model.ping_gain_db),
             {Confidence::measured, "near and far bed get brighter together from ping to ping"});
  keys.add("looks", recorder.looks, recorder.looks_from);
  keys.add("detector", recorder.detector, recorder.looks_from);
  keys.add("ping_mean", rounded(recorder.ping_mean), recorder.ping_mean_from);
  keys.add("curve", recorder.curve, recorder.curve_from);
  if (recorder.curve == TransferCurve::logarithmic)
    keys.add("curve_range_db", std::round(recorder.curve_range_db), recorder.curve_range_from);
  keys.add("bits", recorder.bits, recorder.bits_from);
  keys.table("arrivals");
  keys.add("burst_m", hundredths(recorder.burst_m), recorder.burst_from);
}

/// Sets the keys of `scene`, which must have the defaults. The content of files is not set.
std::vector<FoundKey> set_keys(const LineModel& model, Scene& scene) {
  scene.conditions = Conditions::ideal;
  use_conditions(scene);
  scene.texture = model.has_texture();
  Keys keys(model, scene);
  add_sea(model, keys);
  add_bed(model, model.bed, keys);
  add_tones(model, keys);
  keys.table("track");
  keys.add("kind", TrackKind::file, model.path.place);
  keys.add("file", InputFile{navigation_file, {}}, model.path.attitude);
  if (model.path.origin) {
    constexpr int digits = 9;
    keys.add("origin_lat_deg", rounded(model.path.origin->latitude_rad / degree, digits),
             model.path.place);
    keys.add("origin_lon_deg", rounded(model.path.origin->longitude_rad / degree, digits),
             model.path.place);
  }
  add_sonar(model, beam_file, keys);
  return std::move(keys.found_keys);
}

NavigationLog navigation_of(const VehiclePath& path) {
  const auto written = [](std::vector<double> values, double unit = 1.0) {
    for (double& value : values) value = thousandths(value / unit) * unit;
    return values;
  };
  std::vector<double> z_m;
  for (const double altitude_m : path.altitude_m)
    z_m.push_back(-thousandths(path.bed_depth_m - altitude_m));
  return {.t_s = written(path.t_s),
          .x_m = written(path.x_m),
          .y_m = written(path.y_m),
          .z_m = std::move(z_m),
          .roll_rad = written(path.roll_rad, degree),
          .pitch_rad = written(path.pitch_rad, degree),
          .heading_rad = written(path.heading_rad, degree)};
}

/// The one-way vertical beam of both sides, at the middle of each cell.
std::array<std::vector<VerticalLevel>, 2> beam_of(const LineModel& model) {
  std::array<std::vector<VerticalLevel>, 2> beam;
  for (const std::size_t side : {0u, 1u})
    for (std::size_t i = 0; i < grazing_cells; ++i)
      beam[side].push_back({grazing_cell_rad(i), thousandths(0.5 * model.vertical_db[side][i])});
  return beam;
}

std::string navigation_csv(const NavigationLog& log) {
  std::string csv = "t_s,x_m,y_m,depth_m";
  std::vector<const std::vector<double>*> angles;
  for (const auto& [name, values] : {std::pair{"roll_deg", &log.roll_rad},
                                     {"pitch_deg", &log.pitch_rad},
                                     {"heading_deg", &log.heading_rad}}) {
    if (values->empty()) continue;
    angles.push_back(values);
    csv += fmt::format(",{}", name);
  }
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    csv += fmt::format("\n{:.3f},{:.3f},{:.3f},{:.3f}", log.t_s[i], log.x_m[i], log.y_m[i],
                       -log.z_m[i]);
    for (const std::vector<double>* values : angles)
      csv += fmt::format(",{:.3f}", (*values)[i] / degree);
  }
  return csv + "\n";
}

std::string beam_csv(const std::array<std::vector<VerticalLevel>, 2>& beam) {
  std::string csv = "depression_deg,port_db,starboard_db\n";
  for (std::size_t i = 0; i < beam[0].size(); ++i)
    csv += fmt::format("{:.6g},{:.3f},{:.3f}\n", beam[0][i].depression_rad / degree,
                       beam[0][i].level_db, beam[1][i].level_db);
  return csv;
}

std::string beginning(const LineModel& model) {
  return fmt::format("version = 1\nconditions = \"ideal\"\nseed = 1\n{}",
                     model.has_texture() ? "texture = true\n" : "");
}

std::string text_of(const std::vector<FoundKey>& keys, std::string text) {
  std::string section;
  for (const FoundKey& key : keys) {
    if (key.section != section) {
      section = key.section;
      constexpr std::string_view patches = "seafloor.patches";
      text += section.starts_with(patches) ? fmt::format("\n[[{}]]\n", patches)
                                           : fmt::format("\n[{}]\n", section);
    }
    text += fmt::format("{} = {}  # {}{}{}\n", key.key, key.value, name_of(key.evidence.how),
                        key.evidence.why.empty() ? "" : ": ", key.evidence.why);
  }
  return text;
}

/// A uniform distribution between two numbers, as the text of a recipe.
std::string uniform(double low, double high, int digits) {
  return fmt::format("{{ uniform = [{0:.{2}g}, {1:.{2}g}] }}", low, high, digits);
}
std::string about(double value, double share) {
  return uniform(value * (1.0 - share), value * (1.0 + share), 6);
}

/// Adds the scene's bed for a straight track to the north. Its relief and its depth are drawn.
void add_drawn_bed(const LineModel& model, double track_m, double max_altitude_m, Keys& keys) {
  add_bed(model, extent_of(model, 0.0, track_m), keys);
  const double min_depth_m = std::max(model.path.bed_depth_m, 1.2 * max_altitude_m + 1.0);
  for (FoundKey& key : keys.found_keys) {
    if (key.key == "height_at_1m_m" && model.height_at_1m_m > 0.0)
      key.value = fmt::format("{{ log_uniform = [{:.4g}, {:.4g}] }}", 0.5 * model.height_at_1m_m,
                              2.0 * model.height_at_1m_m);
    if (key.key == "depth_m") key.value = uniform(min_depth_m, 1.2 * min_depth_m, 6);
  }
}

void add_crab(const VehiclePath& path, Keys& keys) {
  if (path.heading_rad.empty() || path.place.how != Confidence::stated) return;
  std::vector<double> crabs_deg;
  for (std::size_t i = 0; i < path.heading_rad.size(); ++i)
    crabs_deg.push_back(
        std::remainder(path.heading_rad[i] - course_rad(path, i), 2.0 * std::numbers::pi) / degree);
  keys.table("motion");
  keys.add_text(
      "crab_deg", uniform(quantile(crabs_deg, 0.1), quantile(crabs_deg, 0.9) + 0.01, 3),
      {Confidence::measured, "from the 10th to the 90th percentile of heading less course"});
}

void add_oscillations(const VehiclePath& path, Keys& keys) {
  struct Freedom {
    std::string_view name, unit;
    const std::vector<double>& values;
    double unit_size, max_rms;  // size of the unit, and the largest rms of a scene
    std::string_view from = "the attitude about its mean over 10 s";
  };
  for (const Freedom& freedom : {Freedom{"roll", "deg", path.roll_rad, degree, 45.0},
                                 Freedom{"pitch", "deg", path.pitch_rad, degree, 45.0},
                                 Freedom{"heading", "deg", path.heading_rad, degree, 45.0},
                                 Freedom{"heave", "m", path.altitude_m, 1.0, 1000.0,
                                         "the bottom line about its mean over 10 s"}}) {
    if (freedom.values.empty()) continue;
    const Oscillation found = oscillation_of(path.ping_interval_s, freedom.values);
    const Evidence from{Confidence::measured, std::string(freedom.from)};
    keys.table(fmt::format("motion.{}", freedom.name));
    keys.add_text(fmt::format("rms_{}", freedom.unit),
                  about(std::min(found.rms / freedom.unit_size, freedom.max_rms / 1.5), 0.5), from);
    keys.add_text("period_s", about(std::clamp(found.period_s, 0.1, 3000.0), 0.2), from);
  }
}

}  // namespace

BedExtent bed_extent(const LineModel& model) {
  const auto [west, east] = std::ranges::minmax(model.path.x_m);
  const auto [south, north] = std::ranges::minmax(model.path.y_m);
  return extent_of(model, east - west, north - south);
}

std::vector<FoundKey> found_keys(const LineModel& model) {
  Scene scene;
  return set_keys(model, scene);
}

Scene scene_of(const LineModel& model) {
  Scene scene;
  set_keys(model, scene);
  scene.track.log = std::make_shared<NavigationLog>(navigation_of(model.path));
  if (model.has_pattern()) scene.sonars.front().vertical.measured = beam_of(model);
  if (scene.seafloor.seabed.patches.empty()) return scene;
  AreaPixels pixels{static_cast<int>(model.tones.columns), static_cast<int>(model.tones.rows), {}};
  for (const std::int8_t step : model.tones.steps)
    pixels.values.push_back(static_cast<std::uint8_t>(tone_pixel(step)));
  const auto shared = std::make_shared<const AreaPixels>(std::move(pixels));
  for (Patch& patch : scene.seafloor.seabed.patches) patch.area.pixels = shared;
  return scene;
}

void write_scene(const LineModel& model, const std::filesystem::path& folder) {
  const Scene scene = scene_of(model);
  const auto write = [&](const char* name, const auto& content) {
    refine::write_file(folder / name, content);
  };
  write(navigation_file, navigation_csv(*scene.track.log));
  if (model.has_pattern()) write(beam_file, beam_csv(scene.sonars.front().vertical.measured));
  if (!scene.seafloor.seabed.patches.empty()) {
    const AreaPixels& tones = *scene.seafloor.seabed.patches.front().area.pixels;
    write(tones_file, encode_png({model.tones.columns, model.tones.rows, 1, tones.values}));
  }
  write("scene.toml", text_of(found_keys(model),
                              "# Made by `ensonify imitate`. The comment of each key gives its "
                              "evidence: the recording\n# states it, its samples show it, it was "
                              "fitted to them, or it is a usual value.\n" +
                                  beginning(model)));
}

std::string recipe_text(const LineModel& model) {
  const VehiclePath& path = model.path;
  std::vector<double> altitudes = path.altitude_m;
  std::ranges::sort(altitudes);
  const double low_m = altitudes[altitudes.size() / 10],
               high_m = altitudes[altitudes.size() * 9 / 10];
  const double speed_mps = std::clamp(path.speed_mps, 0.2, 20.0);
  constexpr int pings = 400;
  Scene scene;
  Keys keys(model, scene);
  add_sea(model, keys);
  add_drawn_bed(model, pings * speed_mps * path.ping_interval_s * 1.2, high_m, keys);
  keys.table("track");
  keys.assume("kind", TrackKind::line, "a straight line, as long as the recorder's pictures are");
  keys.assume("pings", pings, "per sample");
  keys.add_text("speed_mps", about(speed_mps, 0.2), path.place);
  keys.add("ping_interval_s", rounded(path.ping_interval_s), path.time);
  keys.assume("heading_deg", 0.0, "along the bed's longer side");
  keys.add_text("altitude_m", uniform(low_m, std::max(high_m, low_m * 1.01), 4),
                {Confidence::measured, "from the 10th to the 90th percentile of the bottom line"});
  add_crab(path, keys);
  add_oscillations(path, keys);
  add_sonar(model, std::string(data_prefix) + beam_file, keys);
  keys.table("output");
  keys.assume("exr", false, "pictures are enough");
  return text_of(
      keys.found_keys,
      "# Made by `ensonify imitate --recipe`: the imitation's sonar and bed, with distributions\n"
      "# about what was found. Its folder has the sonar's beam:\n"
      "#   ensonify preview DIR/recipe.toml --data DIR -o sheet.png\n"
      "#   ensonify generate DIR/recipe.toml --data DIR -o samples\n"
      "# Add [[objects]] for targets.\n" +
          beginning(model) +
          "\n[dataset]\ntitle = \"As a recording\"\nsamples = 64\nseafloors = 16\n");
}

}  // namespace ensonify::engine
