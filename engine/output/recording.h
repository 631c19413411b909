#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/sonar/reception/recorder.h>

namespace ensonify::engine {

/// What a recording needs from its scene: the position and time of the local origin, the water,
/// the bed and the other sonars.
struct RecordingFrame {
  std::optional<GeographicPlace> origin;  ///< place of the seabed's middle
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  int utm_zone = 0;        ///< of the world coordinates; 0: unknown
  std::string reference;   ///< reference system of the world coordinates as WKT; empty: unknown
  std::string start_time;  ///< as OutputOptions::start_time
  double sound_speed_mps = 0.0;
  /// Height of a local position above the bed; NaN over a hole.
  std::function<double(const Eigen::Vector3d& position)> altitude_m;
  int frequency_rank = 0;  ///< place of the sonar in the order of rising frequency, from 0
};

/// Navigation of one recorded ping. Position, attitude and speed are those of the sonar: the
/// vehicle's reported pose plus the sonar's mounting. The altitude is the true one.
struct NavPing {
  std::size_t row = 0;     ///< row of the ping's samples in Recording::samples
  std::size_t number = 0;  ///< number of the row in the run; the numbers of lost pings are missing
  int beam = 0;            ///< as in EchoLine
  std::int64_t unix_ms = 0;
  double interval_s = 0.0;  ///< to the nearer neighbouring ping
  GeographicPlace place;
  double heading_rad = 0.0;  ///< from true north, 0 to 2 pi
  double pitch_rad = 0.0, roll_rad = 0.0;
  double depth_m = 0.0;     ///< below the sea surface
  double altitude_m = 0.0;  ///< above the bed; 0 over a hole
  double speed_mps = 0.0;

  bool operator==(const NavPing&) const = default;
};

/// A waterfall as a real sonar's software would have recorded it.
struct Recording {
  std::string name;  ///< of the sonar
  std::string file;  ///< name of the recording's file, without extension
  double frequency_hz = 0.0, bandwidth_hz = 0.0;
  double pulse_length_s = 0.0;
  double range_m = 0.0;
  double beamwidth_rad = 0.0;  ///< horizontal, -3 dB, of the narrower array (transmit or receive)
  double vertical_beamwidth_rad = 0.0;
  std::array<double, 2> tilt_rad{};   ///< by Side
  std::vector<FullScale> full_scale;  ///< by beam, for the recorder's gain without gain_db
  int frequency_rank = 0;             ///< as in RecordingFrame
  double sound_speed_mps = 0.0;
  std::size_t bins = 0;  ///< per side
  bool port = true, starboard = true;
  std::vector<NavPing> pings;
  std::vector<std::array<double, 2>> gain_db;  ///< above the recorder's usual gain, by row and Side
  /// The samples of each row of the waterfall, in the columns of layout(); at most 32767.
  std::vector<std::uint16_t> samples;

  /// A recording always has columns for both sides; the sectors have the numbers of Side.
  LineLayout layout() const { return {Sides::both, bins}; }
  /// The samples of one side of a row.
  std::span<const std::uint16_t> side(std::size_t row, Side which) const;
};

/// A ping of one of several recordings.
struct PingInTime {
  std::size_t of = 0;      ///< place of the recording in `which`
  std::size_t number = 0;  ///< index into Recording::pings
};
/// The pings of the recordings with the indices `which` into `sonars`, in order of time. Pings with
/// the same time are in the order of `which`. A sonar may have several rows per ping.
std::vector<PingInTime> pings_by_time(std::span<const Recording> sonars,
                                      std::span<const std::size_t> which);

/// The name, without extension, of a file that has the recordings of all sonars of a scene.
inline constexpr std::string_view common_recording = "recording";

/// Unix seconds of a time in the form `2025-06-01T12:00:00Z`; unset for any other text.
std::optional<std::int64_t> unix_time(std::string_view text);

/// The time of a ping in Unix milliseconds. `t_s` is the track's time of the ping, and `first_s`
/// the track's first time. The track's second 0 is `start_time`. If `start_time` is empty, it is
/// 1970-01-01 if `first_s` is above 1e8 (the track has Unix times), else 2000-01-01.
std::int64_t unix_ms_of(std::string_view start_time, double first_s, double t_s);

/// The recording of a waterfall; its file has the sonar's name. Positions follow from the frame's
/// origin, else from its UTM zone, else from its reference system; otherwise they are about a place
/// in the North Sea. Times are from unix_ms_of(). The samples of a side that the sonar lacks are 0.
/// Pings that were not recorded are left out. Throws std::invalid_argument in a build without
/// GeographicLib.
Recording make_recording(const Waterfall& waterfall, std::vector<FullScale> full_scale,
                         const RecordingFrame& frame);

}  // namespace ensonify::engine
