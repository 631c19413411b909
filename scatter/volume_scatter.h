#pragma once

namespace ensonify::scatter {

/// The water that a ping insonifies at one time, and how strongly it scatters.
struct InsonifiedWater {
  double solid_angle_sr = 0.0;  ///< of both beams together: about horizontal x vertical width
  double pulse_s = 0.0;         ///< effective duration; 1 / bandwidth of a compressed chirp
  double sound_speed_mps = 1500.0;
  double strength_db = -75.0;  ///< S_v, dB re 1/m; in the sea about -90 (clear) to -65 (rich)
};

/// The volume that scatters at one time: solid angle x r^2 x c tau / 2. Throws
/// std::invalid_argument for a range, solid angle, duration or sound speed that is not above zero.
double insonified_volume_m3(const InsonifiedWater& water, double range_m);

/// The level of the water's echo, SL - 2 TL - 2 alpha r + S_v + 10 lg V with TL = 20 lg r, in
/// dB re 1 uPa^2: Urick, Principles of Underwater Sound (1983), chapter 8. Throws as above.
double volume_reverberation_db(const InsonifiedWater& water, double source_level_db,
                               double absorption_db_per_m, double range_m);

}  // namespace ensonify::scatter
