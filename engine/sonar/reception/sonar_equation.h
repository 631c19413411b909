#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include <ensonify/engine/sonar/reception/line_context.h>
#include <ensonify/engine/sonar/reception/moved_beam.h>
#include <ensonify/engine/sonar/reception/other_paths_options.h>

namespace ensonify::engine {

/// The sonar equation without the scatterer's strength.
class SonarEquation {
 public:
  /// The scatterers must outlive this object.
  SonarEquation(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
                const Scatterers& scatterers);

  std::size_t bins() const { return per_m2_.size(); }
  double bin_m() const { return bin_m_; }
  double range_m(std::size_t bin) const { return (static_cast<double>(bin) + 0.5) * bin_m_; }
  /// The middle of the ranges that a bin receives from: the range of the bin for a sweep, half a
  /// range cell nearer for a CW pulse, whose leading edge is at the bin.
  double cell_middle_m(std::size_t bin) const {
    return std::max(range_m(bin) - lead_m_, 0.5 * range_m(bin));  // no cell begins before range 0
  }
  /// Intensity, uPa^2, of the echo of 1 m^2 of scattering cross-section at a bin's range on the
  /// beam's axis.
  double per_m2(std::size_t bin) const { return per_m2_[bin]; }
  /// per_m2() at any range, also beyond the last bin.
  double per_m2_at(double range_m) const;
  /// c tau_e / 2.
  double cell_m() const { return cell_m_; }
  /// Integral of the two-way power pattern along the array, m.
  double width_m(std::size_t bin) const { return scatterers_->width_m(bin); }
  double width_m_at(double range_m) const;
  /// The share of width_m() between two distances along the array from its middle.
  double width_share(std::size_t bin, double from_m, double until_m) const {
    return scatterers_->width_share(bin, from_m, until_m);
  }
  double wavelength_m() const { return wavelength_m_; }
  double frequency_hz() const { return frequency_hz_; }
  double sound_speed_mps() const { return wavelength_m_ * frequency_hz_; }
  /// One-way power of a sector's vertical pattern, for a direction's components abeam and down in
  /// the sonar's frame.
  double vertical(std::size_t sector, double abeam, double down) const {
    return vertical_[sector].power(abeam, down);
  }
  /// The same for a direction's components in the plane abeam: horizontally outwards, and down
  /// within the plane.
  double vertical(const BeamPlane& plane, double level, double down) const {
    return vertical(plane.sector, level * plane.cos_roll_tilt + down * plane.sin_roll_tilt,
                    down * plane.cos_roll_tilt - level * plane.sin_roll_tilt);
  }
  /// The same at the time when an echo from range_m comes back; a negative range is a time before
  /// the ping.
  double vertical_at(const BeamPlane& plane, double range_m, double level, double down) const {
    const double turned_rad = range_m * plane.roll_tilt_per_m;
    return vertical(plane, level + turned_rad * down, down - turned_rad * level);
  }
  /// Two-way power of the vertical pattern towards a place in the plane, times the share that is
  /// left of the beam along the track (moved_share()). before_m: how long before this ping the
  /// sound was transmitted, as a range.
  double two_way(const BeamPlane& plane, double range_m, double level_m, double down_m,
                 double before_m = 0.0) const {
    const double sent = vertical_at(plane, -before_m, level_m, down_m);
    if (plane.at_rest()) return sent * sent;
    return sent * vertical_at(plane, range_m - before_m, level_m, down_m) *
           moved_share(plane, range_m, level_m, down_m);
  }
  double moved_share(const BeamPlane& plane, double range_m, double level_m, double down_m) const {
    return plane.at_rest() ? 1.0 : moved_beam_.share(range_m, plane.shift(level_m, down_m));
  }
  const MovedBeam& moved_beam() const { return moved_beam_; }
  /// Intensity, uPa^2, of the echo of a level bed of unit strength in a sector, from cells around a
  /// range. `sine`: sine of their depression in the plane. It is limited to 0.9, because cells near
  /// the vertical do not grow without limit.
  double level_bed(const BeamPlane& plane, double range_m, double sine) const;

 private:
  double on_axis(double range_m) const;

  double bin_m_, cell_m_, lead_m_, wavelength_m_, frequency_hz_;
  double source_level_db_, absorption_db_per_m_;
  std::vector<double> per_m2_;
  std::vector<VerticalTable> vertical_;  // by sector
  MovedBeam moved_beam_;
  const Scatterers* scatterers_;
};

/// The bed for all paths except the direct path: a horizontal plane.
struct LevelBed {
  /// Its backscattering cross-section, m^2 per m^2, as a function of the sine of the grazing angle.
  std::function<double(double sine)> strength;
  std::optional<scatter::Sediment> sediment;  ///< none if the bed is not a sediment

  double strength_at(double sine) const { return strength(std::clamp(sine, 1e-4, 1.0)); }
  /// The wavenumber of the sediment's relief.
  double relief_k_per_cm(const SonarEquation& law) const {
    return scatter::relief_wavenumber_per_cm(*sediment, law.frequency_hz(), law.sound_speed_mps());
  }
};

/// By sector: received power of the sea's noise, uPa^2, the same at all ranges. It is the ambient
/// noise (scatter/ambient_noise.h) in the band of the pulse, reduced by the directivity of the
/// receiving array.
std::vector<double> sea_noise_powers(const Sonar& sonar, const SonarEquation& law,
                                     const SeaState& sea);

}  // namespace ensonify::engine
