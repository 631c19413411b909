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
  std::optional<GeographicPlace> origin;  ///< the seabed's middle
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  int utm_zone = 0;        ///< of the world coordinates; 0: unknown
  std::string reference;   ///< of the world coordinates, as WKT; empty: unknown
  std::string start_time;  ///< as in OutputOptions
  double sound_speed_mps = 0.0;
  /// Height of a local position above the bed; NaN over a hole.
  std::function<double(const Eigen::Vector3d& position)> altitude_m;
  int frequency_rank = 0;  ///< rank of its frequency among the scene's sonars; 0: the lowest
};

/// Navigation of one recorded ping. Position, attitude and speed are those of the sonar: the
/// vehicle's reported pose plus the sonar's mounting. The altitude is the true one.
struct NavPing {
  std::size_t row = 0;     ///< of its samples
  std::size_t number = 0;  ///< of the run's row; a lost ping leaves a gap
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
  std::string file;  ///< name of the file that it is written to, without extension
  double frequency_hz = 0.0, bandwidth_hz = 0.0;
  double pulse_length_s = 0.0;
  double range_m = 0.0;
  double beamwidth_rad = 0.0;  ///< horizontal, -3 dB, of the narrower of both arrays
  double vertical_beamwidth_rad = 0.0;
  std::array<double, 2> tilt_rad{};   ///< by Side
  std::vector<FullScale> full_scale;  ///< by beam, with the recorder's usual gain
  int frequency_rank = 0;             ///< as in RecordingFrame
  double sound_speed_mps = 0.0;
  std::size_t bins = 0;  ///< per side
  bool port = true, starboard = true;
  std::vector<NavPing> pings;
  std::vector<std::array<double, 2>> gain_db;  ///< over the usual one, by row and Side
  /// For each row of the waterfall in the columns of layout(); at most 32767.
  std::vector<std::uint16_t> samples;

  /// Recordings have columns for both sides; their sectors are numbered as Side.
  LineLayout layout() const { return {Sides::both, bins}; }
  /// The samples of one side of a ping, by its row.
  std::span<const std::uint16_t> side(std::size_t row, Side which) const;
};

/// The pings of the recordings with the numbers `which`, in order of time; pings of the same time
/// in the order of `which`. Sonars may have several rows per ping.
struct PingInTime {
  std::size_t of = 0;      ///< place in `which`
  std::size_t number = 0;  ///< in Recording::pings
};
std::vector<PingInTime> pings_by_time(std::span<const Recording> sonars,
                                      std::span<const std::size_t> which);

/// The name of the file of a recording of all sonars of a scene, without its extension.
inline constexpr std::string_view common_recording = "recording";

/// Unix seconds of a time written as `2025-06-01T12:00:00Z`; none for any other form.
std::optional<std::int64_t> unix_time(std::string_view text);

/// The time of a ping of a track that begins at `first_s`, in Unix milliseconds. Without a start
/// time the track begins on 2000-01-01, or at its first time if it counts seconds from 1970.
std::int64_t unix_ms_of(std::string_view start_time, double first_s, double t_s);

/// A recording of a waterfall, whose file has the sonar's name. Positions follow from the frame's
/// origin; without one, from its UTM zone; without that, from its reference system. With none of
/// them they are in the North Sea. Times are those of unix_ms_of(). A side that the sonar does not
/// have is silent. Pings that were not recorded are left out. Throws std::invalid_argument in a
/// build without GeographicLib.
Recording make_recording(const Waterfall& waterfall, std::vector<FullScale> full_scale,
                         const RecordingFrame& frame);

}  // namespace ensonify::engine
