#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/reception/scatterers.h>

namespace ensonify::engine {

/// The ping of a line: number, time and geometry.
struct LineContext {
  std::uint64_t ping = 0;
  double t_s = 0.0;
  ArrayFrame array;
  double altitude_m = 10.0;  ///< above the bed below
  double speed_mps = 0.0;    ///< of the vehicle
  ReceiverMotion motion;
  // Set by the signal chain:
  int beam = 0;
  std::size_t sector = 0;       ///< its place in Sonar::sectors()
  Sector facing = port_sector;  ///< that sector
  double sea_height_m = 0.0;    ///< of the waves
  /// Range (travel time times the sound speed of the ranges) per metre of the way up to the sea
  /// surface, and down to the bed. Rays are straight, so oblique ways have the same ratio.
  double range_per_m_up = 1.0, range_per_m_down = 1.0;
  /// By bin, up to the farthest range of echoes: what this beam receives, divided by what a beam
  /// from the array's middle would receive. Empty: 1.
  std::span<const double> beam_shares;

  double beam_share(std::size_t bin) const {
    return beam_shares.empty() ? 1.0 : beam_shares[std::min(bin, beam_shares.size() - 1)];
  }
  double depth_m() const { return std::max(sea_height_m - array.origin.z(), 0.0); }
};

/// The plane abeam of an array, in which it transmits and receives; the rotation of one sector's
/// pattern in this plane; and how the receiver has moved when an echo comes back. Horizontal
/// planes, the surface and the bed, cut it in horizontal lines.
struct BeamPlane {
  std::size_t sector = 0;                           ///< its place in Sonar::sectors()
  double cos_pitch = 1.0, sin_pitch = 0.0;          ///< of the pitch
  double cos_roll_tilt = 1.0, sin_roll_tilt = 0.0;  ///< the pattern's rotation down, by the roll
  // The receiver's motion, per metre of the echo's range:
  double roll_tilt_per_m = 0.0;                          ///< growth of that rotation
  double turn_level_per_m = 0.0, turn_down_per_m = 0.0;  ///< turn of the axis, outwards and down
  double drift_along = 0.0;                              ///< movement along the axis

  /// The plane of a level array at rest.
  explicit BeamPlane(std::size_t in_sector) : sector(in_sector) {}
  explicit BeamPlane(const LineContext& context);
  bool turns() const { return turn_level_per_m != 0.0 || turn_down_per_m != 0.0; }
  bool at_rest() const { return roll_tilt_per_m == 0.0 && drift_along == 0.0 && !turns(); }
  /// By how much the sine, along the array, of the direction to a place in the plane has grown for
  /// the receiver when the echo is back.
  double shift(double level_m, double down_m) const {
    return level_m * turn_level_per_m + down_m * turn_down_per_m - drift_along;
  }
  /// The distance, within the plane, of the horizontal line that lies height_m above or below the
  /// array.
  double slant_m(double height_m) const { return height_m / std::max(cos_pitch, 1e-6); }
};

}  // namespace ensonify::engine
