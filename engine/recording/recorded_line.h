#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/sonar/instrument/beam_pattern.h>

namespace ensonify::engine {

/// One ping of a recording. What its file does not state is unset.
struct RecordedPing {
  std::uint64_t number = 0;
  int beam = 0;               ///< of a sonar with several beams; all beams of a ping have one time
  std::optional<double> t_s;  ///< since 1970, UTC
  std::optional<GeographicPlace> place;    ///< of the sonar; of the ship if only that is stated
  std::optional<Eigen::Vector2d> place_m;  ///< instead of `place`: east and north on the file's map
  /// Distance over ground by which `place` was moved back along the ship's track. It is set if the
  /// file states the ship's place and how far behind the ship the sonar is towed.
  std::optional<double> layback_m;
  std::optional<double> heading_rad;  ///< clockwise from north
  std::optional<double> gyro_rad;     ///< the ship's heading, by its gyro
  std::optional<double> pitch_rad;    ///< nose up
  std::optional<double> roll_rad;     ///< starboard down
  std::optional<double> depth_m;      ///< of the sonar, below the sea surface
  std::optional<double> altitude_m;   ///< of the sonar, above the bed
  std::optional<double> speed_mps;
  double range_m = 0.0;     ///< slant range of the far edge of the last sample; 0: not stated
  std::size_t samples = 0;  ///< per side; the other samples of the ping's row are 0
  /// The number of samples nearer than the first recorded sample; these samples are 0.
  std::size_t unrecorded = 0;
  /// The number of far samples that one side lacks, which ends at a shorter range; they are 0.
  std::size_t one_sided = 0;
};

/// The pings of one sidescan sonar of a recording, or of one of its frequencies if it has several.
struct RecordedLine {
  std::string format;         ///< XTF or JSF
  std::string sonar;          ///< name of the sonar in the file; empty: none
  double frequency_hz = 0.0;  ///< 0: not stated. This holds for the next five members, too.
  double bandwidth_hz = 0.0;
  double pulse_length_s = 0.0;
  double sound_speed_mps = 0.0;
  double beamwidth_rad = 0.0;           ///< horizontal, -3 dB
  double vertical_beamwidth_rad = 0.0;  ///< -3 dB
  std::optional<double> tilt_rad;       ///< of the vertical beam's axis below the horizontal
  bool peak_detector = false;  ///< each sample is the largest of several, as the file states
  std::vector<RecordedPing> pings;
  std::size_t samples = 0;  ///< per row and side: those of the longest ping
  /// Amplitudes as recorded, one row per ping, from near to far. Empty if the line lacks this side.
  std::vector<float> port, starboard;
  std::vector<std::string> warnings;  ///< what was left out or is doubtful; each names its file

  const std::vector<float>& side(Side which) const {
    return which == Side::port ? port : starboard;
  }
  /// The sides that the line has.
  std::vector<Side> sides() const {
    std::vector<Side> all;
    if (!port.empty()) all.push_back(Side::port);
    if (!starboard.empty()) all.push_back(Side::starboard);
    return all;
  }
  /// The samples of ping `ping` of `pings`, from near to far. The line must have the side `which`.
  std::span<const float> row(Side which, std::size_t ping) const {
    return std::span(side(which)).subspan(ping * samples, samples);
  }
  /// The slant range of the near edge of a sample of the ping with this index into `pings`.
  double sample_range_m(std::size_t ping, std::size_t sample) const {
    return static_cast<double>(sample) * pings[ping].range_m / static_cast<double>(samples);
  }
};

/// A number that each ping has, with its name in tables. Units: metres, degrees, seconds.
struct PingColumn {
  std::string_view name;  ///< the name in a CSV track, if it has such a column
  std::string_view help;
  std::optional<double> (*value)(const RecordedPing& ping);  ///< unset: the file does not state it
};
/// All columns, in their order in tables. The span stays valid.
std::span<const PingColumn> ping_columns();

}  // namespace ensonify::engine
