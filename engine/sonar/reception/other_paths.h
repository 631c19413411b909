#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/reception/moved_beam.h>
#include <ensonify/engine/sonar/reception/one_way_beams.h>
#include <ensonify/engine/sonar/reception/other_paths_options.h>
#include <ensonify/engine/sonar/reception/scatterers.h>
#include <ensonify/scatter/sediment.h>
#include <ensonify/scatter/surface_scatter.h>

namespace ensonify::engine {

/// The number, time and geometry of a ping.
struct PingContext {
  std::uint64_t ping = 0;
  int beam = 0;
  double t_s = 0.0;
  ArrayFrame array;
  double altitude_m = 10.0;                ///< above the bed below
  double speed_mps = 0.0;                  ///< of the vehicle
  std::array<ReceiverMotion, 2> motion{};  ///< by side
  // Set by the signal chain:
  double sea_height_m = 0.0;  ///< of the waves
  /// Range, which is travel time at the sound speed of the ranges, per metre of the way up to the
  /// sea surface and down to the bed. Rays are straight, so it is the same on oblique ways.
  double range_per_m_up = 1.0, range_per_m_down = 1.0;
  /// What this beam gets of the sound that the array's middle beam would, by bin; empty: all.
  std::span<const double> beam_shares;

  double beam_share(std::size_t bin) const {
    return beam_shares.empty() ? 1.0 : beam_shares[std::min(bin, beam_shares.size() - 1)];
  }
  double depth_m() const { return std::max(sea_height_m - array.origin.z(), 0.0); }
};

/// The plane abeam of an array, in which it transmits and receives, and the rotation of one side's
/// pattern in it; and how the receiver has moved when an echo comes back. Horizontal planes, the
/// surface and the bed, cut it in horizontal lines.
struct BeamPlane {
  double cos_pitch = 1.0, sin_pitch = 0.0;          ///< of the pitch
  double cos_roll_tilt = 1.0, sin_roll_tilt = 0.0;  ///< the pattern's rotation down, by the roll
  // The receiver's motion, per metre of the echo's range:
  double roll_tilt_per_m = 0.0;                          ///< of that rotation
  double turn_level_per_m = 0.0, turn_down_per_m = 0.0;  ///< of the axis, to the side and down
  double drift_along = 0.0;                              ///< along the axis

  BeamPlane() = default;  ///< of a level array at rest
  BeamPlane(const PingContext& context, Side side);
  bool turns() const { return turn_level_per_m != 0.0 || turn_down_per_m != 0.0; }
  bool at_rest() const { return roll_tilt_per_m == 0.0 && drift_along == 0.0 && !turns(); }
  /// By how much the sine of the direction to a place in the plane, along the array, has grown for
  /// the receiver when its echo is back.
  double shift(double level_m, double down_m) const {
    return level_m * turn_level_per_m + down_m * turn_down_per_m - drift_along;
  }
  /// The distance, within the plane, of a horizontal line that lies height_m above or below.
  double slant_m(double height_m) const { return height_m / std::max(cos_pitch, 1e-6); }
};

/// The sonar equation without the scatterer's strength.
class SonarEquation {
 public:
  /// The scatterers must outlive this object.
  SonarEquation(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
                const Scatterers& scatterers);

  std::size_t bins() const { return per_m2_.size(); }
  double bin_m() const { return bin_m_; }
  double range_m(std::size_t bin) const { return (static_cast<double>(bin) + 0.5) * bin_m_; }
  /// The middle of the ranges that a bin receives from: its own for a sweep, half a range cell
  /// nearer for a CW pulse, whose leading edge is at the bin.
  double cell_middle_m(std::size_t bin) const {
    return std::max(range_m(bin) - lead_m_, 0.5 * range_m(bin));  // no cell begins before range 0
  }
  /// Intensity, uPa^2, of the echo of 1 m^2 of scattering cross-section at a bin's range on the
  /// beam's axis.
  double per_m2(std::size_t bin) const { return per_m2_[bin]; }
  /// The same at any range, also beyond the last bin.
  double per_m2_at(double range_m) const;
  /// c tau_e / 2.
  double cell_m() const { return cell_m_; }
  /// Integral of the two-way power pattern along the array, m.
  double width_m(std::size_t bin) const { return scatterers_->width_m(bin); }
  double width_m_at(double range_m) const;
  /// Two-way power pattern at a distance along the array, relative to the axis.
  double pattern(std::size_t bin, double along_m) const {
    return scatterers_->pattern(bin, along_m);
  }
  double wavelength_m() const { return wavelength_m_; }
  double frequency_hz() const { return frequency_hz_; }
  double sound_speed_mps() const { return wavelength_m_ * frequency_hz_; }
  /// One-way power of a side's vertical pattern, for a direction's components abeam and down in
  /// the sonar's frame.
  double vertical(Side side, double abeam, double down) const {
    return vertical_[static_cast<std::size_t>(side)].power(abeam, down);
  }
  /// The same, for a direction's components in the plane abeam: horizontally to the side, and down
  /// within the plane.
  double vertical(Side side, const BeamPlane& plane, double level, double down) const {
    return vertical(side, level * plane.cos_roll_tilt + down * plane.sin_roll_tilt,
                    down * plane.cos_roll_tilt - level * plane.sin_roll_tilt);
  }
  /// The same when an echo from a range comes back; from a negative range: that long before the
  /// ping.
  double vertical_at(Side side, const BeamPlane& plane, double range_m, double level,
                     double down) const {
    const double turned_rad = range_m * plane.roll_tilt_per_m;
    return vertical(side, plane, level + turned_rad * down, down - turned_rad * level);
  }
  /// Two-way power of the vertical pattern towards a place in the plane, at a range, times what is
  /// left of the beam along the track. before_m: how long before this ping the sound was
  /// transmitted, as a range.
  double two_way(Side side, const BeamPlane& plane, double range_m, double level_m, double down_m,
                 double before_m = 0.0) const {
    const double sent = vertical_at(side, plane, -before_m, level_m, down_m);
    if (plane.at_rest()) return sent * sent;
    return sent * vertical_at(side, plane, range_m - before_m, level_m, down_m) *
           moved_share(plane, range_m, level_m, down_m);
  }
  double moved_share(const BeamPlane& plane, double range_m, double level_m, double down_m) const {
    return plane.at_rest() ? 1.0 : moved_beam_.share(range_m, plane.shift(level_m, down_m));
  }
  const MovedBeam& moved_beam() const { return moved_beam_; }
  /// Intensity, uPa^2, of the echo of a level bed of unit strength on one side of the plane, from
  /// cells about a range. `sine`: of their depression in the plane; at most 0.9 counts, since cells
  /// near the vertical do not grow without limit. before_m: as in two_way().
  double level_bed(Side side, const BeamPlane& plane, double range_m, double sine,
                   double before_m = 0.0) const;
  /// Integral over depression of the one-way vertical pattern raised to `power`: 1: one-way, 2:
  /// two-way.
  double vertical_width_rad(Side side, int power) const;

 private:
  double on_axis(double range_m) const;

  double bin_m_, cell_m_, lead_m_, wavelength_m_, frequency_hz_;
  double source_level_db_, absorption_db_per_m_;
  std::vector<double> per_m2_;
  std::array<VerticalTable, 2> vertical_;
  MovedBeam moved_beam_;
  const Scatterers* scatterers_;
};

/// The farthest range from which echoes of earlier pings are added. ping_m: as of OtherPaths.
double farthest_earlier_m(const Sonar& sonar, double ping_m);

/// Received power of the sea's noise, uPa^2, the same at all ranges: the ambient noise
/// (scatter/ambient_noise.h) in the band of the pulse, reduced by the directivity of the receiving
/// array.
double sea_noise_power(const Sonar& sonar, const SonarEquation& law, const SeaState& sea,
                       Side side);

/// Integrals of the two-way vertical pattern over parts of the plane abeam.
class VerticalSum {
 public:
  VerticalSum(const SonarEquation& law, Side side);
  /// From one depression to another in the sonar's frame; any angles.
  double between(double from_rad, double to_rad) const { return up_to(to_rad) - up_to(from_rad); }

 private:
  double up_to(double depression_rad) const;
  std::vector<double> sums_;  // from depression 0
};

/// Sound that is received incoherently in addition to the direct echo. The sea surface is a plane
/// that moves up and down; for multiples, volume reverberation and echoes of earlier pings the bed
/// is a horizontal plane at the altitude.
class OtherPaths {
 public:
  /// The bed that other paths meet: its backscattering cross-section, m^2 per m^2, as a function of
  /// the sine of the grazing angle; and its sediment, if it is one.
  struct Bed {
    std::function<double(double sine)> strength;
    std::optional<scatter::Sediment> sediment;
  };
  /// `ping_m` is the range that sound covers both ways between two pings, c P / 2. The sonar
  /// equation, which is that of the sonar, must outlive this object.
  OtherPaths(const OtherPathsOptions& options, const Sonar& sonar, const SeaState& sea,
             const SonarEquation& law, const Bed& bed, double ping_m);

  /// Adds to the intensity `power` in each bin, which is the noise before; `direct` is the expected
  /// direct echo, per bin. `sums` is working memory.
  void add(const PingContext& context, const EchoLine& line, std::span<const float> direct,
           std::span<float> power, std::vector<double>& sums) const;

 private:
  void add_surface(const PingContext& context, Side side, const BeamPlane& plane,
                   std::span<float> power) const;
  void add_volume(const PingContext& context, double depth_m, double altitude_m, Side side,
                  const BeamPlane& plane, std::span<float> power) const;
  void sum_bed(double slant_m, Side side, const BeamPlane& plane, std::span<const float> direct,
               std::vector<double>& sums) const;
  void add_multiples(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                     std::span<const float> direct, std::span<float> power,
                     std::vector<double>& sums) const;
  void add_earlier_pings(const PingContext& context, Side side, const BeamPlane& plane,
                         std::span<float> power) const;
  void add_double_bounce(const PingContext& context, const EchoLine& line, const BeamPlane& plane,
                         std::span<const float> direct, std::span<float> power) const;
  struct MirroredBeam;
  double mirrored_m(const MirroredBeam& beam) const;

  OtherPathsOptions options_;
  const SonarEquation& law_;
  std::function<double(double sine)> bed_strength_;
  std::optional<scatter::Sediment> sediment_;
  double k_per_cm_;  // of the sediment's relief
  double ping_m_;
  scatter::SeaSurface surface_;
  std::vector<double> surface_strength_;  // by the sine of the grazing angle
  std::vector<double> bed_reflection_;    // of energy, by the same
  std::vector<double> volume_;            // per bin, for one radian of the vertical beam
  std::array<VerticalSum, 2> vertical_sums_;
  std::optional<OneWayBeams> beams_;  // if multiples or walls are received
};

}  // namespace ensonify::engine
