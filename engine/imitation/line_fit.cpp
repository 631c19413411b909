#include <ensonify/engine/imitation/line_fit.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include <fmt/format.h>

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/comparison/line_statistics.h>
#include <ensonify/engine/imitation/pulse_signs.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

/// A number that the fit corrects in each round, within limits.
struct FittedKey {
  const char* key;
  const char* statistic;         ///< what the number is fitted to
  double least, most;            ///< limits of the value
  double least_step, most_step;  ///< of a round: a term for levels and exponents, else a factor

  double step(double change) const { return std::clamp(change, least_step, most_step); }
  Evidence set(double to, double& value) const {
    value = std::clamp(to, least, most);
    return within_limits({Confidence::fitted, statistic}, value, least, most);
  }
};
// clang-format off
constexpr FittedKey  // key, statistic; values, steps
    spreading{"sonar.sidescan.tvg_spreading", "level over range",
              0.0, 80.0, -8.0, 8.0},
    output_noise{"sonar.sidescan.output_noise_db", "level of the water column",
                 -150.0, -3.0, -20.0, 20.0},
    relief{"seafloor.fractal.height_at_1m_m", "correlation over 2 and 4 samples",
           5e-4, 0.08, 0.6, 1.5},
    texture_shape{"material.bed.texture_shape", "contrast at low grazing angles",
                  0.005, 20.0, 0.2, 5.0},
    glint_share{"material.bed.glint_share", "kurtosis at 8 to 20 degrees",
                0.01, 0.8, 0.5, 2.0},
    array_length{"sonar.sidescan.array_length_m", "correlation of neighbouring pings",
                 0.05, 5.0, 0.7, 1.4};
// clang-format on
constexpr const char* bandwidth_key = "sonar.sidescan.bandwidth_hz";
/// The bands of grazing angle, in degrees, whose samples show texture best.
constexpr std::array low_bands{"8_to_14", "14_to_20"};

std::string contrast_at(const char* band) { return fmt::format("contrast_at_{}_deg", band); }

/// The numbers of a line that the fit compares.
struct Figures {
  std::map<std::string, double> statistics;
  std::map<int, double> level_over_range;  // key: where the part begins, in percent of the range
  std::array<GrazingLevels, 2> levels;
  double lasting_peaks;

  Figures(const LineWithBed& line, const RecorderSigns& recorder)
      : levels(grazing_levels_of_sides(line, recorder)),
        lasting_peaks(engine::lasting_peaks(line)) {
    for (const LineStatistic& one : line_statistics(line, 0, line.pings.size())) {
      statistics[one.name] = one.value;
      if (one.part.curve == StatisticCurve::level_over_range)
        level_over_range[one.part.low] = one.value;
    }
  }
  double operator[](const std::string& name) const { return statistics.at(name); }
};

/// The correlation of the amplitudes of two pings at a distance d, for d over the array's length L.
/// The intensity of a two-way line array has the angular pattern sinc^4, whose transform is the
/// cubic B-spline of 2 d / L. The correlation of the amplitudes is nearly the square of this
/// spline, scaled to 1 at d = 0.
double array_correlation(double distance_over_length) {
  const double x = 2.0 * distance_over_length;
  const double spline = x < 1.0   ? 2.0 / 3.0 - x * x + 0.5 * x * x * x
                        : x < 2.0 ? std::pow(2.0 - x, 3) / 6.0
                                  : 0.0;
  const double field = 1.5 * spline;
  return field * field;
}
/// The inverse of array_correlation().
double distance_over_length(double correlation) {
  constexpr double least = 0.02, most = 0.98;  // beyond, the distance hardly matters
  const double wanted = std::clamp(correlation, least, most);
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (array_correlation(middle) > wanted ? low : high) = middle;
  }
  return low;
}

/// Fills cells that are NaN with the known cell before them, or the first known cell; with 0 if
/// none is known.
void fill(std::vector<double>& cells) {
  const auto is_known = [](double cell) { return std::isfinite(cell); };
  const auto first = std::ranges::find_if(cells, is_known);
  double last = first == cells.end() ? 0.0 : *first;
  for (double& cell : cells) cell = last = is_known(cell) ? cell : last;
}

/// Scales the pings of a line as the recorder does: each side of each ping gets the mean amplitude
/// `ping_mean`. Pings at other altitudes then count as much as in the recording.
LineWithBed scaled(const LineWithBed& line, const RecorderSigns& recorder) {
  if (recorder.ping_mean == 0.0 || recorder.curve != TransferCurve::linear) return line;
  auto all = static_cast<const RecordedLine&>(line);  // without beds
  const std::size_t begin = line.samples / 50;        // beyond the transmitted pulse
  for (std::vector<float>* side : {&all.port, &all.starboard})
    for (std::size_t first = 0; first < side->size(); first += line.samples) {
      const std::span<float> row = std::span(*side).subspan(first, line.samples);
      double sum = 0.0;
      for (const float value : row.subspan(begin)) sum += value;
      if (!(sum > 0.0)) continue;
      const auto factor = static_cast<float>(recorder.ping_mean * recorder.full_scale *
                                             static_cast<double>(line.samples - begin) / sum);
      for (float& value : row)
        value = std::min(factor * value, static_cast<float>(recorder.full_scale));
    }
  return LineWithBed(std::move(all));
}

class Fit {
 public:
  Fit(LineModel& model, const LineWithBed& line)
      : model_(model), real_(line, model.recorder), array_shows_(!has_several_beams(line)) {
    begin_pulse();
  }

  /// Corrects the gain and the gain over range, after a simulation in which pings are not scaled.
  void correct_geometry(const LineWithBed& ours, double gain_db) {
    RecorderSigns unscaled = model_.recorder;
    unscaled.ping_mean = 0.0;
    const RangeLaw before = model_.range_law;
    model_.range_law = corrected_law(before, model_.range_slope_db, range_slope_db(ours, unscaled),
                                     model_.absorption_db_per_m, model_.range_m);
    // The noise floor is relative to full scale. If the bed had another level, its distance from
    // the floor would change the level over the angle and the bottom line.
    std::vector<double> louder_db;
    const GrazingLevels excess_db = excess_over(grazing_levels_of_sides(ours, model_.recorder));
    for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i)
      if (std::isfinite(excess_db[i]))
        louder_db.push_back(excess_db[i] - (law_db(model_.range_law, i) - law_db(before, i)));
    model_.gain_db = gain_db + mean_of(louder_db);
  }

  /// Corrects the altitude by the first echo of the bed, after a simulation with the line's own
  /// beam: where the beam is weaker straight down, the bed seems to begin later.
  void correct_altitude(const LineWithBed& ours) {
    // The path already has the altitudes that the whole recording shows. What is left is the error
    // of find_bed(), which is small. A larger difference comes from another beam or noise floor,
    // and says nothing about the altitude.
    if (model_.path.altitude.how == Confidence::stated) return;
    std::vector<double> off_m = first_bed_echoes_m(ours);
    for (std::size_t i = 0; i < off_m.size(); ++i)
      off_m[i] =
          model_.path.altitude_m[i] -
          off_m[i] * (model_.path.pitch_rad.empty() ? 1.0 : std::cos(model_.path.pitch_rad[i]));
    constexpr double most_bins = 5.0;
    const double shift_m = model_.altitude_shift_m + median(std::move(off_m));
    if (std::abs(shift_m) <= most_bins * model_.bin_m()) model_.altitude_shift_m = shift_m;
  }

  /// Chooses the material and, if the file does not state it, the beam, after a simulation with the
  /// sonar's formula beam and automatic gain. Returns nearest_sediments().
  std::vector<NearSediment> begin(const LineWithBed& ours, double gain_db, bool beam_is_stated) {
    // The gain is found before the pings are scaled, the level over the angle after it.
    const GrazingLevels unscaled = excess_over(grazing_levels_of_sides(ours, model_.recorder));
    const Figures simulated(scaled(ours, model_.recorder), model_.recorder);
    GrazingLevels both = excess_over(simulated.levels);
    GrazingLevels by_law{};  // the change by another gain over range
    if (model_.range_law.from.how == Confidence::assumed && beam_is_stated) {
      by_law = choose_range_law(both);
      for (std::size_t i = 0; i < grazing_cells; ++i) both[i] -= by_law[i];
    }
    std::vector<NearSediment> sediments = nearest_sediments(model_, both, beam_is_stated);
    const std::string before = model_.material;
    if (!sediments.empty()) model_.material = sediments.front().name;
    note_sediments(sediments, beam_is_stated);
    constexpr double plain_enough_db = 1.5, sides_alike_db = 1.0;
    const bool plain = beam_is_stated && !sediments.empty() &&
                       sediments.front().rms_db < plain_enough_db &&
                       !(std::abs(port_over_starboard_db(simulated)) > sides_alike_db);
    GrazingLevels weaker_db = strength_db(model_, before);  // how much weaker the new material is
    const GrazingLevels now_db = strength_db(model_, model_.material);
    for (std::size_t i = 0; i < grazing_cells; ++i) weaker_db[i] -= now_db[i];
    std::vector<double> offsets, gain_offsets;
    for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i)
      if (std::isfinite(both[i])) {
        offsets.push_back(both[i] + weaker_db[i]);
        gain_offsets.push_back(unscaled[i] - by_law[i] + weaker_db[i]);
      }
    model_.gain_db = gain_db + mean_of(gain_offsets);
    if (plain) return sediments;
    const VerticalPattern beam{.beamwidth_rad = model_.beamwidth_rad, .tilt_rad = model_.tilt_rad};
    for (const std::size_t side : {0u, 1u}) {
      std::vector<double>& vertical = model_.vertical_db[side];
      vertical.clear();
      for (std::size_t i = 0; i < grazing_cells; ++i)
        vertical.push_back(model_.levels_db[side][i] - simulated.levels[side][i] - by_law[i] +
                           weaker_db[i] - mean_of(offsets));
      fill(vertical);
      for (std::size_t i = 0; i < grazing_cells; ++i)
        vertical[i] += 20.0 * std::log10(beam.power(grazing_cell_rad(i), sidescan_sectors[side]));
    }
    complete_pattern();
    model_.evidence["sonar.sidescan.vertical_pattern"] = {
        Confidence::fitted, "level over the grazing angle of each side"};
    return sediments;
  }

  /// Corrects all other numbers, after a simulation of the whole chain.
  void correct(const LineWithBed& ours) {
    const Figures simulated(ours, model_.recorder);
    // A fitted beam contains the level over the angle, and with it most of the level over range.
    if (!model_.has_pattern()) correct_range_law(simulated);
    correct_levels(simulated);
    if (!model_.recorder.even_ranges) correct_floor(simulated);
    correct_relief(simulated);
    correct_texture(simulated);
    correct_bandwidth(simulated);
    correct_array(simulated);
  }

 private:
  /// The recording's level over the angle minus that of a simulation; the mean of both sides.
  GrazingLevels excess_over(const std::array<GrazingLevels, 2>& simulated) const {
    std::array<GrazingLevels, 2> excess_db;
    for (const std::size_t side : {0u, 1u})
      for (std::size_t i = 0; i < grazing_cells; ++i)
        excess_db[side][i] = model_.levels_db[side][i] - simulated[side][i];
    return mean_of_sides(excess_db);
  }
  void note_sediments(const std::vector<NearSediment>& sediments, bool beam_is_stated) {
    std::string why = "too few angles to tell";
    if (sediments.size() >= 3) {
      why = fmt::format(
          "nearest in level over angle, {:.1f} dB off; then {}, {:.1f} dB, and {}, "
          "{:.1f} dB",
          sediments[0].rms_db, sediments[1].name, sediments[1].rms_db, sediments[2].name,
          sediments[2].rms_db);
      if (!beam_is_stated)
        why += "; unsure, because the beam is not stated";
      else if (const std::size_t alike = as_near_as_the_first(sediments); alike > 1)
        why += fmt::format("; the first {} cannot be distinguished", alike);
    }
    model_.evidence["material.bed.like"] = {Confidence::fitted, why};
  }
  /// The gain of `law` at the range of a cell, in dB.
  double law_db(const RangeLaw& law, std::size_t cell) const {
    return law.gain_db(mean_of(model_.path.altitude_m) / std::sin(grazing_cell_rad(cell)),
                       model_.absorption_db_per_m);
  }
  /// How many dB port is louder than starboard, compared with a simulation whose sides are equal. 0
  /// if the line has one side.
  double port_over_starboard_db(const Figures& simulated) const {
    std::vector<double> off;
    for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i)
      if (const double one = model_.levels_db[0][i] - simulated.levels[0][i] -
                             model_.levels_db[1][i] + simulated.levels[1][i];
          std::isfinite(one))
        off.push_back(one);
    return median(std::move(off));
  }
  /// Chooses the gain over range if the altitude does not show it. Of the usual gains it takes the
  /// one with which a sediment, under the stated beam, comes nearest to the level over the angle.
  /// Returns the new gain minus the old gain, by cell.
  GrazingLevels choose_range_law(const GrazingLevels& excess_db) {
    constexpr std::array<double, 3> usual{30.0, 20.0, 40.0};
    const RangeLaw before = model_.range_law;
    GrazingLevels chosen_db{};
    double min_db = std::numeric_limits<double>::infinity();
    for (const double spreading : usual) {
      GrazingLevels more_db, left_db;
      for (std::size_t i = 0; i < grazing_cells; ++i) {
        more_db[i] = law_db({spreading, before.absorption, {}}, i) - law_db(before, i);
        left_db[i] = excess_db[i] - more_db[i];
      }
      const std::vector<NearSediment> nearest = nearest_sediments(model_, left_db, true);
      if (nearest.empty() || !(nearest.front().rms_db < min_db)) continue;
      min_db = nearest.front().rms_db;
      chosen_db = more_db;
      model_.range_law.spreading = spreading;
      model_.range_law.from = {Confidence::fitted,
                               "best of 20, 30 and 40 dB per decade, by the fit of a sediment to "
                               "the level over the angle"};
    }
    return chosen_db;
  }

  /// Completes the pattern for both sides, and shifts it so that its largest level is 0 dB; the
  /// shift goes into the gain.
  void complete_pattern() {
    if (!model_.port) model_.vertical_db[0] = model_.vertical_db[1];
    if (!model_.starboard) model_.vertical_db[1] = model_.vertical_db[0];
    double loudest = -1e9;
    for (const std::vector<double>& side : model_.vertical_db)
      loudest = std::max(loudest, std::ranges::max(side));
    constexpr double lowest_db = -80.0;
    for (std::vector<double>& side : model_.vertical_db)
      for (double& level : side) level = std::max(level - loudest, lowest_db);
    model_.gain_db = *model_.gain_db + loudest;
  }

  void correct_levels(const Figures& simulated) {
    constexpr double most_db = 10.0, share = 0.9;  // per round; of the difference
    std::vector<double> offsets;
    for (const std::size_t side : {0u, 1u}) {
      std::vector<double> off;
      for (std::size_t i = 0; i < grazing_cells; ++i)
        off.push_back(
            std::clamp(real_.levels[side][i] - simulated.levels[side][i], -most_db, most_db));
      for (std::size_t i = first_sediment_cell; i < end_sediment_cell; ++i)
        if (std::isfinite(off[i])) offsets.push_back(off[i]);
      if (!model_.has_pattern()) continue;
      fill(off);
      for (std::size_t i = 0; i < grazing_cells; ++i) {
        const std::size_t before = i == 0 ? i : i - 1, next = std::min(i + 1, grazing_cells - 1);
        model_.vertical_db[side][i] +=
            share * (0.25 * off[before] + 0.5 * off[i] + 0.25 * off[next]);
      }
    }
    if (model_.has_pattern())
      complete_pattern();
    else if (model_.recorder.ping_mean == 0.0)
      model_.gain_db = *model_.gain_db + mean_of(offsets);
    model_.evidence["sonar.sidescan.gain_db"] = {Confidence::fitted, "level of the bed"};
  }

  /// Corrects what is left in the level over range, after the level over the angle was fitted.
  void correct_range_law(const Figures& simulated) {
    // At a constant altitude, the level over range shows no more than the level over the angle.
    if (model_.range_law.from.how == Confidence::assumed || std::isnan(model_.range_slope_db))
      return;
    std::vector<LevelAtRange> off;
    for (const auto& [percent, level_db] : real_.level_over_range)
      if (const double off_db = level_db - simulated.level_over_range.at(percent);
          percent >= 20 && std::isfinite(off_db)) {
        const int tenth = percent / 10;
        off.push_back({0, std::log10(model_.range_m * (0.1 * tenth + 0.05)), off_db});
      }
    constexpr std::size_t fewest = 5;
    if (off.size() < fewest) return;
    constexpr double share_of_slope = 0.7;  // of the correction that the slope suggests
    const double before = model_.range_law.spreading;
    model_.range_law.from =
        spreading.set(before + spreading.step(share_of_slope * shared_slope({off}, 0, 0).value()),
                      model_.range_law.spreading);
    // The gain at half the range stays the same.
    model_.gain_db =
        *model_.gain_db - (model_.range_law.spreading - before) * std::log10(0.5 * model_.range_m);
  }

  void correct_floor(const Figures& simulated) {
    const double has = real_["column_over_bed"], now = simulated["column_over_bed"];
    // In one of the two lines, the noise may be below the digitiser's first step.
    constexpr double into_samples_db = 3.0, out_of_samples_db = -10.0;
    const double off = has > 0.0 && now > 0.0
                           ? real_["column_over_bed_db"] - simulated["column_over_bed_db"]
                       : has > 0.0 ? into_samples_db
                       : now > 0.0 ? out_of_samples_db
                                   : 0.0;
    if (!std::isfinite(has + now + off)) return;
    double& noise_db = model_.output_noise_db;
    Evidence fitted = output_noise.set(noise_db + output_noise.step(off), noise_db);
    if (has > 0.0) model_.evidence[output_noise.key] = std::move(fitted);
  }

  /// Relief correlates samples at some distance; texture below the sonar's cell does not.
  void correct_relief(const Figures& simulated) {
    double off = 0.0;
    for (const char* name : {"range_correlation_2", "range_correlation_4"})
      off += 0.5 * (real_[name] - simulated[name]);
    if (!std::isfinite(off)) return;
    constexpr double alike = 0.02, factor_per_correlation = 4.0;
    if (std::abs(off) < alike) return;
    double& height_m = model_.height_at_1m_m;
    model_.evidence[relief.key] =
        relief.set(height_m * relief.step(1.0 + factor_per_correlation * off), height_m);
  }

  /// Contrast at low grazing angles beyond that of a bed without texture is attributed to texture.
  /// The contrast shows the shape of the texture's patches: the variance that they add is
  /// proportional to 1 / shape (scatter::GroundTexture). The kurtosis shows the share of single
  /// bright points, and depends far more on it than on the shape. The kurtosis hardly depends on
  /// the number of points per area, so this number stays that of the sediment. Points stay bright
  /// from ping to ping. If the bright samples of the recording do not stay bright as long,
  /// something else makes the kurtosis; more points would only draw lines along the track.
  void correct_texture(const Figures& simulated) {
    // If the range ends at a steeper angle, the first band has no samples.
    const auto known = std::ranges::find_if(low_bands, [&](const char* band) {
      return std::isfinite(real_[contrast_at(band)] + simulated[contrast_at(band)]);
    });
    if (known == low_bands.end()) return;
    const double has = real_[contrast_at(*known)], now = simulated[contrast_at(*known)];
    std::vector<double> peaks;  // recording over simulation, as logarithms
    for (const char* band : low_bands) {
      // The kurtosis plus one is nearly proportional to the share.
      const auto raised = [&](const Figures& of) {
        return std::max(of[fmt::format("kurtosis_at_{}_deg", band)] + 1.0, 0.1);
      };
      if (const double more = std::log(raised(real_) / raised(simulated)); std::isfinite(more))
        peaks.push_back(more);
    }
    const double peaked = std::exp(mean_of(peaks));
    const bool first = model_.texture_shape == 0.0;
    if (first) even_contrast_ = now;
    const double even = even_contrast_ * even_contrast_;
    constexpr double noticed = 0.05, noticed_peaks = 1.25, least = 0.01;
    const auto excess = [&](double contrast) {
      return std::max(contrast * contrast - even, least * even);
    };
    if (first) {
      if (excess(has) < noticed * even && peaked < noticed_peaks) return;
      constexpr double first_shape = 0.5, first_share = 0.3;
      model_.texture_shape = first_shape;
      model_.glint_share = first_share;
      return;
    }
    const double uneven = excess(has) / excess(now);
    constexpr double alike = 5.0;
    double &shape = model_.texture_shape, &share = model_.glint_share;
    model_.evidence[texture_shape.key] =
        texture_shape.set(shape / texture_shape.step(uneven), shape);
    // If the patches hardly differ, the points also make the contrast.
    const double change = shape < alike ? peaked : std::sqrt(peaked * uneven);
    constexpr double as_lasting = 0.1;
    const bool too_lasting = simulated.lasting_peaks > real_.lasting_peaks + as_lasting;
    glint_share.set(share * glint_share.step(too_lasting ? 0.0 : change), share);
    Evidence of_share = within_limits({Confidence::fitted, glint_share.statistic}, share, 0.0,
                                      glint_share.most);  // the smallest share is none
    if (too_lasting && peaked > 1.0) {
      of_share.at_limit = true;
      of_share.why +=
          "; more points would last longer from ping to ping than its bright samples do";
    }
    model_.evidence[glint_share.key] = std::move(of_share);
  }

  /// Chooses the pulse by the correlations of samples, if the file does not state it. The window of
  /// a sweep is always found this way, since no file states it.
  void begin_pulse() {
    const double over_one = real_["range_correlation_1"], over_two = real_["range_correlation_2"];
    if (!std::isfinite(over_one + over_two)) return;
    if (stated(bandwidth_key)) {
      if (model_.pulse.kind != PulseKind::lfm) return;
      model_.pulse.window = likely_window(model_.pulse.bandwidth_hz / one_sample_hz(), over_one);
      model_.evidence["sonar.sidescan.window"] = {Confidence::fitted, "correlation over 1 sample"};
      return;
    }
    model_.pulse = likely_pulse(over_one, over_two);
    model_.pulse.bandwidth_hz =
        std::clamp(time_times_bandwidth(model_.pulse, over_one) * one_sample_hz(),
                   min_bandwidth_hz(), max_bandwidth_hz());
    for (const char* key : {"sonar.sidescan.pulse", "sonar.sidescan.window"})
      model_.evidence[key] = {Confidence::fitted, "correlation over 1 and 2 samples"};
  }

  void correct_bandwidth(const Figures& simulated) {
    if (stated(bandwidth_key)) return;
    const double has = real_["range_correlation_1"], now = simulated["range_correlation_1"];
    if (!std::isfinite(has) || !std::isfinite(now)) return;
    const auto apart = [&](double correlation) {
      return time_times_bandwidth(model_.pulse, std::clamp(correlation, 0.0, 0.9));
    };
    const FittedKey bandwidth{bandwidth_key,
                              "correlation of neighbouring samples",
                              min_bandwidth_hz(),
                              max_bandwidth_hz(),
                              0.6,
                              1.6};
    double& bandwidth_hz = model_.pulse.bandwidth_hz;
    model_.evidence[bandwidth.key] =
        bandwidth.set(bandwidth_hz * bandwidth.step(apart(has) / apart(now)), bandwidth_hz);
  }

  /// Fits the array's length to the correlation of pings. In the near field, or if something else
  /// correlates the pings, the correlation does not depend on the length; then the length is not
  /// changed. Nor is it changed if pings are more than half the length apart, or if rows are beams.
  void correct_array(const Figures& simulated) {
    if (stated(array_length.key) || !array_shows_) return;
    const double has = real_["track_correlation_1"], now = simulated["track_correlation_1"];
    if (!(has > array_correlation(0.5)) || !std::isfinite(now)) return;
    const double length_m = model_.array_length_m;
    if (tried_length_m_ > 0.0) {
      const double by_law =
          array_correlation(distance_over_length(tried_correlation_) * tried_length_m_ / length_m) -
          tried_correlation_;
      constexpr double noticed = 0.01, min_response = 0.25;
      if (std::abs(by_law) > noticed && (now - tried_correlation_) / by_law < min_response) {
        array_shows_ = false;
        set_array(tried_length_m_);
        return;
      }
    }
    tried_length_m_ = length_m;
    tried_correlation_ = now;
    const double factor = distance_over_length(now) / distance_over_length(has);
    double corrected_m = length_m;
    model_.evidence[array_length.key] =
        array_length.set(length_m * array_length.step(factor), corrected_m);
    set_array(corrected_m);
  }
  /// The gain compensates for the smaller area in the beam of a longer array.
  void set_array(double length_m) {
    if (model_.gain_db)
      model_.gain_db = *model_.gain_db + scatter::to_db(length_m / model_.array_length_m);
    model_.array_length_m = length_m;
  }

  double one_sample_hz() const { return 0.5 * model_.sound_speed_mps / model_.bin_m(); }
  double max_bandwidth_hz() const { return std::min(one_sample_hz(), 0.5 * model_.frequency_hz); }
  double min_bandwidth_hz() const {
    return std::min(min_bandwidth * one_sample_hz(), max_bandwidth_hz());
  }

  bool stated(const std::string& key) const { return model_.how(key) == Confidence::stated; }

  LineModel& model_;
  Figures real_;
  double even_contrast_ = 0.0;  ///< contrast of the last simulation without texture
  bool array_shows_;            ///< whether the correlation of pings shows the length
  /// The length that was tried before the model's, and the correlation that it gave; 0: none.
  double tried_length_m_ = 0.0, tried_correlation_ = 0.0;
};

}  // namespace

std::vector<NearSediment> fit_line(LineModel& model, const LineWithBed& line, int threads,
                                   bool beam_is_stated, const AfterPings& after_pings) {
  Fit fit(model, line);
  std::vector<NearSediment> sediments;
  constexpr std::size_t rounds = 10, plain_rounds = 3, rounds_of_altitude = 2;
  for (std::size_t round = 0; round < rounds; ++round) {
    LineModel tried = model;
    if (round < plain_rounds) {
      tried.recorder.ping_mean = 0.0;  // so that levels are relative to the gain
      tried.tones.steps.clear();  // they are relative to levels of more pings than are simulated
    }
    SimulatedLine made = simulated_line(tried, threads, [&](std::size_t done, std::size_t of) {
      after_pings(round * of + done, rounds * of);
    });
    const LineWithBed ours(std::move(made.line));
    if (round < plain_rounds - 1)
      fit.correct_geometry(ours, made.gain_db);
    else if (round == plain_rounds - 1)
      sediments = fit.begin(ours, made.gain_db, beam_is_stated);
    else
      fit.correct(ours);
    const std::size_t with_beam = beam_is_stated ? 0 : plain_rounds;
    if (round >= with_beam && round < with_beam + rounds_of_altitude && !model.recorder.even_ranges)
      fit.correct_altitude(ours);
  }
  return sediments;
}

}  // namespace ensonify::engine
