#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>

namespace ensonify::engine {

/// The frame of a track's positions: local metres have their origin at the seabed's middle.
struct LocalFrame {
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  bool has_world = false;      ///< whether the origin is in a survey's or a mesh's world
  int utm_zone = 0;            ///< of that world, southern ones negative; 0: unknown
  std::string reference = {};  ///< of that world, as WKT; empty: unknown
  bool is_on_earth() const { return utm_zone != 0 || !reference.empty(); }
};

/// Reads a recorded track from CSV (see CsvTable): one pose per row, from the columns
/// - `t_s`, or `time_s`, or `utc_s`: ascending;
/// - `x_m,y_m` local, `easting_m,northing_m` of the seabed's world, or `lat_deg,lon_deg` (WGS 84):
///   the first of these that the file has;
/// - `z_m`, height above the sea surface, or `depth_m` below it; `altitude_m` over the bed;
/// - `roll_deg,pitch_deg`, 0 where they are missing, and `heading_deg`, from true north in a file
///   with latitudes, else from the y axis.
///
/// Or an XTF or JSF recording: the navigation of its pings (RecordedPing), with `utc_s`, and the
/// headings of choose_headings(). Pings without a time or a place, or whose time is not after those
/// of all earlier pings, are left out, with a warning. A height
/// or an angle that some of the other pings lack is interpolated between those that have it; it is
/// not used if most lack it. Warnings are those of the recording, one for each such column, and one
/// for each column whose name resembles a height or an angle but is not listed here. In messages
/// about a recording the number after the file's name is the ping's.
///
/// Latitudes and longitudes are projected onto the seabed's map, if its UTM zone or coordinate
/// reference system is known; else onto the tangent plane about the origin of the track options, if
/// they have one, which lies at the seabed's middle; else, over a generated seabed, onto the
/// tangent plane about the middle of the track's extent. Then all positions are moved by
/// middle_east_m and middle_north_m. Throws SceneError with `file:line: what is wrong, what was
/// expected`.
NavigationLog read_track(const TrackOptions& track, const LocalFrame& frame);

/// The same from text; `name` stands for the file in messages.
NavigationLog parse_track(std::string_view text, std::string_view name, const TrackOptions& track,
                          const LocalFrame& frame);

}  // namespace ensonify::engine
