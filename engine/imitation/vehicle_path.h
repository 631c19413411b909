#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/evidence.h>
#include <ensonify/engine/sonar/vehicle/motion_options.h>

namespace ensonify::engine {

/// Where a recorded sonar was at each ping, and how it moved. One value per ping; what is missing
/// in some pings is interpolated.
struct VehiclePath {
  std::vector<double> t_s;         ///< ascending
  std::vector<double> x_m, y_m;    ///< east and north of the middle of the track's box, smoothed
  std::vector<double> altitude_m;  ///< from the samples if they show the bed, else as stated
  /// Empty: not recorded; the heading is then the course.
  std::vector<double> roll_rad, pitch_rad, heading_rad;
  std::string heading_instead;            ///< as ChosenHeadings::instead
  std::optional<GeographicPlace> origin;  ///< where x_m = y_m = 0
  double bed_depth_m = 0.0;               ///< below the sea surface, of a bed taken as level
  double ping_interval_s = 0.0;           ///< mean, without pauses
  double speed_mps = 0.0;                 ///< along the smoothed track, without pauses
  Evidence time, place, attitude, depth, altitude;
};

/// Finds the bottom line (first_bed_echoes_m()) and takes the rest from the navigation. Throws
/// RecordingError for a line without a bottom line or altitudes. A sonar that is pitched by p meets
/// a level bed at altitude / cos(p).
VehiclePath vehicle_path(const LineWithBed& line);

/// By ping, the range of the first echo of the bed: find_bed() of both sides, smoothed. Where the
/// sides differ much, the nearer echo is taken to be from something in the water. Echoes far from
/// those of the pings around are left out. Empty if most pings have none.
std::vector<double> first_bed_echoes_m(const LineWithBed& line);

/// Whether a ping has several rows, one after another: the file states their beams, or many rows
/// have the same time as the row before, fractions of a second included.
bool has_several_beams(const RecordedLine& line);

/// The direction in which the vehicle moves about a ping, clockwise from north.
double course_rad(const VehiclePath& path, std::size_t ping);
/// The heading of a ping; without one, the course.
double heading_rad(const VehiclePath& path, std::size_t ping);

/// Whether the recording of a ping begins behind the nearest bed, whose edge is then the first
/// recorded sample.
bool begins_behind_edge(const RecordedPing& ping, std::size_t edge);
/// Where the nearest bed lies, in samples: at its edge, or as the ping's altitude has it if the
/// recording begins behind it.
double nearest_bed(const RecordedLine& line, std::size_t ping, std::size_t edge);

/// The periodic part of a series with this time between its values: its deviations from its mean
/// over 10 s. The period is the time between upward crossings of zero, the mean square the median
/// over windows of 30 s, so that turns between the legs of a survey do not count.
Oscillation oscillation_of(double interval_s, const std::vector<double>& values);

/// The pings `indices` of a path, as one.
VehiclePath some_pings(const VehiclePath& path, const std::vector<std::size_t>& indices);

}  // namespace ensonify::engine
