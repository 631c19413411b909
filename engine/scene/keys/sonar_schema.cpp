#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/sonar/instrument/presets.h>

namespace ensonify::engine {
namespace {

// clang-format off
Section<Sonar> made_sonar_section() {
  return {
      "sonar.NAME",
      "One instrument, which looks to port and starboard, or ahead; any number of them, which all ping together. "
      "Its files are named by NAME (letters, digits, _ and -).",
      {
          {"preset", "", {},
           "The instrument (`ensonify presets` lists them) that gives the keys below their "
           "defaults.",
           at(&Sonar::preset), preset_names()},
          {"kind", "", {},
           "sidescan: line arrays along the track that look to the sides. imaging: a line array "
           "across the track that looks ahead and is steered to many directions; each ping gives a "
           "frame of beams x bins. Keys that are not given then have other defaults: those of an "
           "imaging sonar at 750 kHz. If all sonars of a scene are imaging sonars, track.pings is 20.",
           at(&Sonar::kind), {"sidescan", "imaging"}},
          {"sides", "", {}, "The sides it has; files of one side have that side's columns only.",
           at(&Sonar::sides), words_of(sides_kinds)},
          {"forward_m", "m", {-1000, 1000},
           "Where it is mounted, ahead of the vehicle's reference point.",
           at(&Sonar::mounting, &Mounting::forward_m)},
          {"starboard_m", "m", {-1000, 1000}, "Where it is mounted, to starboard.",
           at(&Sonar::mounting, &Mounting::starboard_m)},
          {"down_m", "m", {-1000, 1000}, "Where it is mounted, downwards.",
           at(&Sonar::mounting, &Mounting::down_m)},
          {"mount_azimuth_deg", "degrees", {-360, 360},
           "Turns the array to starboard; at -90 its starboard side looks ahead.",
           at(&Sonar::mounting, &Mounting::azimuth_rad)},
          {"mount_pitch_deg", "degrees", {-80, 80}, "Then lifts the array's fore end.",
           at(&Sonar::mounting, &Mounting::pitch_rad)},
          {"frequency_hz", "Hz", {1e3, 10e6}, "Centre frequency.", at(&Sonar::frequency_hz)},
          {"source_level_db", "dB re 1 uPa at 1 m", {0, 300}, "Source level on the beam's axis.",
           at(&Sonar::source_level_db)},
          {"pulse", "", {},
           "cw: a tone of constant amplitude, whose echo begins at its range; lfm: a sweep of rising "
           "frequency, which the matched filter compresses to 1 / bandwidth about its range. On the "
           "move a sweep's echo lies nearer by frequency_hz * pulse_length_s / bandwidth_hz times the "
           "closing speed.",
           at(&Sonar::pulse, &Pulse::kind), {"cw", "lfm"}},
          {"bandwidth_hz", "Hz", {10, 10e6},
           "Bandwidth of the pulse. A cw pulse with a pulse_length_s has 1 / pulse_length_s instead.",
           at(&Sonar::pulse, &Pulse::bandwidth_hz)},
          {"pulse_length_s", "s", {0, 1},
           "Length as transmitted; 0: 1 / bandwidth_hz. A longer cw pulse has longer range cells; a "
           "longer sweep is louder over the noise, by 10 log10(bandwidth_hz * pulse_length_s) dB.",
           at(&Sonar::pulse, &Pulse::length_s)},
          {"window", "", {},
           "Window over the spectrum of an lfm pulse. none: side lobes of -13.3 dB; hann: -31.5 "
           "dB, 1.5 times as long, 1.76 dB more noise.",
           at(&Sonar::pulse, &Pulse::window), {"none", "hann"}},
          {"range_m", "m", {0.1, 20000}, "Slant range of the last bin's far edge.",
           at(&Sonar::range_m)},
          {"bins", "", {1, 65536}, "Range bins per side; they divide range_m evenly.",
           at(&Sonar::bins)},
          {"sample_rate_hz", "Hz", {0, 100e6},
           "Sample rate of the digitiser, which replaces bins: they are c / (2 rate) long and "
           "reach range_m; 0: the key bins is used.",
           at(&Sonar::sample_rate_hz)},
          {"array_length_m", "m", {0.001, 100}, "Length of the line array that transmits.",
           at(&Sonar::array_length_m)},
          {"receive_array_length_m", "m", {0, 100},
           "Length of the line array that receives; 0: the same.",
           at(&Sonar::receive_array_length_m)},
          {"focused", "", {},
           "Whether the arrays are focused at all ranges; if not, the beam is as wide as the array "
           "is long at ranges below about length^2 / wavelength.",
           at(&Sonar::focused)},
          {"focus_zones_m", "m", {0.1, 100000},
           "Ranges at which transmitter and receiver are focused, in place of focused: each for the "
           "ranges nearest to it in 1 / r. Out of focus, the beam is widened by the quadratic phase "
           "of 1 / r - 1 / zone.",
           at(&Sonar::focus_zones_m)},
          {"shading", "", {},
           "Weights of the transmitter over its length. They change its beam, side lobes and near "
           "field; source_level_db stays that on the axis.",
           at(&Sonar::shading), {"uniform", "hann", "taylor", "chebyshev", "weights"}},
          {"receive_shading", "", {},
           "Weights of the receiver, which also change the noise it receives.",
           at(&Sonar::receive_shading),
           {"uniform", "hann", "taylor", "chebyshev", "weights", "same"}},
          {"shading_side_lobe_db", "dB", {-80, -14},
           "Level of the side lobes of taylor and chebyshev, one way, re the axis.",
           at(&Sonar::shading_side_lobe_db)},
          {"taylor_nbar", "", {2, 30},
           "nbar of taylor: the first nbar - 1 side lobes are nearly at that level, those beyond "
           "fall.",
           at(&Sonar::taylor_nbar)},
          {"shading_weights", "", {0, 1e6},
           "For weights: one number per element of the transmitter, from one end to the other, in "
           "any scale, the same from both ends.",
           at(&Sonar::shading_weights)},
          {"receive_shading_weights", "", {0, 1e6}, "The same of the receiver.",
           at(&Sonar::receive_shading_weights)},
          {"field_of_view_deg", "degrees", {1, 180},
           "Of an imaging sonar: angle from the axis of its first beam, which looks farthest to "
           "port, to that of its last.",
           at(&Sonar::field_of_view_rad)},
          {"beam_steps", "", {},
           "In what the steps from each beam of an imaging sonar to the next are equal: the angle, "
           "or its sine, as the beams of a Fourier transform are.",
           at(&Sonar::beam_steps), {"angle", "sine"}},
          {"transmit_beamwidth_deg", "degrees", {0, 180},
           "Horizontal width of an imaging sonar's transmitter, -3 dB to -3 dB; 0: the field of view.",
           at(&Sonar::transmit_beamwidth_rad)},
          {"beams", "", {1, 1024},
           "Of an imaging sonar: the number of steered beams, each a row of the image per ping. Of a "
           "sidescan: the number of parallel beams of each side, at most 32. Each gives one row of the image per ping, the rear beam first. "
           "With N beams the vehicle can be N times as fast. The receiver is "
           "steered to each of them and focused as focused or focus_zones_m say; the transmitter is "
           "not focused, and must be short enough to reach them all. The recorder's gain makes the "
           "beams equally bright on a level bed; the layer intensity is not corrected.",
           at(&Sonar::beams)},
          {"beam_spacing_m", "m", {0.001, 10},
           "Distance from each of these beams to the next, along the array, at all ranges. Rows are "
           "even if beams * beam_spacing_m is how far the vehicle goes from ping to ping.",
           at(&Sonar::beam_spacing_m)},
          {"side_lobes", "", {0, 20},
           "Number of side lobes that are traced on either side; 0: the main lobe alone.",
           at(&Sonar::side_lobes)},
          {"vertical_beamwidth_deg", "degrees", {0, 180},
           "Width of the vertical beam, -3 dB to -3 dB, at least 0.5; 0: the same in all "
           "directions. Below -30 dB the level of the bed is uneven: by 0.2 dB for a beam of "
           "20 degrees, 1 dB for 2 degrees, 3 dB for 1 degree; half of that with elevations = 16384.",
           at(&Sonar::vertical, &VerticalPattern::beamwidth_rad)},
          {"tilt_deg", "degrees", {-90, 90}, "The vertical beam's axis below the horizontal.",
           at(&Sonar::vertical, &VerticalPattern::tilt_rad)},
          {"vertical_pattern", "", {},
           "A measured vertical beam, which replaces width and tilt: CSV with columns "
           "depression_deg (-90 to 180) and level_db, or port_db and starboard_db: one-way power "
           "re its peak. A path as for seafloor.survey.",
           at(&Sonar::vertical, &VerticalPattern::file)},
          {"vertical_floor_db", "dB", {-200, 0},
           "Lowest level of the vertical beam, re its peak; unset: -20, or no limit if the beam "
           "was measured.",
           at(&Sonar::vertical, &VerticalPattern::floor_db)},
          {"vertical_floor_below_db", "dB", {-200, 0},
           "The same from the beam's axis to 90 degrees below it, at least to straight down, where the "
           "nulls of real elements are filled; unset: vertical_floor_db.",
           at(&Sonar::vertical, &VerticalPattern::floor_below_db)},
          {"vertical_ripple_db", "dB", {0, 100},
           "Ripple over the vertical beam, a cosine in dB: from its brightest to its darkest, one way.",
           at(&Sonar::vertical, &VerticalPattern::ripple_db)},
          {"vertical_ripple_period_deg", "degrees", {0.1, 360},
           "Angle from one dark band to the next.",
           at(&Sonar::vertical, &VerticalPattern::ripple_period_rad)},
          {"vertical_ripple_dark_deg", "degrees", {-90, 180}, "Depression of a dark band.",
           at(&Sonar::vertical, &VerticalPattern::ripple_dark_rad)},
          {"port_mount_deg", "degrees", {-90, 90},
           "Turns the port side's vertical beam further down.",
           at(&Sonar::vertical, &VerticalPattern::port_mount_rad)},
          {"starboard_mount_deg", "degrees", {-90, 90},
           "Turns the starboard side's vertical beam further down.",
           at(&Sonar::vertical, &VerticalPattern::starboard_mount_rad)},
          {"sector_low_deg", "degrees", {-90, 180},
           "Depression where the rays begin; negative is above the horizontal.",
           at(&Sonar::sector_low_rad)},
          {"sector_high_deg", "degrees", {-90, 180},
           "Depression where the rays end; 90 is straight down, more is beyond it. Unset: from 100 to "
           "135, as far as the vertical beam needs for all of the bed that a side hears, within 0.1 dB, "
           "if slope and roll together are up to 10 degrees. A bed that slopes by more needs as much "
           "more, twice.",
           at(&Sonar::sector_high_rad)},
          {"planes", "", {2, 1024}, "Planes of rays across the main beam, an even number.",
           at(&Sonar::planes)},
          {"elevations", "", {2, 1 << 20},
           "Rays per plane. A level bed needs 64; a rough one at grazing angles many more, or small "
           "lit places between the rays are taken for shadow.",
           at(&Sonar::elevations)},
          {"noise", "", {}, "Whether it receives the sea's noise and its own.",
           at(&Sonar::receiver, &ReceiverOptions::noise)},
          {"self_noise_db", "dB re 1 uPa^2/Hz", {-100, 250},
           "Noise of the receiver and of its platform, as if received along the beam's axis; unset: "
           "only the sea's noise.",
           at(&Sonar::receiver, &ReceiverOptions::self_noise_db)},
          {"self_noise_speed_mps", "m/s", {0.01, 100},
           "Speed of the vehicle up to which self_noise_db holds.",
           at(&Sonar::receiver, &ReceiverOptions::self_noise_speed_mps)},
          {"self_noise_slope_db", "dB", {0, 120},
           "How much the self-noise grows beyond that speed, per factor of ten in speed; 0: not at "
           "all.",
           at(&Sonar::receiver, &ReceiverOptions::self_noise_slope_db)},
          {"output_noise_db", "dB re full scale", {-200, 0},
           "Noise added behind the gain and before the detector, which makes the recorded noise "
           "floor constant over range; unset: none.",
           at(&Sonar::receiver, &ReceiverOptions::output_noise_db)},
          {"output_noise_wander_db", "dB", {0, 20},
           "Rms slow change of that noise along the line, equal on both sides; 0: constant.",
           at(&Sonar::receiver, &ReceiverOptions::output_noise_wander_db)},
          {"output_noise_wander_s", "s", {0.01, 1e6}, "Correlation time of that change.",
           at(&Sonar::receiver, &ReceiverOptions::output_noise_wander_s)},
          {"tvg_spreading", "", {0, 80},
           "The recorder's gain over range, in dB per factor of ten, before digitising. It ends "
           "where the expected noise is recorded at bed_level_db.",
           at(&Sonar::receiver, &ReceiverOptions::spreading)},
          {"tvg_absorption", "", {}, "Whether that gain compensates absorption too.",
           at(&Sonar::receiver, &ReceiverOptions::absorption)},
          {"gain_db", "dB re 1/uPa", {-300, 300},
           "The recorder's gain at 1 m: after it 0 dB is full scale, and more clips. Unset: the "
           "gain that records the bed at bed_level_db.",
           at(&Sonar::receiver, &ReceiverOptions::gain_db)},
          {"ping_gain_db", "dB", {0, 20},
           "Rms change of the gain from ping to ping, equal on both sides, as where the transmitter's "
           "level changes: bright and dark rows of the picture.",
           at(&Sonar::receiver, &ReceiverOptions::ping_gain_db)},
          {"bed_level_db", "dB re full scale", {-200, 0},
           "Level of the bed at half the range in the samples, if gain_db is unset; of an imaging "
           "sonar, where the bed is loudest.",
           at(&Sonar::receiver, &ReceiverOptions::bed_level_db)},
          {"looks", "", {1, 64},
           "Number of independent echoes that the detector combines into one sample.",
           at(&Sonar::receiver, &ReceiverOptions::looks)},
          {"detector", "", {}, "How the detector combines their amplitudes.",
           at(&Sonar::receiver, &ReceiverOptions::detector), {"mean", "peak"}},
          {"ping_mean", "", {0, 1},
           "Each ping of a side is scaled so that its mean amplitude, after the transmitted pulse, "
           "is this share of full scale, as recorders with an automatic gain do; 0: not scaled.",
           at(&Sonar::receiver, &ReceiverOptions::ping_mean)},
          {"curve", "", {}, "How an amplitude is converted to a sample.",
           at(&Sonar::receiver, &ReceiverOptions::curve), {"linear", "square-root", "logarithmic"}},
          {"curve_range_db", "dB", {1, 300},
           "Range of a logarithmic curve, from zero to full scale.",
           at(&Sonar::receiver, &ReceiverOptions::curve_range_db)},
          {"bits", "", {1, 24}, "Bits of a sample; full scale is 2^bits - 1.",
           at(&Sonar::receiver, &ReceiverOptions::bits)},
      }};
}
}  // namespace
const Section<Sonar>& sonar_section() { return made_once<made_sonar_section>(); }
// clang-format on

}  // namespace ensonify::engine
