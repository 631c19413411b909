#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/sonar/vehicle/motion_options.h>

namespace ensonify::engine {

/// Where a recorded sonar was at each ping, and how it moved. Each list has one value per ping;
/// values that some pings lack are interpolated.
struct VehiclePath {
  std::vector<double> t_s;         ///< ascending
  std::vector<double> x_m, y_m;    ///< smoothed, relative to the middle of the track's bounds
  std::vector<double> altitude_m;  ///< from the samples if they show the bed, else as stated
  /// Empty if not recorded; then the course is used as the heading.
  std::vector<double> roll_rad, pitch_rad, heading_rad;
  std::string heading_instead;            ///< as ChosenHeadings::instead
  std::optional<GeographicPlace> origin;  ///< the place where x_m = y_m = 0
  double bed_depth_m = 0.0;               ///< below the sea surface; the bed is assumed to be level
  double ping_interval_s = 0.0;           ///< mean, without pauses
  double speed_mps = 0.0;                 ///< along the smoothed track, without pauses
  Evidence time, place, attitude, depth, altitude;
};

/// Finds the bottom line (first_bed_echoes_m()), and takes everything else from the navigation.
/// Throws RecordingError for a line without a bottom line and without altitudes. With a pitch p,
/// the range of the first echo of a level bed is altitude / cos(p).
VehiclePath vehicle_path(const LineWithBed& line);

/// The range of the first echo of the bed, by ping: find_bed() of both sides, smoothed. If the
/// sides differ much, the nearer echo is assumed to come from something in the water, and the
/// farther one is used. Echoes that differ much from those of neighbouring pings are left out.
/// Empty if most pings have no echo of the bed.
std::vector<double> first_bed_echoes_m(const LineWithBed& line);

/// Whether pings have several rows, one after another: the file states their beams, or many rows
/// have the same time as the row before while times have fractions of a second.
bool has_several_beams(const RecordedLine& line);

/// The direction in which the vehicle moves at a ping, clockwise from north.
double course_rad(const VehiclePath& path, std::size_t ping);
/// The heading of a ping; the course if headings were not recorded.
double heading_rad(const VehiclePath& path, std::size_t ping);

/// Whether the recording of a ping begins behind the nearest bed. Then the edge that find_bed()
/// finds is the first recorded sample.
bool begins_behind_edge(const RecordedPing& ping, std::size_t edge);
/// The sample at which the nearest bed lies: the edge, or, if the recording begins behind it, the
/// sample of the ping's altitude.
double nearest_bed(const RecordedLine& line, std::size_t ping, std::size_t edge);

/// The periodic part of a series whose values are `interval_s` apart: its deviations from its mean
/// over 10 s. The period is the mean time between upward crossings of zero. The mean square is the
/// median over windows of 30 s, so that turns between the legs of a survey do not count.
Oscillation oscillation_of(double interval_s, const std::vector<double>& values);

/// A path with only the pings `indices`.
VehiclePath some_pings(const VehiclePath& path, const std::vector<std::size_t>& indices);

}  // namespace ensonify::engine
