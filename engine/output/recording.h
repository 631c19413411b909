#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/geographic.h>

namespace ensonify::engine {

/// Where and when a scene's local metres and seconds are.
struct RecordingFrame {
  std::optional<GeographicPlace> origin;  ///< of the seabed's middle
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  int utm_zone = 0;        ///< of that world; 0: unknown
  std::string start_time;  ///< as in OutputOptions
  double sound_speed_mps = 1500.0;
};

/// What a ping of a recording says: what the vehicle reports.
struct RecordedPing {
  std::int64_t unix_ms = 0;
  GeographicPlace place;
  double heading_rad = 0.0;  ///< from true north, 0 to 2 pi
  double pitch_rad = 0.0, roll_rad = 0.0;
  double depth_m = 0.0;     ///< below the sea surface
  double altitude_m = 0.0;  ///< over the bed; 0 over a hole
  double speed_mps = 0.0;
};

/// A waterfall as a sonar's own program would have kept it.
struct Recording {
  std::string name;  ///< of the sonar
  double frequency_hz = 0.0, bandwidth_hz = 0.0;
  double range_m = 0.0;
  double beamwidth_rad = 0.0;  ///< horizontal, -3 dB
  double vertical_beamwidth_rad = 0.0, tilt_rad = 0.0;
  double sound_speed_mps = 1500.0;
  std::size_t bins = 0;  ///< a side
  bool port = true, starboard = true;
  std::vector<RecordedPing> pings;
  std::vector<std::uint16_t>
      samples;  ///< 2 * bins a ping: port far..near, starboard near..far; at most 32767

  /// The samples of one side of a ping.
  std::span<const std::uint16_t> side(std::size_t ping, Side which) const;
};

/// Unix seconds of `2025-06-01T12:00:00Z`; none for anything else.
std::optional<std::int64_t> unix_time(std::string_view text);

/// A recording of a waterfall. Without an origin it lies by the frame's UTM zone, else in the North Sea; without
/// a start time it begins on 2000-01-01, or when its track says, if that counts its seconds from 1970. A side that
/// the sonar has not is silent. Throws std::invalid_argument in a build without GeographicLib.
Recording make_recording(const Waterfall& waterfall, const RecordingFrame& frame);

}  // namespace ensonify::engine
