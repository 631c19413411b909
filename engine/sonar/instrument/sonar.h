#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/engine/sonar/instrument/mounting.h>
#include <ensonify/engine/sonar/instrument/pulse.h>
#include <ensonify/engine/sonar/instrument/receiver_options.h>

namespace ensonify::engine {

/// sidescan: line arrays along the track that look to the sides, with one beam or several parallel
/// ones. imaging: an array across the track that looks ahead, with beams steered side by side.
enum class SonarKind { sidescan, imaging };
/// In what the steering of an imaging sonar's beams has even steps.
enum class BeamSteps { angle, sine };

/// One instrument: one line array per sector.
struct Sonar {
  std::string name = "sidescan";
  SonarKind kind = SonarKind::sidescan;
  std::string preset;  ///< the preset that gives its default values; empty: none
  Sides sides = Sides::both;
  Mounting mounting;
  double frequency_hz = 400e3;
  double source_level_db = 210.0;  ///< dB re 1 uPa at 1 m, on the axis of the beam
  Pulse pulse;
  double range_m = 75.0;                       ///< slant range of the last bin's far edge
  int bins = 1500;                             ///< per sector
  double sample_rate_hz = 0.0;                 ///< of the digitiser; 0: `bins` gives the bin length
  double array_length_m = 0.5;                 ///< of the transmitter
  double receive_array_length_m = 0.0;         ///< 0: the same array
  ShadingKind shading = ShadingKind::uniform;  ///< of the transmitter
  ShadingKind receive_shading = ShadingKind::same;  ///< same: as the transmitter
  double shading_side_lobe_db = -30.0;              ///< of taylor and chebyshev
  int taylor_nbar = 4;
  /// For ShadingKind::weights: as in Shading::of_weights().
  std::vector<double> shading_weights, receive_shading_weights;
  bool focused = false;  ///< at all ranges; otherwise the near field is as wide as the array
  /// Ranges z at which the arrays are focused. At a range r, the z counts whose 1 / z is nearest to
  /// 1 / r. Empty: `focused` decides.
  std::vector<double> focus_zones_m;
  /// Beams that each sector receives from one ping. Beams of a sidescan are parallel and side by
  /// side along the track. With several, only the receiver is focused, because the transmitter must
  /// sound all beams. Beams of an imaging sonar are steered.
  int beams = 1;
  double field_of_view_rad = 120.0 * degree;  ///< from the first steered beam's axis to the last's
  BeamSteps beam_steps = BeamSteps::angle;    ///< of steered beams
  /// Of an imaging sonar's transmitter, horizontally, -3 dB to -3 dB; 0: field_of_view_rad.
  double transmit_beamwidth_rad = 0.0;
  double beam_spacing_m = 0.2;  ///< from each beam to the next
  int side_lobes = 0;           ///< that rays trace on either side of the main lobe
  VerticalPattern vertical;
  double sector_low_rad = -10.0 * degree;  ///< lowest depression of the fan
  /// Highest depression of the fan; unset: sector_end_rad() computes it.
  std::optional<double> sector_high_rad;
  int planes = 8;         ///< fan planes across the main beam
  int elevations = 2048;  ///< rays per plane
  ReceiverOptions receiver;

  /// The highest depression of the fan: sector_high_rad, if it is set. Otherwise the fan reaches so
  /// far past straight down that the bed beyond the fan adds less than 0.1 dB to what a side
  /// receives at the same range from the near side of the bed's nearest place. The bed may lie
  /// level, or be turned against the array by up to 10 degrees (a slope and a roll together). The
  /// result is from 100 to 135 degrees, and 135 for a pattern that is equal towards both sides. But
  /// the fan is at most 145 degrees wide, unless it would then end above straight down.
  double sector_end_rad() const;
  /// The depressions at which a sector's fan begins and ends.
  double lowest_rad(const Sector& sector) const {
    return sector.element ? sector.element->low_rad : sector_low_rad;
  }
  double highest_rad(const Sector& sector) const {
    return sector.element ? sector.element->high_rad : sector_end_rad();
  }
  double receive_length_m() const {
    return receive_array_length_m > 0.0 ? receive_array_length_m : array_length_m;
  }
  /// The arrays with their shading. Throws std::invalid_argument as Shading does.
  LineArray transmit_array(double wavelength_m) const;
  LineArray receive_array(double wavelength_m) const;
  /// Whether the beams are steered; then they share one fan.
  bool steers() const { return kind == SonarKind::imaging; }
  /// The beams that lie side by side along the array, each with its own fan.
  int parallel_beams() const { return steers() ? 1 : beams; }
  /// Where a steered beam looks: positive to starboard. Beam 0 is the one farthest to port.
  double bearing_rad(int beam) const;
  /// From each plane of a fan for steered beams to the next, as sine of azimuth.
  double sine_step(double wavelength_m) const;
  /// The number of planes of a fan; of steered beams the most that it can have.
  double fan_planes(double wavelength_m) const {
    return steers() ? 2.0 / sine_step(wavelength_m) : planes;
  }
  /// The place of a beam's array on the vehicle, and its direction.
  Mounting beam_mounting(int beam) const {
    Mounting its = mounting.ahead(beam_offset_m(beam));
    its.across = steers();
    return its;
  }
  /// How many lobes beyond the traced lobes may have two-way power. The beam of a moving receiver
  /// reaches beyond the transmitter's lobes, and an outer one of several beams reaches even
  /// farther.
  int lobes_beyond() const { return parallel_beams() > 1 ? 4 : 1; }
  /// How far ahead of the array's middle a beam lies; beam 0 is at the rear end.
  double beam_offset_m(int beam) const {
    return steers() ? 0.0 : (beam - 0.5 * (beams - 1)) * beam_spacing_m;
  }
  /// How far out of focus the receiver is at a range r, and the transmitter of a sonar with one
  /// beam: 1 - r / z, with the z of focus_zones_m for which this is nearest to 0. 1 if not focused,
  /// 0 if focused at all ranges. At r the beam is as wide as the array's length times the magnitude
  /// of this, plus the spread by diffraction.
  double defocus(double at_m) const;
  double transmit_defocus(double at_m) const { return steers() || beams > 1 ? 1.0 : defocus(at_m); }
  /// The range r from nearest_m to range_m at which |defocus(r)| / r is largest.
  double most_defocused_m(double nearest_m) const;
  double bin_m() const { return range_m / bins; }
  /// The sectors, in the order of the sonar's lines; valid until the program ends.
  std::span<const Sector> sectors() const {
    return steers() ? std::span<const Sector>(imaging_sectors) : sectors_of(sides);
  }
  bool has(Side side) const { return place_of(sectors(), name_of(side)).has_value(); }
  /// A copy of this sonar. If sample_rate_hz is set, the bins of the copy are c / (2
  /// sample_rate_hz) long for the sound speed c. Their number is just enough to reach the range, at
  /// most 1e9.
  Sonar sampled(double sound_speed_mps) const;
};

}  // namespace ensonify::engine
