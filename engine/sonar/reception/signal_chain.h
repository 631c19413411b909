#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/reception/artefacts.h>
#include <ensonify/engine/sonar/reception/disturbances.h>
#include <ensonify/engine/sonar/reception/other_paths.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/engine/sonar/reception/scatterers.h>

namespace ensonify::engine {

/// What a signal chain is told beside its sonar.
struct ChainOptions {
  std::uint64_t seed = 1;
  std::uint64_t sonar_number = 0;  ///< tells a scene's sonars apart in their noise
  bool speckle = true;             ///< false: expectations, of the noise as well
  double sound_speed_mps = 1500.0;
  double absorption_db_per_m = 0.0;
  double heading_rad = 0.0;          ///< of most pings: one of the directions of Scatterers
  double nominal_altitude_m = 10.0;  ///< for the automatic gain and the level bed
  /// Of the bed, m^2 of backscattering cross-section a m^2 by the sine of the grazing angle, for
  /// the same.
  std::function<double(double sine)> nominal_strength = [](double) { return 3e-4; };
  std::optional<scatter::Sediment> bed;  ///< unset: it is no sediment
  SeaState sea;
  OtherPathsOptions arrivals;
  ArtefactOptions artefacts;
};

/// From the expected echo to what is recorded, for both sides of a sonar at once.
///
/// Echoes of complex scatterers, summed by beam and pulse, scaled so that each bin's mean intensity
/// is the expected one; on them complex noise of the sea, the receiver and of incoherent arrivals,
/// through the same pulse (the matched filter); then gain, noise behind it, detector, the ping's
/// own scale, transfer curve, clip and digitiser.
class SignalChain {
 public:
  SignalChain(const Sonar& sonar, const ChainOptions& options);
  SignalChain(const SignalChain&) = delete;
  SignalChain& operator=(const SignalChain&) = delete;

  /// One thread's memory, kept from ping to ping.
  struct Memory {
    struct Channel {
      // Expected: the echo, as far beyond its bins as the pulse reaches; all else; and the echo's
      // own gain.
      std::vector<float> direct, power, gain;
      std::vector<float> re, im, spread_re, spread_im;
      std::vector<float> white_re, white_im, behind_re, behind_im;
      std::vector<float> energy, detected;
      std::vector<double> sums;
      Scatterers::Memory cells;
    };
    std::array<Channel, 2> channels;
  };

  /// Fills intensity and sample of a ping's lines, of one side or two, from their intensity_mean
  /// and places, and says what spoiled them.
  void receive(const PingContext& hearing, std::span<EchoLine> lines, Memory& memory) const;

  const Recorder& recorder() const { return recorder_; }
  /// Mean noise power of a side, uPa^2.
  double noise(Side side) const { return noise_[static_cast<std::size_t>(side)]; }
  /// The mean intensity in each bin of a side, uPa^2, were the bed level at the nominal altitude
  /// and of the nominal strength, noise in it; 0 before the first echo.
  std::vector<double> level_bed(Side side) const;
  /// Of a bed's intensity, median over mean: speckle's.
  double median_share() const;
  /// What the amplitude in each bin of such a ping is multiplied by behind the recorder's own gain:
  /// an automatic gain that follows the level, and the scale that brings the ping to its mean.
  std::vector<double> automatic_gain(Side side) const;

 private:
  using Channel = Memory::Channel;
  void expect(const PingContext& hearing, EchoLine& line, Channel& channel) const;
  void sum_scatterers(int look, Channel& channel) const;
  void draw_noise(const PingContext& hearing, Side side, int look, Channel& channel) const;
  void draw_white(const PingContext& hearing, Side side, int look, std::size_t count,
                  std::vector<float>& re, std::vector<float>& im) const;
  void detect_look(const Channel* other, int look, float step, Channel& channel) const;
  float gain_step(const PingContext& hearing) const;
  void follow_level(Channel& channel) const;
  float ping_scale(const Channel& channel, std::size_t bins) const;
  void record(const Channel& channel, EchoLine& line) const;

  Sonar sonar_;
  ChainOptions options_;
  Scatterers scatterers_;
  EchoLaw law_;
  std::array<double, 2> noise_{};
  OtherPaths arrivals_;
  Disturbances disturbances_;
  Recorder recorder_;
  std::vector<float> taps_, energy_taps_;
  std::vector<float> gains_;  // the recorder's, in whole groups
  float leak_;                // amplitude of one side in the other
};

}  // namespace ensonify::engine
