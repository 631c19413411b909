#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/disturbances.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/engine/sonar/reception/steered_speckle.h>
#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/scatter/sea_water.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// A beam that gets a smaller share of the array's sound than this stays darker than the other
/// beams, because the recorder's gain of a beam compensates no more.
inline constexpr double least_beam_share = 0.01;

/// The inputs of a signal chain in addition to its sonar.
struct ChainOptions {
  std::uint64_t seed = 1;
  /// Number of the sonar in the scene; each number has separate noise.
  std::uint64_t sonar_number = 0;
  bool speckle = true;  ///< false: expected values, also of the noise
  double sound_speed_mps = scatter::nominal_sound_speed_mps;
  double absorption_db_per_m = 0.0;
  /// Ranges are travel times through this profile; null: distances. It must outlive the chain.
  const scatter::SoundSpeedProfile* profile = nullptr;
  double heading_rad = 0.0;  ///< of the array in most pings; Scatterers needs it
  /// Above the level bed for which the automatic gain is computed.
  double nominal_altitude_m = 10.0;
  double nominal_speed_mps = 0.0;  ///< of the vehicle, for the automatic gain
  double ping_interval_s = 0.0;    ///< 0: the two-way time of the range
  /// Backscattering cross-section of the bed, m^2 per m^2, as a function of the sine of the grazing
  /// angle; for the automatic gain and for echoes of earlier pings.
  std::function<double(double sine)> nominal_strength = [](double) { return 3e-4; };
  std::optional<scatter::Sediment> bed;  ///< unset: the bed is not a sediment
  /// By material's number; empty: all of the ground scatters evenly.
  std::vector<scatter::GroundTexture> textures;
  SeaState sea;
  OtherPathsOptions arrivals;
  ArtefactOptions artefacts;
  std::function<void()> stop_check = {};  ///< called often in the constructor; may throw to end it
};

/// Makes the recorded samples from the expected echo, for all sectors of a sonar together.
///
/// The stages: echoes of complex scatterers, summed over beam and pulse and scaled so that each bin
/// has the expected mean intensity; plus complex noise of the sea, of the receiver and of
/// incoherent paths, through the same matched filter; then gain, noise after the gain, detector,
/// scaling of the ping, transfer curve, clipping and digitiser.
class SignalChain {
 public:
  SignalChain(const Sonar& sonar, const ChainOptions& options);
  SignalChain(const SignalChain&) = delete;
  SignalChain& operator=(const SignalChain&) = delete;

  /// One thread's working scratch, reused from ping to ping.
  struct Scratch {
    struct Channel {
      LineContext context;
      // Expected values: the direct echo, padded on both sides by the pulse's reach;
      // everything else; the gain of the direct echo.
      std::vector<float> direct, power, gain;
      std::vector<float> glint_re, glint_im;  // the steady field; empty: none
      std::vector<float> re, im, spread_re, spread_im;
      std::vector<float> white_re, white_im, behind_re, behind_im;
      std::vector<float> energy, detected;
      std::vector<double> sums;
      Scatterers::Scratch cells;
    };
    std::vector<Channel> channels;  ///< by line
    SteeredSpeckle::Scratch steered;
  };

  /// Sums the speckle of all beams of a ping, if they are steered. Needed before receive().
  void sum_planes(const FanPlanes& planes, Scratch& scratch) const;

  /// Fills the intensity and sample of some lines of a ping from their intensity_mean and places,
  /// and sets their artefacts. contexts: of each line. The lines of a pair of sectors receive each
  /// other's cross-talk.
  void receive(std::span<const LineContext> contexts, std::span<EchoLine> lines,
               Scratch& scratch) const;

  const Recorder& recorder() const { return recorder_; }
  /// The full scale of a beam, with the recorder's usual gain.
  FullScale full_scale(int beam) const {
    return FullScale::of(std::span(gains_[static_cast<std::size_t>(beam)])
                             .first(static_cast<std::size_t>(sonar_.bins)));
  }
  /// Mean noise power of a sector, uPa^2, at a speed of the vehicle, or at the nominal speed.
  double noise(std::size_t sector, double speed_mps) const;
  double noise(std::size_t sector) const { return noise(sector, options_.nominal_speed_mps); }
  /// The mean intensity in each bin of a sector, uPa^2, with noise, over a level bed of the nominal
  /// strength at the nominal altitude and speed; 0 before the first echo.
  std::vector<double> level_bed(std::size_t sector) const;
  /// The range from which on the noise exceeds the echo of this bed in all sectors; 0 if there is
  /// no such range.
  double noise_exceeds_bed_m() const;
  /// What the receiver gets of an echo from the end of the range at the nominal speed, divided by
  /// what it would get at rest; at least least_beam_share.
  double share_of_farthest_echo() const { return moved_shares_.back(); }
  /// Median of a bed's intensity with speckle, divided by its mean.
  double median_share() const;
  /// The factors on the amplitude in each bin of a ping over level_bed(), after the recorder's
  /// gain: automatic gain; scale to the ping's mean; and for several looks the median of the
  /// detector's result, divided by the root of the median of their mean intensity.
  std::vector<double> automatic_gain(std::size_t sector) const;

 private:
  using Channel = Scratch::Channel;
  double unit_bed(std::size_t sector, std::size_t bin) const;
  double automatic_gain_db() const;
  std::vector<double> shares_of_beam(int beam) const;
  std::vector<float> gains_of_beam(int beam) const;
  double self_noise(double speed_mps) const;
  double loudest_noise() const;
  LineContext context_of(const EchoLine& line, LineContext context) const;
  void compute_expected(EchoLine& line, Channel& channel) const;
  void leak_power(Channel& one, Channel& other) const;
  void take_out_glints(const EchoLine& line, std::span<float> direct, Channel& channel) const;
  void sum_scatterers(int look, const SteeredSpeckle::Scratch& fields, Channel& channel) const;
  void spread_scatterers(int look, std::span<const float> direct, Channel& channel) const;
  void shape_steered(int look, std::span<const float> direct, const SteeredSpeckle::Scratch& fields,
                     Channel& channel) const;
  void draw_noise(int look, Channel& channel) const;
  void draw_white(const LineContext& context, int look, std::size_t count, std::vector<float>& re,
                  std::vector<float>& im) const;
  void detect_look(const Channel* other, int look, float step, float behind_rms,
                   Channel& channel) const;
  float gain_step(const LineContext& context) const;
  float ping_gain(const LineContext& context) const;
  float output_noise_rms(double t_s) const;
  void follow_level(Channel& channel) const;
  float ping_scale(const Channel& channel, std::size_t bins) const;

  Sonar sonar_;
  ChainOptions options_;
  Scatterers scatterers_;
  std::optional<SteeredSpeckle> steered_;  // if the beams are steered
  SonarEquation law_;
  std::vector<double> moved_shares_;  // of the two-way beam, at the nominal speed, by bin
  std::vector<double> sea_noise_;     // by sector
  Oscillator waves_;                  // 0 if nothing meets the sea surface
  Oscillator output_noise_wander_;    // dB
  OtherPaths other_paths_;
  Disturbances disturbances_;
  Recorder recorder_;
  SpeckleFilter filter_;
  std::vector<float> energy_taps_;
  std::vector<std::vector<double>> shares_;  // by beam, as LineContext has them
  std::vector<std::vector<float>> gains_;    // by beam
  float leak_;                               // amplitude of cross-talk from the other sector
};

}  // namespace ensonify::engine
