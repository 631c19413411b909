#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>

namespace ensonify::engine {

/// The frame of a track's positions. The origin of local metres is the middle of the seabed.
struct LocalFrame {
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  bool has_world = false;      ///< whether the origin belongs to the world of a survey or a mesh
  int utm_zone = 0;            ///< UTM zone of this world, negative in the south; 0: unknown
  std::string reference = {};  ///< coordinate reference system of this world as WKT; empty: unknown
  bool is_on_earth() const { return utm_zone != 0 || !reference.empty(); }
};

/// Reads a recorded track from CSV (see CsvTable), one pose per row, with the columns
/// - `t_s`, or `time_s`, or `utc_s`: ascending;
/// - `x_m,y_m` local, `easting_m,northing_m` of the seabed's world, or `lat_deg,lon_deg` (WGS 84):
///   the first pair that the file has;
/// - `z_m`, height above the sea surface, or `depth_m` below it; `altitude_m` over the bed;
/// - `roll_deg,pitch_deg`, 0 if they are missing, and `heading_deg`, in a file with latitudes from
///   true north, otherwise from the y axis.
///
/// Also reads an XTF or JSF recording: the navigation of its pings (RecordedPing), with `utc_s`,
/// and the headings of choose_headings(). Pings without a time or a place, and pings whose time is
/// not later than that of all earlier pings, are left out, with a warning. If some of the other
/// pings lack a height or an angle, it is interpolated between the pings that have it. If most
/// pings lack it, it is not used. In both cases there is a warning. There are also the warnings of
/// the recording, and a warning for each column that is not listed here but whose name resembles a
/// height or an angle. In messages about a recording, the number after the file's name is the
/// ping's.
///
/// Latitudes and longitudes are projected onto the seabed's map if its UTM zone or coordinate
/// reference system is known. Otherwise, if the track options have an origin, they are projected
/// onto the tangent plane there, which touches at the seabed's middle. Otherwise, over a generated
/// seabed, they are projected onto the tangent plane at the middle of the track's extent. Then all
/// positions are moved by middle_east_m and middle_north_m. Throws SceneError with `file:line: what
/// is wrong, what was expected`.
NavigationLog read_track(const TrackOptions& track, const LocalFrame& frame);

/// Reads the track from a text; `name` replaces the file's name in messages.
NavigationLog parse_track(std::string_view text, std::string_view name, const TrackOptions& track,
                          const LocalFrame& frame);

}  // namespace ensonify::engine
