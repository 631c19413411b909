#include <ensonify/engine/sonar/signal_chain.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include <ensonify/engine/random.h>
#include <ensonify/engine/sonar/signal_kernel.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double automatic_level_db = -16.0;  // of the nominal bed, below full scale
constexpr double burst_over_full_scale_db = 30.0;
constexpr int output_noise_look = 1000;     // of no echo
constexpr std::size_t gain_bins = 8;        // for which an automatic gain is set
constexpr std::uint64_t of_gain_steps = 5;  // artefacts.cpp and disturbances.cpp have the others

/// The gain at 1 m that puts a level bed at half the range where a good operator would.
double automatic_gain_db(const Sonar& sonar, const ChainOptions& options, const EchoLaw& law) {
  const auto bin = static_cast<std::size_t>(sonar.bins / 2);
  const double r = law.range_m(bin);
  const double sine = std::min(options.nominal_altitude_m / r, 0.9);
  const double cosine = std::sqrt(1.0 - sine * sine);
  const double pattern = law.vertical(Side::starboard, cosine, sine);
  const double level_db = scatter::to_db(law.per_m2(bin) * law.width_m(bin) * law.cell_m() /
                                         cosine * pattern * pattern) +
                          options.nominal_strength_db;
  const ReceiverOptions& receiver = sonar.receiver;
  return automatic_level_db - level_db - receiver.spreading * std::log10(r) -
         (receiver.absorption ? 2.0 * options.absorption_db_per_m * r : 0.0);
}

}  // namespace

SignalChain::SignalChain(const Sonar& sonar, const ChainOptions& options)
    : sonar_(sonar),
      options_(options),
      scatterers_(sonar, options.sound_speed_mps, options.seed, options.heading_rad),
      law_(sonar, options.sound_speed_mps, options.absorption_db_per_m, scatterers_),
      noise_{noise_power(sonar, law_, options.sea, Side::port),
             noise_power(sonar, law_, options.sea, Side::starboard)},
      arrivals_(options.arrivals, options.sea, law_, options.bed, options.seed),
      disturbances_(options.artefacts, law_, noise_[0], options.seed),
      recorder_(sonar.receiver, sonar.bin_m(), sonar.bins, options.absorption_db_per_m,
                automatic_gain_db(sonar, options, law_)),
      taps_(speckle_taps(sonar.pulse, options.sound_speed_mps, sonar.bin_m())),
      leak_(options.arrivals.crosstalk_db
                ? static_cast<float>(std::sqrt(scatter::from_db(*options.arrivals.crosstalk_db)))
                : 0.0f) {
  if (!sonar.receiver.noise) noise_ = {};
  for (const float tap : taps_) energy_taps_.push_back(tap * tap);
}

void SignalChain::receive(const Hearing& hearing, std::span<EchoLine> lines, Memory& memory) const {
  const auto channel = [&](const EchoLine& line) -> Channel& {
    return memory.channels[static_cast<std::size_t>(line.side)];
  };
  for (EchoLine& line : lines) expect(hearing, line, channel(line));
  for (int look = 0; look < sonar_.receiver.looks; ++look) {
    for (const EchoLine& line : lines) {
      sum_scatterers(hearing, line, look, channel(line));
      draw_noise(hearing, line.side, look, channel(line));
    }
    for (const EchoLine& line : lines) {
      const Side opposite = line.side == Side::port ? Side::starboard : Side::port;
      const bool heard = leak_ > 0.0f && lines.size() == 2;
      detect(channel(line), heard ? &memory.channels[static_cast<std::size_t>(opposite)] : nullptr,
             look, channel(line));
    }
  }
  for (EchoLine& line : lines) {
    Channel& its = channel(line);
    std::copy(its.energy.begin(), its.energy.end(), line.bins.intensity.begin());
    amplify(hearing, line, its);
    record(its, line);
  }
}

/// What is expected of the direct echo, and of all else that comes with it.
void SignalChain::expect(const Hearing& hearing, EchoLine& line, Channel& channel) const {
  const std::size_t bins = line.bins.intensity_mean.size();
  line.artefacts = {};
  channel.direct.assign(line.bins.intensity_mean.begin(), line.bins.intensity_mean.end());
  channel.power.assign(bins, static_cast<float>(noise(line.side)));
  channel.gain.assign(bins, 1.0f);
  arrivals_.add(hearing, line, channel.direct, channel.power, channel.sums);
  disturbances_.apply(hearing, line.side, channel.gain, channel.power, line.artefacts);
  for (std::size_t n = 0; n < bins; ++n) channel.direct[n] *= channel.gain[n];
  if (options_.arrivals.burst_m > 0.0) {
    // The pulse itself, through the hull: beyond full scale, then dying away.
    for (std::size_t n = 0; n < bins; ++n) {
      const double over = law_.range_m(n) / options_.arrivals.burst_m - 1.0;
      if (over > 2.0) break;
      const double full = recorder_.gain(n);
      channel.power[n] += static_cast<float>(
          scatter::from_db(burst_over_full_scale_db - 60.0 * std::max(over, 0.0)) / (full * full));
    }
    line.artefacts.add(Artefact::transmit_burst);
  }
  if (leak_ > 0.0f) line.artefacts.add(Artefact::crosstalk);
}

void SignalChain::sum_scatterers(const Hearing& hearing, const EchoLine& line, int look,
                                 Channel& channel) const {
  const std::size_t bins = channel.direct.size(), reach = taps_.size() - 1;
  channel.re.resize(bins);
  channel.im.resize(bins);
  if (!options_.speckle) {
    for (std::size_t n = 0; n < bins; ++n) channel.re[n] = std::sqrt(channel.direct[n]);
    std::fill(channel.im.begin(), channel.im.end(), 0.0f);
    return;
  }
  channel.spread_re.assign(bins + 2 * reach, 0.0f);
  channel.spread_im.assign(bins + 2 * reach, 0.0f);
  scatterers_.gather(hearing.array, line.bins, look, channel.cells,
                     std::span(channel.spread_re).subspan(reach, bins),
                     std::span(channel.spread_im).subspan(reach, bins));
  for (std::size_t n = 0; n < bins; ++n) {
    const float amplitude = std::sqrt(channel.direct[n]);
    channel.spread_re[n + reach] *= amplitude;
    channel.spread_im[n + reach] *= amplitude;
  }
  if (reach == 0) {
    std::copy(channel.spread_re.begin(), channel.spread_re.end(), channel.re.begin());
    std::copy(channel.spread_im.begin(), channel.spread_im.end(), channel.im.begin());
    return;
  }
  convolve(taps_.data(), reach, channel.spread_re.data(), bins, channel.re.data());
  convolve(taps_.data(), reach, channel.spread_im.data(), bins, channel.im.data());
  // Back to the expected mean, which has gone through the pulse already.
  channel.weight.assign(bins + 2 * reach, 0.0f);
  std::copy(channel.direct.begin(), channel.direct.end(),
            channel.weight.begin() + static_cast<std::ptrdiff_t>(reach));
  std::vector<float>& spread = channel.spread_re;
  convolve(energy_taps_.data(), reach, channel.weight.data(), bins, spread.data());
  for (std::size_t n = 0; n < bins; ++n) {
    const float scale = spread[n] > 0.0f ? std::sqrt(channel.direct[n] / spread[n]) : 0.0f;
    channel.re[n] *= scale;
    channel.im[n] *= scale;
  }
}

/// White complex noise of a look, into spread_re and spread_im.
void SignalChain::draw_white(const Hearing& hearing, Side side, int look, std::size_t count,
                             Channel& channel) const {
  std::array<double, 1> random;
  Stream(options_.seed, Purpose::noise,
         {options_.sonar_number * 2 + static_cast<std::uint64_t>(side), hearing.ping,
          static_cast<std::uint64_t>(look)})
      .uniform(random);
  channel.spread_re.resize(count + signal_group);
  channel.spread_im.resize(count + signal_group);
  draw_complex_normal(static_cast<std::uint32_t>(random[0] * 0x1p32 - 1.0), count,
                      channel.spread_re.data(), channel.spread_im.data());
}

void SignalChain::draw_noise(const Hearing& hearing, Side side, int look, Channel& channel) const {
  const std::size_t bins = channel.power.size(), reach = taps_.size() - 1;
  channel.noise_re.assign(bins, 0.0f);
  channel.noise_im.assign(bins, 0.0f);
  if (!options_.speckle) return;
  draw_white(hearing, side, look, bins + 2 * reach, channel);
  convolve(taps_.data(), reach, channel.spread_re.data(), bins, channel.noise_re.data());
  convolve(taps_.data(), reach, channel.spread_im.data(), bins, channel.noise_im.data());
  for (std::size_t n = 0; n < bins; ++n) {
    const float amplitude = std::sqrt(channel.power[n]);
    channel.noise_re[n] *= amplitude;
    channel.noise_im[n] *= amplitude;
  }
}

void SignalChain::detect(const Channel& own, const Channel* other, int look, Channel& into) const {
  const std::size_t bins = own.re.size();
  into.energy.resize(bins);
  into.detected.resize(bins);
  const float share = 1.0f / static_cast<float>(sonar_.receiver.looks);
  const bool peak = sonar_.receiver.detector == Detector::peak;
  for (std::size_t n = 0; n < bins; ++n) {
    float re = own.re[n] + own.noise_re[n], im = own.im[n] + own.noise_im[n];
    if (other) {
      re += leak_ * other->re[n];
      im += leak_ * other->im[n];
    }
    float energy = re * re + im * im;
    if (!options_.speckle) energy += own.power[n];
    const float amplitude = std::sqrt(energy);
    const float detected = peak ? amplitude : share * amplitude;
    if (look == 0) {
      into.energy[n] = share * energy;
      into.detected[n] = detected;
    } else {
      into.energy[n] += share * energy;
      into.detected[n] = peak ? std::max(into.detected[n], detected) : into.detected[n] + detected;
    }
  }
}

/// The detected amplitudes behind the varied gain, over full scale, and what noise comes with it.
void SignalChain::amplify(const Hearing& hearing, EchoLine& line, Channel& channel) const {
  const std::size_t bins = channel.detected.size();
  const ArtefactOptions& artefacts = options_.artefacts;
  float step = 1.0f;
  if (artefacts.gain_step_db > 0.0 && artefacts.gain_step_s > 0.0) {
    const auto number = static_cast<std::int64_t>(std::floor(hearing.t_s / artefacts.gain_step_s));
    std::array<double, 1> random{};
    if (number != 0)
      Stream(options_.seed, Purpose::artefact,
             {of_gain_steps, options_.sonar_number, static_cast<std::uint64_t>(number)})
          .normal(random);
    step = static_cast<float>(std::pow(10.0, artefacts.gain_step_db * random[0] / 20.0));
    if (number != 0) line.artefacts.add(Artefact::gain_step);
  }
  for (std::size_t n = 0; n < bins; ++n) channel.detected[n] *= step * recorder_.gain(n);
  if (!sonar_.receiver.output_noise_db) return;
  const auto rms =
      static_cast<float>(std::sqrt(scatter::from_db(*sonar_.receiver.output_noise_db)));
  if (options_.speckle) {
    draw_white(hearing, line.side, output_noise_look, bins, channel);
    for (std::size_t n = 0; n < bins; ++n) {
      const float re = channel.detected[n] + rms * channel.spread_re[n],
                  im = rms * channel.spread_im[n];
      channel.detected[n] = std::sqrt(re * re + im * im);
    }
  } else {
    for (float& amplitude : channel.detected)
      amplitude = std::sqrt(amplitude * amplitude + rms * rms);
  }
}

void SignalChain::record(const Channel& channel, EchoLine& line) const {
  const std::size_t bins = channel.detected.size();
  const ArtefactOptions& artefacts = options_.artefacts;
  if (artefacts.automatic_gain > 0.0) {
    // The level over the last metres, against where the nominal bed is.
    const double forget = 1.0 - std::exp(-law_.bin_m() / artefacts.automatic_gain_m);
    const double nominal = scatter::from_db(automatic_level_db);
    double level = nominal;
    float gain = 1.0f;
    for (std::size_t n = 0; n < bins; ++n) {
      const float amplitude = channel.detected[n];
      level += forget * (std::min(1.0, double(amplitude) * amplitude) - level);
      if (n % gain_bins == 0)
        gain = static_cast<float>(std::pow(nominal / level, 0.5 * artefacts.automatic_gain));
      line.bins.sample[n] = recorder_.sample(gain * amplitude);
    }
    line.artefacts.add(Artefact::automatic_gain);
    return;
  }
  for (std::size_t n = 0; n < bins; ++n)
    line.bins.sample[n] = recorder_.sample(channel.detected[n]);
}

}  // namespace ensonify::engine
