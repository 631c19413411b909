#include <ensonify/engine/imitation/imitate.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/imitation/crab.h>
#include <ensonify/engine/imitation/line_fit.h>
#include <ensonify/engine/imitation/ping_gains.h>
#include <ensonify/engine/imitation/pulse_signs.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/sonar/instrument/shading.h>
#include <ensonify/refine/standard_floats.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t max_pings = 3000, fewest_pings = 64;
constexpr std::size_t block = 32, max_fit_blocks = 7;

/// The pings in the middle of the line that have one range. Throws RecordingError if there are too
/// few, or if all samples are equal.
RecordedLine usable_part(const RecordedLine& line, std::vector<std::string>& unknown) {
  auto [alike, left_out] = alike_pings(line);
  const std::size_t pings = alike.pings.size();
  if (pings == 0 || !(alike.pings.front().range_m > 0.0))
    throw RecordingError(
        "the recording does not state the range of its pings, which an imitation needs");
  constexpr double longest_m = 20e3;  // the longest range of a scene's sonars
  if (const double range_m = alike.pings.front().range_m; range_m > longest_m)
    throw RecordingError(fmt::format(
        "the pings state a range of {:.3g} m, expected at most {:.3g} m; is the recording damaged?",
        range_m, longest_m));
  if (pings < fewest_pings)
    throw RecordingError(fmt::format(
        "the recording has {} ping{} of one range and length, and an imitation needs {}", pings,
        pings == 1 ? "" : "s", fewest_pings));
  std::vector<float> lowest, highest;
  for (const Side side : alike.sides()) {
    lowest.push_back(std::ranges::min(alike.side(side)));
    highest.push_back(std::ranges::max(alike.side(side)));
  }
  if (std::ranges::min(lowest) == std::ranges::max(highest))
    throw RecordingError(fmt::format(
        "all samples of the recording are {}, expected echoes; is it the recording of a sonar that "
        "was on?",
        highest.front()));
  if (!left_out.empty()) unknown.push_back(left_out);
  if (pings <= max_pings) return std::move(alike);
  unknown.push_back(
      fmt::format("the line has {} pings; the {} in its middle are imitated", pings, max_pings));
  std::vector<std::size_t> middle(max_pings);
  std::iota(middle.begin(), middle.end(), (pings - max_pings) / 2);
  return some_pings(alike, middle);
}

/// The share of the pings in which all samples of a side are 0.
double silent_share(const RecordedLine& line, Side side) {
  if (line.side(side).empty()) return 1.0;
  std::size_t silent = 0;
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
    silent += std::ranges::all_of(line.row(side, ping), [](float value) { return value == 0.0f; });
  return static_cast<double>(silent) / static_cast<double>(line.pings.size());
}

/// Leaves out a side whose samples are 0 in nearly all pings, if the other side has echoes. (A
/// reader of recordings leaves out a side that is 0 in all pings.)
void leave_out_silent_side(RecordedLine& line, std::vector<std::string>& unknown) {
  const double port = silent_share(line, Side::port),
               starboard = silent_share(line, Side::starboard);
  constexpr double nearly_all = 0.9;
  if (std::max(port, starboard) < nearly_all || std::min(port, starboard) >= nearly_all) return;
  const std::string_view side = name_of(port > starboard ? Side::port : Side::starboard);
  std::vector<float>& rows = port > starboard ? line.port : line.starboard;
  unknown.push_back(
      rows.empty() ? fmt::format("the {} side: the recording has no samples of it", side)
                   : fmt::format("the {} side: it is silent in {:.0f} % of the pings and left out",
                                 side, 100.0 * std::max(port, starboard)));
  rows.clear();
}

/// Adds doubts about the altitude to `unknown`.
void note_altitudes(const RecordedLine& line, const VehiclePath& path,
                    std::vector<std::string>& unknown) {
  if (path.altitude.how == Confidence::stated)
    unknown.emplace_back(
        "whether the altitude is right: the samples do not show the bottom line, or not well, so it "
        "is what the pings state");
  std::vector<double> off_m;
  for (std::size_t i = 0; i < line.pings.size(); ++i)
    if (line.pings[i].altitude_m) off_m.push_back(*line.pings[i].altitude_m - path.altitude_m[i]);
  constexpr double alike = 0.05;  // share of the altitude
  const double median_off_m = median(std::move(off_m));
  if (std::abs(median_off_m) > alike * median(path.altitude_m))
    unknown.push_back(fmt::format(
        "the altitude: the stated altitudes are {:.2f} m {} the bottom line, which is used; {}",
        std::abs(median_off_m), median_off_m > 0.0 ? "above" : "below",
        median_off_m > 0.0
            ? "fish or the wake may look like bed, or the samples have no water column"
            : "noise may hide the nearest bed"));
}

bool states_vertical_beam(const RecordedLine& line) {
  return line.vertical_beamwidth_rad > 0.0 && line.tilt_rad.has_value();
}

bool states_frequency(const RecordedLine& line) {
  return line.frequency_hz >= 1e3 && line.frequency_hz <= 10e6;
}

/// Sets the bandwidth and the kind of the pulse to what the file states; otherwise to CW, as long
/// as a sample.
void set_pulse(const RecordedLine& line, LineModel& model) {
  const double bin_m = model.range_m / static_cast<double>(model.samples);
  const double one_sample_hz = 0.5 * model.sound_speed_mps / bin_m;
  model.pulse.bandwidth_hz = std::min(one_sample_hz, 0.5 * model.frequency_hz);
  if (line.bandwidth_hz < 10.0 || !(line.bandwidth_hz < line.frequency_hz)) return;
  const Evidence stated{Confidence::stated, "of the channel"};
  model.pulse.bandwidth_hz = line.bandwidth_hz;
  model.evidence["sonar.sidescan.bandwidth_hz"] = stated;
  constexpr double min_sweep = 2.0;  // bandwidth times length; a CW pulse has 1
  const double longest_s = std::min(1.0, model.range_m / model.sound_speed_mps);
  if (line.pulse_length_s * line.bandwidth_hz > min_sweep && line.pulse_length_s < longest_s &&
      line.bandwidth_hz > min_bandwidth * one_sample_hz) {
    model.pulse.kind = PulseKind::lfm;
    model.pulse.length_s = line.pulse_length_s;
    for (const char* key : {"sonar.sidescan.pulse", "sonar.sidescan.pulse_length_s"})
      model.evidence[key] = stated;
  }
}

/// Sets the array's length, by the stated beam width, and the vertical beam; or usual values.
void set_beam(const RecordedLine& line, LineModel& model) {
  const double wavelength_m = model.sound_speed_mps / model.frequency_hz;
  constexpr double usual_beamwidth_rad = 0.5 * degree;
  const bool width_stated = line.beamwidth_rad > 1e-3 && line.beamwidth_rad < 0.5;
  model.array_length_m = Shading().beam_width_x() * wavelength_m /
                         (width_stated ? line.beamwidth_rad : usual_beamwidth_rad);
  if (width_stated)
    model.evidence["sonar.sidescan.array_length_m"] = {Confidence::stated, "the beam's width"};
  const VerticalPattern usual;
  model.beamwidth_rad = usual.beamwidth_rad;
  model.tilt_rad = usual.tilt_rad;
  if (!states_vertical_beam(line)) return;
  model.beamwidth_rad = line.vertical_beamwidth_rad;
  model.tilt_rad = *line.tilt_rad;
  for (const char* key : {"sonar.sidescan.vertical_beamwidth_deg", "sonar.sidescan.tilt_deg"})
    model.evidence[key] = {Confidence::stated, "of the channel"};
}

/// Adds to `unknown` what the recording lacks.
void note_missing(const RecordedLine& line, const LineModel& model,
                  std::vector<std::string>& unknown) {
  if (model.unrecorded > 0)
    unknown.push_back(fmt::format(
        "the first {:.2f} m of range: the recording begins there, and a run of the scene has samples "
        "from 0 m on",
        static_cast<double>(model.unrecorded) * model.range_m /
            static_cast<double>(model.samples)));
  if (model.path.place.how == Confidence::assumed)
    unknown.push_back("how fast the vehicle is, and where it goes: " + model.path.place.why);
  // If the water is not darker than the bed, find_bed() may have found a change of the bed.
  constexpr double clearly_db = 10.0;
  std::vector<double> levels_db;
  for (const GrazingLevels& side : model.levels_db)
    for (const double level_db : side)
      if (std::isfinite(level_db)) levels_db.push_back(level_db);
  const double darker_db = median(std::move(levels_db)) - model.recorder.column_db;
  if (model.recorder.column_from.how == Confidence::measured && darker_db < clearly_db)
    unknown.push_back(fmt::format(
        "whether the bottom line is right: the samples before it are only {:.0f} dB darker than the "
        "bed, as where noise is strong, where the water column was cut off, or where the samples "
        "were moved to ground range",
        std::max(darker_db, 0.0)));
  for (const Side side : line.sides()) {
    constexpr double noticed = 0.05;
    if (const double share = silent_share(line, side); share > noticed)
      unknown.push_back(fmt::format(
          "why the {} side is silent in {:.0f} % of the pings; it is imitated as if it were not",
          name_of(side), 100.0 * share));
  }
}

/// Adds to `unknown` what the first model leaves open.
void note_gaps(const RecordedLine& line, const LineModel& model,
               std::vector<std::string>& unknown) {
  if (model.path.attitude.how == Confidence::assumed)
    unknown.emplace_back("how the vehicle rolls and pitches: the pings have no attitude");
  if (!states_frequency(line))
    unknown.emplace_back("the frequency: the file does not state it, and samples do not show it");
  if (model.recorder.has_automatic_gain())
    unknown.push_back(fmt::format(
        "the vertical beam, the gain over range, the sediment{}: an automatic gain of the recorder{} "
        "makes {} equally bright, and the scene has what it left; record without it to have them",
        model.recorder.even_ranges ? " and the noise" : " and the tones",
        model.recorder.even_ranges ? ", or noise that hides the echoes," : "",
        model.recorder.even_ranges
            ? "all ranges, the water column as well,"
            : fmt::format("stretches of {} samples", model.recorder.even_samples)));
  else if (std::isnan(model.range_slope_db) && !states_vertical_beam(line))
    unknown.emplace_back(
        "the gain over range apart from the vertical beam: the altitude changes too little, or the "
        "bed too much, to tell");
  if (model.recorder.curve_from.how == Confidence::assumed)
    unknown.push_back("the recorder's curve: " + model.recorder.curve_from.why);
  if (model.recorder.curve == TransferCurve::logarithmic)
    unknown.emplace_back(
        "the recorder's looks, and with them the range of its logarithmic curve: texture and relief "
        "of the bed may look like more looks");
  if (model.recorder.column_from.how == Confidence::assumed && !model.recorder.even_ranges)
    unknown.push_back("the noise: " + model.recorder.column_from.why);
}

/// The model before the first simulation.
LineModel first_model(const LineWithBed& line) {
  LineModel model;
  model.path = vehicle_path(line);
  model.recorder = recorder_signs(line);
  model.samples = line.samples;
  for (const RecordedPing& ping : line.pings)
    model.unrecorded = std::max(model.unrecorded, ping.unrecorded);
  model.output_noise_db = std::clamp(model.recorder.column_db, -130.0, -6.0);
  model.evidence["sonar.sidescan.output_noise_db"] = model.recorder.column_from;
  model.port = !line.port.empty();
  model.starboard = !line.starboard.empty();
  if (line.sound_speed_mps > 0.0) {
    model.sound_speed_mps = line.sound_speed_mps;
    model.evidence["sea.sound_speed_mps"] = {Confidence::stated, "of the pings"};
  }
  std::vector<double> ranges;
  for (const RecordedPing& ping : line.pings) ranges.push_back(ping.range_m);
  model.range_m = median(std::move(ranges));
  if (states_frequency(line)) model.frequency_hz = line.frequency_hz;
  model.evidence["sonar.sidescan.frequency_hz"] =
      states_frequency(line) ? Evidence{Confidence::stated, "of the channel"}
                             : Evidence{Confidence::assumed, "the file does not state it"};
  model.absorption_db_per_m = scatter::absorption_db_per_m(
      scatter::SeaWater{}, 0.5 * model.path.bed_depth_m, model.frequency_hz);
  set_pulse(line, model);
  set_beam(line, model);
  model.range_slope_db = range_slope_db(line, model.recorder);
  model.levels_db = grazing_levels_of_sides(line, model.recorder);
  return model;
}

/// Every second block of pings is for the fit; the others are for the judgement. The fit simulates
/// only some of its blocks, spread over the line.
struct Halves {
  std::vector<std::size_t> fit, simulated, judged;

  explicit Halves(std::size_t pings) {
    const std::size_t fit_blocks = ((pings + block / 2) / block + 1) / 2,
                      step = (fit_blocks + max_fit_blocks - 1) / max_fit_blocks;
    for (std::size_t first = 0; first + block / 2 <= pings; first += block)
      for (std::size_t i = first; i < std::min(first + block, pings); ++i) {
        const std::size_t number = first / block;
        (number % 2 == 0 ? fit : judged).push_back(i);
        if (number % (2 * step) == 0) simulated.push_back(i);
      }
  }
};

/// Adds to `unknown` where objects lie that the imitation lacks.
void note_objects(const LineWithBed& line, const LineModel& model,
                  std::vector<std::string>& unknown) {
  const std::vector<BrightObject> objects = bright_objects(line, model.path, model.recorder);
  if (objects.empty()) return;
  constexpr std::size_t named = 5;
  std::string places;
  for (std::size_t i = 0; i < std::min(objects.size(), named); ++i)
    places += fmt::format("{}{:.1f} m to {} of ping {} ({:.0f} dB)", i == 0 ? "" : ", ",
                          objects[i].range_m, name_of(objects[i].side),
                          line.pings[objects[i].ping].number, objects[i].over_bed_db);
  if (objects.size() > named) places += fmt::format(" and {} more", objects.size() - named);
  unknown.push_back(
      "single bright objects, which the imitation lacks; they exceed the bed around them at a range "
      "of " +
      places);
}

/// Adds to `unknown` what the fit did not reach: keys at limits, and contrasts that still differ.
void note_limits(const Imitation& made, std::vector<std::string>& unknown) {
  for (const FoundKey& key : found_keys(made.model))
    if (key.evidence.at_limit)
      unknown.push_back(fmt::format("which {} would fit: {} is at its limit ({})", key.name(),
                                    key.value, key.evidence.why));
  constexpr double alike = 0.1;
  std::string contrasts;
  bool too_smooth = false;
  for (const ComparedStatistic& one : made.statistics) {
    if (one.part.curve != StatisticCurve::contrast_over_grazing) continue;
    if (!(std::abs(one.b / one.a - 1.0) > alike && one.ratio() > 1.0)) continue;
    too_smooth = too_smooth || (one.b < one.a && made.model.texture_shape > 0.0);
    contrasts +=
        fmt::format("{} {:.2f} at {} to {} degrees, where the imitation has {:.2f}",
                    contrasts.empty() ? "" : ",", one.a, one.part.low, one.part.high, one.b);
  }
  if (!contrasts.empty())
    unknown.push_back(fmt::format(
        "what makes the recording's contrast of{}{}", contrasts,
        too_smooth ? "; where the beam is wide, it has many patches of texture, which average out, "
                     "so that no texture makes the bed more uneven"
                   : ""));
}

}  // namespace

Imitation imitate(const RecordedLine& recording, const std::filesystem::path& folder,
                  const ImitationControl& control) {
  const refine::StandardFloats floats;
  Imitation made;
  RecordedLine line = usable_part(recording, made.unknown);
  leave_out_silent_side(line, made.unknown);
  const VehiclePath path = vehicle_path(LineWithBed(line));
  note_altitudes(line, path, made.unknown);
  // The bottom line of the whole recording then guides the search for it in parts of the recording.
  for (std::size_t i = 0; i < line.pings.size(); ++i) line.pings[i].altitude_m = path.altitude_m[i];
  made.line = LineWithBed(std::move(line));
  const Halves halves(made.line.pings.size());
  LineModel& model = made.model;
  // The bed, the beam and the sediment are found from pings without changes of the gain.
  const RecorderSigns recorder = recorder_signs(made.line);
  const PingGains gains = ping_gains(made.line, recorder);
  const LineWithBed even = without_ping_gains(made.line, gains, recorder);
  const LineWithBed half(some_pings(even, halves.fit));
  model = first_model(half);
  note_gaps(half, model, made.unknown);
  // The path has all pings: where the vehicle is does not come from the fit.
  model.path = path;
  note_missing(made.line, model, made.unknown);
  if (!model.path.heading_instead.empty())
    made.unknown.push_back("the headings: " + model.path.heading_instead);
  const HeadingCheck check = correct_heading(made.line, model.path);
  if (check.exchanged)
    made.unknown.emplace_back(
        "whether port and starboard are exchanged in the file, or its headings mirrored: the "
        "samples contradict them");
  if (check.long_forms)
    made.unknown.emplace_back(
        "whether the headings are right: ripples or other long forms of the bed hide how it moves");
  model.bed = bed_extent(model);
  model.tones = tone_map(half, some_pings(model.path, halves.fit), model.recorder,
                         model.range_slope_db, model.bed.east_m, model.bed.north_m);
  // With an automatic gain, the level over the angle does not show the bed.
  const bool beam_is_stated =
      states_vertical_beam(made.line) && !model.recorder.has_automatic_gain();

  const auto report = [&](std::string_view stage, std::size_t done, std::size_t of) {
    if (control.progress && !control.progress(stage, done, of))
      throw Stopped("imitate was stopped; nothing was written");
  };
  VehiclePath whole = std::exchange(model.path, some_pings(model.path, halves.simulated));
  const std::vector<NearSediment> sediments =
      fit_line(model, LineWithBed(some_pings(even, halves.simulated)), control.threads,
               beam_is_stated, std::bind_front(report, "fit"));
  model.path = std::move(whole);
  model.ping_gain_db = gains.rms_db;
  for (const NearSediment& sediment : sediments) made.materials.push_back(sediment.name);
  made.imitated =
      LineWithBed(simulated_line(model, control.threads, std::bind_front(report, "pings")).line);
  made.judged = LineWithBed(some_pings(made.line, halves.judged));
  made.judged_imitated = LineWithBed(some_pings(made.imitated, halves.judged));
  made.statistics = compare_lines(made.judged, made.judged_imitated);
  note_limits(made, made.unknown);
  note_objects(even, model, made.unknown);
  made.unknown.emplace_back(
      "single objects and forms of the bed: only their statistics are imitated");
  made.unknown.emplace_back(
      "source level, bed strength and gain separately; only their sum is known");
  if (model.how("sonar.sidescan.array_length_m") == Confidence::fitted)
    made.unknown.emplace_back("the array's length: texture and relief change the same statistic");
  if (model.how("sonar.sidescan.bandwidth_hz") == Confidence::stated &&
      model.how("sonar.sidescan.pulse") == Confidence::assumed)
    made.unknown.emplace_back("the pulse: the file states its bandwidth alone, so it is CW here");
  if (has_several_beams(made.line))
    made.unknown.emplace_back(
        "the sonar's beams: each of its rows is a ping of a sonar with one beam here");
  constexpr double far_off_db = 1.5;
  if (beam_is_stated && !sediments.empty() && sediments.front().rms_db > far_off_db)
    made.unknown.push_back(fmt::format(
        "why the level over the angle is {:.1f} dB off that of any sediment with the stated beam",
        sediments.front().rms_db));
  if (const std::size_t alike = as_near_as_the_first(sediments); beam_is_stated && alike > 1) {
    std::string names;
    for (std::size_t i = 0; i < alike; ++i)
      names += (i == 0 ? "" : i + 1 < alike ? ", " : " and ") + sediments[i].name;
    made.unknown.push_back(fmt::format(
        "which sediment the bed is: in this recording {} cannot be distinguished", names));
  }
  constexpr double mostly_clipped = 0.5;
  for (const ComparedStatistic& one : made.statistics)
    if (one.name == "clipped_share" && one.a > mostly_clipped)
      made.unknown.push_back(fmt::format(
          "the level of the bed: {:.0f} % of its samples are at full scale", 100.0 * one.a));
  if (!beam_is_stated && !model.recorder.has_automatic_gain())
    made.unknown.emplace_back(
        "the vertical beam apart from the bed's material: both make the level over the angle");
  write_scene(model, folder);
  return made;
}

}  // namespace ensonify::engine
