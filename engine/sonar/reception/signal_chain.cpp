#include <ensonify/engine/sonar/reception/signal_chain.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/reception/signal_kernel.h>
#include <ensonify/engine/sonar/reception/transmit_leakage.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr float loudest = 1e33f;   // uPa^2, louder than any sound in water; its squares are finite
constexpr int behind_gain = 1000;  // look number of the first noise after the gain
// Interpolation steps per range, of a beam's share beyond the range.
constexpr std::size_t farther_steps = 8;
constexpr int looks_of_beam = 2000;    // look numbers of a beam's noise
constexpr int wave_oscillator = 100;   // `number` of the waves' Oscillator; Motion uses 0 to 6
constexpr int noise_oscillator = 200;  // and of the first sonar's noise
constexpr std::size_t gain_bins = 8;   // bins that have one value of the automatic gain

/// By range: what a beam that lies ahead_m ahead of the array's middle receives at the nominal
/// speed, divided by the two-way beam of the middle at rest.
std::function<double(double range_m)> beam_share(const Sonar& sonar, const ChainOptions& options,
                                                 const SonarEquation& law, double ahead_m = 0.0) {
  // A vehicle that goes ahead moves along a sidescan's array, but across an imaging sonar's.
  const double along_mps = sonar.steers() ? 0.0 : options.nominal_speed_mps;
  const double drift_along = 2.0 / options.sound_speed_mps * along_mps;
  if (drift_along == 0.0 && ahead_m == 0.0) return [](double) { return 1.0; };
  const MovedBeam& moved = law.moved_beam();
  return [&moved, drift_along, ahead_m, beam = moved.beam(ahead_m)](double range_m) {
    return std::max(moved.summed_share(range_m, drift_along, beam, ahead_m), least_beam_share);
  };
}

std::vector<double> by_bin(const SonarEquation& law,
                           const std::function<double(double range_m)>& share) {
  std::vector<double> shares;
  for (std::size_t bin = 0; bin < law.bins(); ++bin) shares.push_back(share(law.range_m(bin)));
  return shares;
}

/// The range that sound covers both ways between two pings.
double ping_m(const Sonar& sonar, const ChainOptions& options) {
  return options.ping_interval_s > 0.0 ? 0.5 * options.sound_speed_mps * options.ping_interval_s
                                       : sonar.range_m;
}

/// Waves of a fully developed sea (Pierson and Moskowitz, J. Geophys. Res. 69, 5181, 1964):
/// significant height 0.21 U^2 / g, peak at 0.877 g / U.
Oscillation waves_under(double wind_mps) {
  constexpr double g = 9.81;
  if (!(wind_mps > 0.0)) return {};
  return {.rms = 0.25 * 0.21 * wind_mps * wind_mps / g,
          .period_s = 2.0 * std::numbers::pi * wind_mps / (0.877 * g)};
}

bool meets_sea_surface(const ChainOptions& options) {
  return options.arrivals.surface || options.arrivals.volume || options.arrivals.multiples ||
         options.artefacts.wake_db;
}

/// The mean of the largest of n amplitudes whose intensities are exponential with mean 1: the
/// integral of 1 - (1 - exp(-a^2))^n over a.
double mean_of_peak(int n) {
  constexpr double step = 1.0 / 128.0;
  double sum = 0.0;
  for (double a = 0.5 * step; a < 8.0; a += step)
    sum += step * (1.0 - std::pow(1.0 - std::exp(-a * a), n));
  return sum;
}

/// The median of the largest of n such amplitudes.
double median_of_peak(int n) { return std::sqrt(-std::log(1.0 - std::exp2(-1.0 / n))); }

constexpr double mean_amplitude = 0.5 / std::numbers::inv_sqrtpi;  // of one such amplitude

/// The median of the mean of n such amplitudes: the mean, minus a sixth of the third central moment
/// divided by the variance (Cornish and Fisher, Rev. Inst. Int. Stat. 5, 307, 1938). Within 0.02 dB
/// for n >= 2.
double median_of_mean(int n) {
  using std::numbers::pi;
  return mean_amplitude * (1.0 - (pi - 3.0) / (3.0 * (4.0 - pi) * n));
}

/// The random stream of the noise in a look of a line: the only place that defines its key. The
/// first two sectors have the two numbers of their sonar; further sectors have numbers beyond the
/// numbers of all sonars.
RandomStream noise_stream(const ChainOptions& options, const LineContext& context, int look) {
  const std::size_t sector = context.facing.number;
  const std::uint64_t receiver =
      options.sonar_number * 2 + sector % 2 + (std::uint64_t{sector / 2} << 32);
  return {
      options.seed,
      Purpose::noise,
      {receiver, context.ping, static_cast<std::uint64_t>(looks_of_beam * context.beam + look)}};
}

/// Whether two sectors receive each other's cross-talk.
bool are_pair(const Sector& one, const Sector& other) {
  return one.number != other.number && one.number / 2 == other.number / 2;
}

FilterTaps taps_of(const SpeckleFilter& filter) {
  return {.taps = filter.taps.data(), .reach = filter.taps.size() - 1, .even = filter.even};
}

}  // namespace

/// The echo of the level bed of unit strength at the nominal altitude and speed, uPa^2.
double SignalChain::unit_bed(std::size_t sector, std::size_t bin) const {
  const double range_m = law_.cell_middle_m(bin);
  BeamPlane plane(sector);
  if (sonar_.steers()) {  // the array's pitch turns the pattern in the planes in which it looks
    plane.cos_roll_tilt = std::cos(sonar_.mounting.pitch_rad);
    plane.sin_roll_tilt = -std::sin(sonar_.mounting.pitch_rad);
  }
  return moved_shares_[bin] * law_.level_bed(plane, range_m, options_.nominal_altitude_m / range_m);
}

/// The gain at 1 m that records a level bed at the receiver's bed_level_db: the bed at half the
/// range, or for an imaging sonar, whose vertical beam is narrow, the bed where it is loudest.
double SignalChain::automatic_gain_db() const {
  const ReceiverOptions& receiver = sonar_.receiver;
  const auto gain_db = [&](std::size_t bin, double strength) {
    const double r = law_.range_m(bin);
    const double level_db = scatter::to_db(unit_bed(0, bin)) + scatter::to_db(strength);
    return receiver.bed_level_db - level_db - receiver.spreading * std::log10(r) -
           (receiver.absorption ? 2.0 * options_.absorption_db_per_m * r : 0.0);
  };
  const double altitude_m = options_.nominal_altitude_m;
  if (!sonar_.steers())
    return gain_db(static_cast<std::size_t>(sonar_.bins / 2),
                   options_.nominal_strength(altitude_m / (0.5 * sonar_.range_m)));
  double least_db = std::numeric_limits<double>::infinity();
  for (std::size_t bin = 0; bin < law_.bins(); ++bin)
    if (altitude_m < law_.range_m(bin))
      least_db = std::min(least_db,
                          gain_db(bin, options_.nominal_strength(altitude_m / law_.range_m(bin))));
  return least_db;
}

SignalChain::SignalChain(const Sonar& sonar, const ChainOptions& options)
    : sonar_(sonar),
      options_(options),
      scatterers_(
          sonar, options.sound_speed_mps, options.seed, options.heading_rad, options.textures,
          options.arrivals.second_time_around ? farthest_earlier_m(sonar, ping_m(sonar, options))
                                              : 0.0,
          options.stop_check),
      steered_(sonar.steers() ? std::optional<SteeredSpeckle>(
                                    std::in_place, sonar, options.sound_speed_mps, options.seed,
                                    options.heading_rad, options.textures, options.stop_check)
                              : std::nullopt),
      law_(sonar, options.sound_speed_mps, options.absorption_db_per_m, scatterers_),
      moved_shares_(by_bin(law_, beam_share(sonar, options, law_))),
      sea_noise_(sea_noise_powers(sonar, law_, options.sea)),
      waves_(meets_sea_surface(options) ? waves_under(options.sea.wind_mps) : Oscillation{},
             options.seed, wave_oscillator),
      output_noise_wander_({.wander_rms = sonar.receiver.output_noise_wander_db,
                            .wander_s = sonar.receiver.output_noise_wander_s},
                           options.seed, noise_oscillator + options.sonar_number),
      other_paths_(options.arrivals, sonar, options.sea, law_,
                   {options.nominal_strength, options.bed}, ping_m(sonar, options),
                   options.speckle ? std::optional(options.seed) : std::nullopt),
      disturbances_(
          options.artefacts, law_,
          [this](double speed_mps) { return sea_noise_[0] + self_noise(speed_mps); }, options.seed),
      recorder_(sonar.receiver, sonar.bin_m(), sonar.bins, options.absorption_db_per_m,
                automatic_gain_db(), loudest_noise()),
      filter_(speckle_filter(sonar.pulse, options.sound_speed_mps, sonar.bin_m())),
      leak_(options.arrivals.crosstalk_db
                ? static_cast<float>(std::sqrt(scatter::from_db(*options.arrivals.crosstalk_db)))
                : 0.0f) {
  for (const float tap : filter_.taps) energy_taps_.push_back(tap * tap);
  for (int beam = 0; beam < sonar.beams; ++beam) {
    shares_.push_back(shares_of_beam(beam));
    gains_.push_back(gains_of_beam(beam));
  }
}

/// By bin: what a beam receives at the nominal speed, divided by what a beam from the array's
/// middle receives. Beyond the range, from where only earlier pings echo, it is interpolated.
std::vector<double> SignalChain::shares_of_beam(int beam) const {
  if (sonar_.steers()) {
    // The beam is weaker by the transmitter's pattern, and wider by the cosine, on which it
    // projects the array. Its energy is the integral over the bed, whatever its length.
    const double sine = std::sin(sonar_.bearing_rad(beam));
    const LineArray sent = sonar_.transmit_array(options_.sound_speed_mps / sonar_.frequency_hz);
    const double share = sent.power(sine) / std::sqrt(1.0 - sine * sine);
    return std::vector<double>(law_.bins(), std::max(share, least_beam_share));
  }
  const double offset_m = sonar_.beam_offset_m(beam);
  if (offset_m == 0.0) return {};
  const auto its = beam_share(sonar_, options_, law_, offset_m),
             middle = beam_share(sonar_, options_, law_);
  std::vector<double> shares = by_bin(law_, its);
  for (std::size_t bin = 0; bin < shares.size(); ++bin) shares[bin] /= moved_shares_[bin];
  if (!options_.arrivals.second_time_around) return shares;
  const double farthest_m = farthest_earlier_m(sonar_, ping_m(sonar_, options_));
  const std::size_t step = std::max<std::size_t>(law_.bins() / farther_steps, 1);
  while (law_.range_m(shares.size() - 1) < farthest_m) {
    const double from = shares.back(), range_m = law_.range_m(shares.size() - 1 + step);
    const double to = its(range_m) / middle(range_m);
    for (std::size_t i = 1; i <= step; ++i)
      shares.push_back(std::lerp(from, to, static_cast<double>(i) / static_cast<double>(step)));
  }
  return shares;
}

/// The recorder's gain of a beam, in whole groups: the gain of the array's middle, times a factor
/// that compensates the weaker echo of the level bed. Before the first echo, the factor of the
/// first echo holds.
std::vector<float> SignalChain::gains_of_beam(int beam) const {
  std::vector<float> gains(recorder_.gains().begin(), recorder_.gains().end());
  if (const auto& shares = shares_[static_cast<std::size_t>(beam)]; !shares.empty()) {
    const auto first = std::min(
        static_cast<std::size_t>(options_.nominal_altitude_m / law_.bin_m()), gains.size() - 1);
    for (std::size_t bin = 0; bin < gains.size(); ++bin)
      gains[bin] *= static_cast<float>(std::sqrt(1.0 / shares[std::max(bin, first)]));
  }
  gains.resize(whole_groups(gains.size()), 0.0f);
  return gains;
}

double SignalChain::self_noise(double speed_mps) const {
  return sonar_.pulse.noise_bandwidth_hz() * sonar_.receiver.self_noise_density(speed_mps);
}

double SignalChain::loudest_noise() const {
  if (!sonar_.receiver.noise) return 0.0;
  return std::ranges::max(sea_noise_) + self_noise(options_.nominal_speed_mps);
}

double SignalChain::noise(std::size_t sector, double speed_mps) const {
  if (!sonar_.receiver.noise) return 0.0;
  return sea_noise_[sector] + self_noise(speed_mps);
}

std::vector<double> SignalChain::level_bed(std::size_t sector) const {
  std::vector<double> bed(law_.bins());
  for (std::size_t bin = 0; bin < bed.size(); ++bin)
    if (options_.nominal_altitude_m < law_.range_m(bin)) {
      const double sine = std::min(options_.nominal_altitude_m / law_.cell_middle_m(bin), 1.0);
      bed[bin] = unit_bed(sector, bin) * options_.nominal_strength(sine) + noise(sector);
    }
  return bed;
}

double SignalChain::noise_exceeds_bed_m() const {
  const auto stronger = [&](std::size_t bin) {
    const double range_m = law_.range_m(bin);
    const double sine = std::min(options_.nominal_altitude_m / range_m, 1.0);
    for (std::size_t sector = 0; sector < sonar_.sectors().size(); ++sector)
      if (unit_bed(sector, bin) * options_.nominal_strength(sine) >= noise(sector)) return true;
    return false;
  };
  std::size_t end = law_.bins();
  while (end > 0 && !stronger(end - 1)) --end;
  return end < law_.bins() ? law_.range_m(end) : 0.0;
}

// The median of a sum of exponential intensities, one per look, divided by its mean (Wilson and
// Hilferty, PNAS 17, 684, 1931).
double SignalChain::median_share() const {
  return options_.speckle ? std::pow(1.0 - 1.0 / (9.0 * sonar_.receiver.looks), 3.0) : 1.0;
}

std::vector<double> SignalChain::automatic_gain(std::size_t sector) const {
  const std::vector<double> bed = level_bed(sector);
  const ReceiverOptions& receiver = sonar_.receiver;
  const double behind =
      receiver.output_noise_db ? scatter::from_db(*receiver.output_noise_db) : 0.0;
  const int looks = receiver.looks;
  const bool peak = receiver.detector == Detector::peak;
  // The mean of the detector's result for all looks, divided by the root of their mean intensity.
  double speckle = 1.0;
  double median_gain = 1.0;
  if (options_.speckle) {
    speckle = peak ? mean_of_peak(looks) : mean_amplitude;
    if (looks > 1)
      median_gain =
          (peak ? median_of_peak(looks) : median_of_mean(looks)) / std::sqrt(median_share());
  }
  Channel channel;
  channel.detected.assign(gains_[0].size(), 0.0f);
  for (std::size_t n = 0; n < bed.size(); ++n) {
    const double gain = recorder_.gain(n);
    channel.detected[n] = static_cast<float>(
        speckle * std::sqrt(std::max(bed[n], noise(sector)) * gain * gain + behind));
  }
  const std::vector<float> before = channel.detected;
  if (options_.artefacts.automatic_gain > 0.0) follow_level(channel);
  const double scale = ping_scale(channel, bed.size());
  std::vector<double> gain(bed.size(), median_gain * scale);
  for (std::size_t n = 0; n < bed.size(); ++n)
    if (before[n] > 0.0f) gain[n] *= channel.detected[n] / before[n];
  return gain;
}

void SignalChain::sum_planes(const FanPlanes& planes, Scratch& scratch) const {
  if (steered_ && options_.speckle)
    steered_->sum(planes, sonar_.receiver.looks, taps_of(filter_).reach, scratch.steered);
}

void SignalChain::receive(std::span<const LineContext> contexts, std::span<EchoLine> lines,
                          Scratch& scratch) const {
  if (scratch.channels.size() < lines.size())
    scratch.channels.resize(lines.size());  // kept for fewer lines
  const std::span channels = std::span(scratch.channels).first(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    channels[i].context = context_of(lines[i], contexts[i]);
    compute_expected(lines[i], channels[i]);
    if (options_.speckle && !steered_)
      scatterers_.place(contexts[i].array, lines[i].bins, channels[i].cells);
  }
  const auto partner = [&](std::size_t line) -> Channel* {
    for (Channel& other : channels)
      if (leak_ > 0.0f && are_pair(other.context.facing, channels[line].context.facing))
        return &other;
    return nullptr;
  };
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (Channel* const other = partner(i); other > &channels[i]) leak_power(channels[i], *other);
  const float step = gain_step(contexts[0]), gain = step * ping_gain(contexts[0]),
              behind_rms = output_noise_rms(contexts[0].t_s);
  for (int look = 0; look < sonar_.receiver.looks; ++look) {
    for (Channel& channel : channels) {
      sum_scatterers(look, scratch.steered, channel);
      if (options_.speckle) draw_noise(look, channel);
    }
    for (std::size_t i = 0; i < lines.size(); ++i)
      detect_look(partner(i), look, gain, behind_rms, channels[i]);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EchoLine& line = lines[i];
    Channel& received = channels[i];
    std::copy_n(received.energy.begin(), line.bins.intensity.size(), line.bins.intensity.begin());
    line.gain = gain;
    if (step != 1.0f) line.artefacts.add(Artefact::gain_step);
    if (options_.artefacts.automatic_gain > 0.0) follow_level(received);
    if (options_.artefacts.automatic_gain > 0.0 || sonar_.receiver.ping_mean > 0.0)
      line.artefacts.add(Artefact::automatic_gain);
    const std::size_t bins = line.bins.sample.size();
    const float scale = ping_scale(received, bins);
    line.gain *= scale;
    recorder_.samples(std::span(received.detected).first(bins), scale, line.bins.sample);
  }
}

/// The context of a line with its beam and sector, the waves, and the travel times up and down.
LineContext SignalChain::context_of(const EchoLine& line, LineContext context) const {
  context.beam = line.beam;
  context.sector = line.sector;
  context.facing = sonar_.sectors()[line.sector];
  context.sea_height_m = waves_.at(context.t_s);
  context.beam_shares = shares_[static_cast<std::size_t>(line.beam)];
  if (options_.profile) {
    const double from_m = std::max(-context.array.origin.z(), 0.0), c = options_.sound_speed_mps;
    context.range_per_m_up = c / options_.profile->mean_speed_mps(from_m, 0.0);
    context.range_per_m_down =
        c / options_.profile->mean_speed_mps(from_m, from_m + context.altitude_m);
  }
  return context;
}

/// The expected values of the direct echo and of everything that is received with it.
void SignalChain::compute_expected(EchoLine& line, Channel& channel) const {
  const LineContext& context = channel.context;
  const std::size_t bins = line.bins.intensity_mean.size();
  line.artefacts = {};
  const std::size_t room = whole_groups(bins), reach = taps_of(filter_).reach;
  channel.direct.assign(room + 2 * reach, 0.0f);
  const std::span<float> direct = std::span(channel.direct).subspan(reach, bins);
  std::ranges::copy(line.bins.intensity_mean, direct.begin());
  channel.power.assign(room, static_cast<float>(noise(line.sector, context.speed_mps)));
  const std::span<float> power = std::span(channel.power).first(bins);
  other_paths_.add(context, line, direct, power, channel.sums);
  if (!disturbances_.empty()) {
    channel.gain.assign(bins, 1.0f);
    disturbances_.apply(context, channel.gain, power, line.artefacts);
    for (std::size_t n = 0; n < bins; ++n) direct[n] *= channel.gain[n];
  }
  take_out_glints(line, direct, channel);
  if (options_.speckle) scatterers_.ground().vary(line.bins, direct);
  if (options_.arrivals.burst_m > 0.0) {
    const std::vector<float>& gain = gains_[static_cast<std::size_t>(context.beam)];
    for (std::size_t n = 0; n < bins; ++n) {
      const double lengths = law_.range_m(n) / options_.arrivals.burst_m;
      if (lengths > longest_leakage) break;
      const double full = gain[n];
      power[n] += static_cast<float>(scatter::from_db(leakage_level_db(lengths)) / (full * full));
    }
    line.artefacts.add(Artefact::transmit_leakage);
  }
  for (float& loud : power) loud = std::min(loud, loudest);
  if (leak_ > 0.0f && std::ranges::any_of(sonar_.sectors(), [&](const Sector& sector) {
        return are_pair(sector, context.facing);
      }))
    line.artefacts.add(Artefact::crosstalk);
}

/// Adds the cross-talk of what is received in addition to the direct echo: surface, fish, earlier
/// pings and so on. A receiver's noise does not leak into the other receiver.
void SignalChain::leak_power(Channel& one, Channel& other) const {
  const auto own_noise = [&](const Channel& of) {
    return static_cast<float>(noise(of.context.sector, of.context.speed_mps));
  };
  const float own_one = own_noise(one), own_other = own_noise(other);
  for (std::size_t n = 0; n < one.power.size(); ++n) {
    const float from_one = leak_ * leak_ * std::max(one.power[n] - own_one, 0.0f),
                from_other = leak_ * leak_ * std::max(other.power[n] - own_other, 0.0f);
    one.power[n] += from_other;
    other.power[n] += from_one;
  }
}

/// Glints do not fade: only the rest of the direct echo has speckle. (Without speckle, expected
/// values keep them.)
void SignalChain::take_out_glints(const EchoLine& line, std::span<float> direct,
                                  Channel& channel) const {
  channel.glint_re.clear();
  channel.glint_im.clear();
  if (line.glint_re.empty() || !options_.speckle) return;
  channel.glint_re = line.glint_re;
  channel.glint_im = line.glint_im;
  for (std::size_t n = 0; n < direct.size(); ++n) {
    float &re = channel.glint_re[n], &im = channel.glint_im[n];
    if (!disturbances_.empty()) {
      const float gain = std::sqrt(channel.gain[n]);
      re *= gain;
      im *= gain;
    }
    direct[n] = std::max(direct[n] - (re * re + im * im), 0.0f);
  }
}

void SignalChain::sum_scatterers(int look, const SteeredSpeckle::Scratch& fields,
                                 Channel& channel) const {
  const std::size_t room = gains_[0].size(), reach = taps_of(filter_).reach;
  const std::span<const float> direct = std::span(channel.direct).subspan(reach, room);
  channel.re.resize(room);
  channel.im.resize(room);
  if (!options_.speckle) {
    for (std::size_t n = 0; n < room; ++n) channel.re[n] = std::sqrt(direct[n]);
    std::ranges::fill(channel.im, 0.0f);
    return;
  }
  if (steered_)
    shape_steered(look, direct, fields, channel);
  else if (reach == 0)
    scatterers_.gather(channel.cells, look, direct, channel.re.data(), channel.im.data());
  else
    spread_scatterers(look, direct, channel);
  for (std::size_t n = 0; n < channel.glint_re.size(); ++n) {
    channel.re[n] += channel.glint_re[n];
    channel.im[n] += channel.glint_im[n];
  }
}

/// The scatterers of each bin, summed over the pulse.
void SignalChain::spread_scatterers(int look, std::span<const float> direct,
                                    Channel& channel) const {
  const std::size_t room = gains_[0].size(), reach = taps_of(filter_).reach;
  channel.spread_re.assign(room + 2 * reach, 0.0f);
  channel.spread_im.assign(room + 2 * reach, 0.0f);
  scatterers_.gather(channel.cells, look, direct, &channel.spread_re[reach],
                     &channel.spread_im[reach]);
  // Applies the pulse's filter, and scales the result to the expected mean, which contains the
  // pulse already.
  shape({.filter = taps_of(filter_),
         .energy_taps = energy_taps_.data(),
         .bins = room,
         .spread_re = channel.spread_re.data(),
         .spread_im = channel.spread_im.data(),
         .power = channel.direct.data(),
         .wanted = direct.data(),
         .re = channel.re.data(),
         .im = channel.im.data()});
}

/// The speckle of a steered beam, summed over the pulse and scaled to the expected mean.
void SignalChain::shape_steered(int look, std::span<const float> direct,
                                const SteeredSpeckle::Scratch& fields, Channel& channel) const {
  const std::size_t reach = taps_of(filter_).reach;
  const auto beam = static_cast<std::size_t>(channel.context.beam);
  const std::size_t begin = steered_->begin_of(beam, look, reach);
  shape({.filter = taps_of(filter_),
         .energy_taps = energy_taps_.data(),
         .bins = direct.size(),
         .spread_re = &fields.re[begin],
         .spread_im = &fields.im[begin],
         .power = &fields.variance[steered_->begin_of(beam, 0, reach)],
         .wanted = direct.data(),
         .re = channel.re.data(),
         .im = channel.im.data()});
}

void SignalChain::draw_white(const LineContext& context, int look, std::size_t count,
                             std::vector<float>& re, std::vector<float>& im) const {
  std::array<double, 1> random;
  noise_stream(options_, context, look).uniform(random);
  re.resize(whole_groups(count));
  im.resize(whole_groups(count));
  draw_complex_normal(static_cast<std::uint32_t>(random[0] * 0x1p32 - 1.0), count, re.data(),
                      im.data());
}

void SignalChain::draw_noise(int look, Channel& channel) const {
  const std::size_t room = gains_[0].size();
  draw_white(channel.context, look, room + 2 * taps_of(filter_).reach, channel.white_re,
             channel.white_im);
  if (sonar_.receiver.output_noise_db)
    draw_white(channel.context, behind_gain + look, room, channel.behind_re, channel.behind_im);
}

/// Adds all noise before and after the gain to the echo and detects it; `other` leaks into it
/// (null: no cross-talk).
void SignalChain::detect_look(const Channel* other, int look, float step, float behind_rms,
                              Channel& channel) const {
  const std::vector<float>& gain = gains_[static_cast<std::size_t>(channel.context.beam)];
  const ReceiverOptions& receiver = sonar_.receiver;
  channel.energy.resize(gain.size());
  channel.detected.resize(gain.size());
  detect({.bins = gain.size(),
          .re = channel.re.data(),
          .im = channel.im.data(),
          .other_re = other ? other->re.data() : nullptr,
          .other_im = other ? other->im.data() : nullptr,
          .leak = leak_,
          .white_re = options_.speckle ? channel.white_re.data() : nullptr,
          .white_im = options_.speckle ? channel.white_im.data() : nullptr,
          .filter = taps_of(filter_),
          .power = channel.power.data(),
          .gain = gain.data(),
          .step = step,
          .behind_re = options_.speckle && behind_rms > 0.0f ? channel.behind_re.data() : nullptr,
          .behind_im = options_.speckle && behind_rms > 0.0f ? channel.behind_im.data() : nullptr,
          .behind_rms = behind_rms,
          .first = look == 0,
          .peak = receiver.detector == Detector::peak,
          .share = 1.0f / static_cast<float>(receiver.looks),
          .energy = channel.energy.data(),
          .detected = channel.detected.data()});
}

/// Amplitude over full scale of the noise after the gain; 0 if there is none.
float SignalChain::output_noise_rms(double t_s) const {
  const std::optional<double>& level_db = sonar_.receiver.output_noise_db;
  if (!level_db) return 0.0f;
  return static_cast<float>(std::sqrt(scatter::from_db(*level_db + output_noise_wander_.at(t_s))));
}

/// The factor by which the operator's steps have changed the gain at the time of the ping.
float SignalChain::gain_step(const LineContext& context) const {
  const ArtefactOptions& artefacts = options_.artefacts;
  if (!(artefacts.gain_step_db > 0.0 && artefacts.gain_step_s > 0.0)) return 1.0f;
  const auto number = static_cast<std::int64_t>(std::floor(context.t_s / artefacts.gain_step_s));
  if (number == 0) return 1.0f;
  std::array<double, 1> random;
  artefact_stream(options_.seed, Artefact::gain_step, options_.sonar_number,
                  static_cast<std::uint64_t>(number))
      .normal(random);
  return static_cast<float>(scatter::amplitude_from_db(artefacts.gain_step_db * random[0]));
}

/// The factor of the gain that changes from ping to ping.
float SignalChain::ping_gain(const LineContext& context) const {
  const double rms_db = sonar_.receiver.ping_gain_db;
  if (!(rms_db > 0.0)) return 1.0f;
  std::array<double, 1> random;
  RandomStream(options_.seed, Purpose::ping_gain, {options_.sonar_number, context.ping})
      .normal(random);
  return static_cast<float>(scatter::amplitude_from_db(rms_db * random[0]));
}

/// Applies the automatic gain, which compares the level over the last metres with the level of the
/// nominal bed.
void SignalChain::follow_level(Channel& channel) const {
  const ArtefactOptions& artefacts = options_.artefacts;
  const auto forget =
      static_cast<float>(1.0 - std::exp(-law_.bin_m() / artefacts.automatic_gain_m));
  const auto nominal = static_cast<float>(scatter::from_db(sonar_.receiver.bed_level_db));
  const auto power = static_cast<float>(0.5 * artefacts.automatic_gain);
  float level = nominal, gain = 1.0f;
  for (std::size_t n = 0; n < channel.detected.size(); ++n) {
    float& amplitude = channel.detected[n];
    level += forget * (std::min(1.0f, amplitude * amplitude) - level);
    if (n % gain_bins == 0) gain = std::pow(nominal / level, power);
    amplitude *= gain;
  }
}

/// The factor that brings the mean amplitude of the ping, beyond the transmit leakage, to
/// ping_mean.
float SignalChain::ping_scale(const Channel& channel, std::size_t bins) const {
  if (!(sonar_.receiver.ping_mean > 0.0)) return 1.0f;
  const std::size_t first = std::min(
      static_cast<std::size_t>(longest_leakage * options_.arrivals.burst_m / law_.bin_m()), bins);
  double sum = 0.0;
  for (std::size_t n = first; n < bins; ++n) sum += channel.detected[n];
  return sum > 0.0 ? static_cast<float>(sonar_.receiver.ping_mean *
                                        static_cast<double>(bins - first) / sum)
                   : 1.0f;
}

}  // namespace ensonify::engine
