#include <ensonify/engine/imitation/line_model.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/scene/keys/key_text.h>

namespace ensonify::engine {
namespace {

constexpr double max_vertices = 1.5e6;  // of the generated bed
constexpr std::string_view sonar_section_name = "sonar.sidescan";

std::string number(double value) { return fmt::format("{:.6g}", value); }
std::string boolean(bool value) { return value ? "true" : "false"; }

/// Collects keys in the order in which the scene has them.
class Keys {
 public:
  explicit Keys(const LineModel& model) : model_(model) {}
  void section(std::string_view name) { section_ = name; }
  void add(std::string_view key, std::string value, Evidence evidence) {
    FoundKey found{section_, std::string(key), std::move(value), std::move(evidence)};
    // A key that the fit has changed keeps the evidence that the fit recorded.
    if (const auto fitted = model_.evidence.find(found.name()); fitted != model_.evidence.end())
      found.evidence = fitted->second;
    keys.push_back(std::move(found));
  }
  void assume(std::string_view key, std::string value, std::string why) {
    add(key, std::move(value), {Confidence::assumed, std::move(why)});
  }
  std::vector<FoundKey> keys;

 private:
  const LineModel& model_;
  std::string section_;
};

/// A bed that reaches beyond the range on all sides, with cells of two bins where memory allows.
BedExtent extent_of(const LineModel& model, double east_m, double north_m) {
  const double margin_m = 2.0 * model.range_m + 4.0;
  BedExtent extent{std::ceil(east_m + margin_m), std::ceil(north_m + margin_m), 0.0};
  const double bin_m = model.range_m / static_cast<double>(model.samples);
  constexpr double max_cells = 8000.0;  // of its longer side
  extent.cell_m = std::max({0.05, 2.0 * bin_m, std::max(extent.east_m, extent.north_m) / max_cells,
                            std::sqrt(extent.east_m * extent.north_m / max_vertices)});
  extent.cell_m = std::ceil(100.0 * extent.cell_m) / 100.0;
  return extent;
}

void add_sea(const LineModel& model, Keys& keys) {
  keys.section("sea");
  keys.add("sound_speed_mps", number(model.sound_speed_mps), {Confidence::assumed, "usual"});
  keys.add("absorption_db_per_km", number(std::round(1e3 * model.absorption_db_per_m)),
           {Confidence::assumed, "of sea water at that frequency"});
}

constexpr std::string_view bed_material = "bed";

/// The brightest tone has the sediment's own strength, so that none returns more than a surface
/// can. The gain compensates for it, except while it is automatic.
double headroom_db(const LineModel& model) {
  int brightest = 0;
  for (const std::int8_t step : model.tones.steps) brightest = std::max(brightest, int{step});
  return model.gain_db ? brightest * ToneMap::step_db : 0.0;
}

void add_strength(const LineModel& model, int step, Evidence evidence, Keys& keys) {
  const auto why = model.evidence.find("material.bed.like");
  keys.add("like", toml_string(model.material),
           why == model.evidence.end() ? Evidence{} : why->second);
  keys.add("strength_offset_db", fmt::format("{:g}", step * ToneMap::step_db - headroom_db(model)),
           std::move(evidence));
}

std::string beginning(const LineModel& model) {
  return model.texture_shape > 0.0
             ? "version = 1\nconditions = \"ideal\"\nseed = 1\ntexture = true\n"
             : "version = 1\nconditions = \"ideal\"\nseed = 1\n";
}

void add_texture(const LineModel& model, Keys& keys) {
  if (!(model.texture_shape > 0.0)) return;
  keys.add("texture_shape", number(model.texture_shape),
           {Confidence::fitted, "contrast at low grazing angles"});
  keys.add("glint_share", number(model.glint_share),
           {Confidence::fitted, "kurtosis at 8 to 20 degrees"});
  keys.assume("variation_db", "0", "the patches already have the slow changes");
}

void add_bed(const LineModel& model, const BedExtent& extent, Keys& keys) {
  keys.section("seafloor");
  keys.assume("kind", "\"fractal\"",
              "a level bed with relief; the vehicle's altitude contains the slopes");
  keys.assume("extent_east_m", number(extent.east_m), "the track and the range");
  keys.assume("extent_north_m", number(extent.north_m), "the same");
  keys.assume("cell_m", number(extent.cell_m), "two bins, or what fits into memory");
  keys.add("depth_m",
           number(std::round(100.0 * (model.path.bed_depth_m + model.altitude_shift_m)) / 100.0),
           model.path.depth);
  keys.assume("material", toml_string(bed_material), "a name chosen for this scene");
  keys.section("seafloor.fractal");
  keys.assume("height_at_1m_m", number(model.height_at_1m_m),
              "usual; fits the correlation of the samples");
  keys.assume("hurst", "0.5", "usual");
  keys.assume("longest_m", "10", "the vehicle's altitude contains longer waves");
  keys.section(fmt::format("material.{}", bed_material));
  add_strength(model, 0, {Confidence::assumed, "the gain compensates for it"}, keys);
  add_texture(model, keys);
}

/// A patch and its material for each step of tone that there is.
void add_tones(const LineModel& model, Keys& keys) {
  int number = 0;
  for (int step = -ToneMap::max_steps; step <= ToneMap::max_steps; ++step) {
    if (step == 0 || std::ranges::count(model.tones.steps, step) == 0) continue;
    const std::string name = fmt::format("{}{}", step < 0 ? "darker" : "brighter", std::abs(step));
    const Evidence from{Confidence::measured,
                        "level of tiles over the line's mean at the same angle and side"};
    keys.section(fmt::format("seafloor.patches.{}", number++));
    keys.add("material", toml_string(name), from);
    keys.add("image", "\"tones.png\"", from);
    keys.add("image_value", fmt::format("{}", step + ToneMap::max_steps + 1), from);
    keys.section(fmt::format("material.{}", name));
    add_strength(model, step, from, keys);
    add_texture(model, keys);
  }
}

/// `beam` is the name of the vertical beam's file.
void add_sonar(const LineModel& model, std::string_view beam, Keys& keys) {
  const RecorderSigns& recorder = model.recorder;
  keys.section(sonar_section_name);
  if (!model.port || !model.starboard)
    keys.add("sides", model.port ? "\"port\"" : "\"starboard\"",
             {Confidence::stated, "the other side is missing or silent"});
  keys.add("frequency_hz", number(model.frequency_hz), {});
  if (model.pulse.kind == PulseKind::lfm) {
    keys.add("pulse", "\"lfm\"", {});
    if (model.pulse.window == PulseWindow::hann) keys.add("window", "\"hann\"", {});
    if (model.pulse.length_s > 0.0) keys.add("pulse_length_s", number(model.pulse.length_s), {});
  }
  keys.add("bandwidth_hz", number(model.pulse.bandwidth_hz), {});
  keys.add("range_m", fmt::format("{:.8g}", model.range_m), {Confidence::stated, "of most pings"});
  keys.add("bins", fmt::format("{}", model.samples), {Confidence::stated, "samples of a side"});
  keys.add("array_length_m", number(model.array_length_m), {});
  if (model.has_pattern()) {
    keys.add("vertical_pattern", toml_string(beam), {});
  } else {
    keys.add("vertical_beamwidth_deg", number(model.beamwidth_rad / degree), {});
    keys.add("tilt_deg", number(model.tilt_rad / degree), {});
  }
  keys.assume("planes", "4", "enough for a beam without side lobes");
  keys.assume("elevations",
              fmt::format("{}", std::clamp<std::size_t>(model.samples * 3 / 2, 1000, 8000)),
              "some rays per bin");
  keys.assume("noise", "false", "all noise is in output_noise_db");
  keys.add("output_noise_db", number(std::round(100.0 * model.output_noise_db) / 100.0), {});
  keys.add("tvg_spreading", number(model.range_law.spreading), model.range_law.from);
  keys.add("tvg_absorption", boolean(model.range_law.absorption), model.range_law.from);
  if (model.gain_db)
    keys.add("gain_db", number(std::round(100.0 * (*model.gain_db + headroom_db(model))) / 100.0),
             {});
  if (model.ping_gain_db > 0.0)
    keys.add("ping_gain_db", fmt::format("{:.2f}", model.ping_gain_db),
             {Confidence::measured, "near and far bed get brighter together from ping to ping"});
  keys.add("looks", fmt::format("{}", recorder.looks), recorder.looks_from);
  keys.add("detector", recorder.detector == Detector::peak ? "\"peak\"" : "\"mean\"",
           recorder.looks_from);
  keys.add("ping_mean", number(recorder.ping_mean), recorder.ping_mean_from);
  if (recorder.curve == TransferCurve::logarithmic) {
    keys.add("curve", "\"logarithmic\"", recorder.curve_from);
    keys.add("curve_range_db", number(std::round(recorder.curve_range_db)),
             recorder.curve_range_from);
  } else {
    keys.add("curve",
             recorder.curve == TransferCurve::square_root ? "\"square-root\"" : "\"linear\"",
             recorder.curve_from);
  }
  keys.add("bits", fmt::format("{}", recorder.bits), recorder.bits_from);
  keys.section("arrivals");
  keys.add("burst_m", number(std::round(100.0 * recorder.burst_m) / 100.0), recorder.burst_from);
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

/// A draw between two numbers, as a recipe has it.
std::string uniform(double low, double high, int digits) {
  return fmt::format("{{ uniform = [{0:.{2}g}, {1:.{2}g}] }}", low, high, digits);
}
std::string about(double value, double share) {
  return uniform(value * (1.0 - share), value * (1.0 + share), 6);
}

/// The bed of the scene for a straight line to the north, with its relief and its depth drawn.
void add_drawn_bed(const LineModel& model, double track_m, double max_altitude_m, Keys& keys) {
  add_bed(model, extent_of(model, 0.0, track_m), keys);
  const double min_depth_m = std::max(model.path.bed_depth_m, 1.2 * max_altitude_m + 1.0);
  for (FoundKey& key : keys.keys) {
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
  keys.section("motion");
  keys.add("crab_deg", uniform(quantile(crabs_deg, 0.1), quantile(crabs_deg, 0.9) + 0.01, 3),
           {Confidence::measured, "from the 10th to the 90th percentile of heading less course"});
}

void add_oscillations(const VehiclePath& path, Keys& keys) {
  struct Freedom {
    std::string_view name, unit;
    const std::vector<double>& values;
    double unit_size, max_rms;  // that a scene may have
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
    keys.section(fmt::format("motion.{}", freedom.name));
    keys.add(fmt::format("rms_{}", freedom.unit),
             about(std::min(found.rms / freedom.unit_size, freedom.max_rms / 1.5), 0.5), from);
    keys.add("period_s", about(std::clamp(found.period_s, 0.1, 3000.0), 0.2), from);
  }
}

}  // namespace

std::string_view name_of(Confidence how) {
  switch (how) {
    case Confidence::stated: return "stated";
    case Confidence::measured: return "measured";
    case Confidence::fitted: return "fitted";
    case Confidence::assumed: break;
  }
  return "assumed";
}

BedExtent bed_extent(const LineModel& model) {
  const auto [west, east] = std::ranges::minmax(model.path.x_m);
  const auto [south, north] = std::ranges::minmax(model.path.y_m);
  return extent_of(model, east - west, north - south);
}

std::vector<FoundKey> found_keys(const LineModel& model) {
  Keys keys(model);
  add_sea(model, keys);
  add_bed(model, model.bed, keys);
  add_tones(model, keys);
  keys.section("track");
  keys.add("kind", "\"file\"", model.path.place);
  keys.add("file", "\"navigation.csv\"", model.path.attitude);
  if (model.path.origin) {
    keys.add("origin_lat_deg", fmt::format("{:.9g}", model.path.origin->latitude_rad / degree),
             model.path.place);
    keys.add("origin_lon_deg", fmt::format("{:.9g}", model.path.origin->longitude_rad / degree),
             model.path.place);
  }
  add_sonar(model, "beam.csv", keys);
  return keys.keys;
}

std::string scene_text(const LineModel& model) {
  return text_of(found_keys(model),
                 "# Made by `ensonify imitate`. The comment of each key gives its evidence: the "
                 "recording\n# states it, its samples show it, it was fitted to them, or it is a "
                 "usual value.\n" +
                     beginning(model));
}

std::string navigation_csv(const LineModel& model) {
  const VehiclePath& path = model.path;
  std::string csv = "t_s,x_m,y_m,depth_m";
  struct Column {
    std::string_view name;
    const std::vector<double>& values;
  };
  std::vector<Column> angles;
  for (const Column& column : {Column{"roll_deg", path.roll_rad},
                               {"pitch_deg", path.pitch_rad},
                               {"heading_deg", path.heading_rad}})
    if (!column.values.empty()) angles.push_back(column);
  for (const Column& column : angles) csv += fmt::format(",{}", column.name);
  csv += "\n";
  for (std::size_t i = 0; i < path.t_s.size(); ++i) {
    csv += fmt::format("{:.3f},{:.3f},{:.3f},{:.3f}", path.t_s[i], path.x_m[i], path.y_m[i],
                       path.bed_depth_m - path.altitude_m[i]);
    for (const Column& column : angles) csv += fmt::format(",{:.3f}", column.values[i] / degree);
    csv += "\n";
  }
  return csv;
}

std::vector<std::byte> tones_png(const LineModel& model) {
  Picture picture{model.tones.columns, model.tones.rows, 1, {}};
  for (const std::int8_t step : model.tones.steps)
    picture.pixels.push_back(
        static_cast<std::uint8_t>(step == 0 ? 0 : step + ToneMap::max_steps + 1));
  return encode_png(picture);
}

std::string beam_csv(const LineModel& model) {
  double loudest = -1e9;
  for (const std::vector<double>& side : model.vertical_db)
    for (const double level : side) loudest = std::max(loudest, level);
  // Cells are about their middles; the levels of the ends hold beyond them.
  std::string csv = "depression_deg,port_db,starboard_db\n";
  for (std::size_t i = 0; i < grazing_cells; ++i)
    csv += fmt::format("{},{:.3f},{:.3f}\n", (static_cast<double>(i) + 0.5) * grazing_cell_deg,
                       0.5 * (model.vertical_db[0][i] - loudest),
                       0.5 * (model.vertical_db[1][i] - loudest));
  return csv;
}

std::string recipe_text(const LineModel& model) {
  const VehiclePath& path = model.path;
  std::vector<double> altitudes = path.altitude_m;
  std::ranges::sort(altitudes);
  const double low_m = altitudes[altitudes.size() / 10],
               high_m = altitudes[altitudes.size() * 9 / 10];
  const double speed_mps = std::clamp(path.speed_mps, 0.2, 20.0);
  constexpr int pings = 400;
  Keys keys(model);
  add_sea(model, keys);
  add_drawn_bed(model, pings * speed_mps * path.ping_interval_s * 1.2, high_m, keys);
  keys.section("track");
  keys.assume("kind", "\"line\"", "a straight line, as long as the recorder's pictures are");
  keys.assume("pings", fmt::format("{}", pings), "per sample");
  keys.add("speed_mps", about(speed_mps, 0.2), path.place);
  keys.add("ping_interval_s", number(path.ping_interval_s), path.time);
  keys.assume("heading_deg", "0", "along the bed's longer side");
  keys.add("altitude_m", uniform(low_m, std::max(high_m, low_m * 1.01), 4),
           {Confidence::measured, "from the 10th to the 90th percentile of the bottom line"});
  add_crab(path, keys);
  add_oscillations(path, keys);
  add_sonar(model, "data:beam.csv", keys);
  keys.section("output");
  keys.assume("exr", "false", "pictures are enough");
  return text_of(
      keys.keys,
      "# Made by `ensonify imitate --recipe`: the imitation's sonar and bed, with distributions\n"
      "# about what was found. Its folder has the sonar's beam:\n"
      "#   ensonify preview DIR/recipe.toml --data DIR -o sheet.png\n"
      "#   ensonify generate DIR/recipe.toml --data DIR -o samples\n"
      "# Add [[objects]] for targets.\n" +
          beginning(model) +
          "\n[dataset]\ntitle = \"As a recording\"\nsamples = 64\nseafloors = 16\n");
}

}  // namespace ensonify::engine
