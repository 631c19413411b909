#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/live/line_ring.h>

namespace ensonify::engine {

/// The page receives a sequence of little-endian frames. A frame begins with two uint32: its kind
/// and the number of bytes that follow. The content of setting, status and gap is JSON; the others
/// are described at the functions below.
enum class FrameKind : std::uint32_t {
  setting = 1,  ///< sonars, names, palettes: needed to read the lines after it
  line = 2,     ///< one line of one sonar
  status = 3,   ///< the session's progress
  mesh = 4,     ///< the active mesh near the sonar
  gap = 5,      ///< lines that this page has missed
  bed = 6       ///< a map of the seafloor's heights, and the track
};

Bytes json_frame(FrameKind kind, std::string_view json);
Bytes gap_frame(std::uint64_t first, std::uint64_t count);

/// The number that stands in a frame for an intensity: 32768 for mid-brightness, and 256 per dB
/// above or below; 0: no echo.
std::uint16_t level_number(float level);

/// A line of the waterfall, in this order:
///
/// | values     | type       | what |
/// | 1          | uint64     | the number of the line |
/// | 4          | uint32     | ping, sonar, columns, flags (bit 0: the ping is lost) |
/// | 3          | float32    | place of the vehicle, local metres |
/// | 3          | float32    | heading, pitch and roll of the vehicle, radians |
/// | 2          | float32    | altitude of the vehicle, metres (NaN over a hole); time, seconds |
/// | 2          | int32      | the first bin with an echo, port and starboard; -1: none |
/// | 1 a column | uint16     | level, see level_number() |
/// | 1 a column | uint8      | brightness, as in the run's picture before its palette |
/// | 1 a column | uint8      | region |
/// | 1 a column | uint8      | class; 255: 255 or more |
/// | 0 to 3     | uint8      | padding to a multiple of 4 bytes |
/// | 1          | uint32     | the number of the points that follow |
/// | 3 a point  | float32    | places where rays of the ping end, local metres |
/// | 5          | float64    | place of the sonar, its heading, its height over the bed |
///
/// Columns are in slant range, as in LineLayout. From the height over the bed the page makes a
/// picture in ground range (picture_columns.h). `row` is a waterfall with only this row, and
/// `brightness` is its picture in grey.
std::shared_ptr<LiveLine> make_line(const Waterfall& row, const Renderer& renderer,
                                    const Picture& brightness, std::uint64_t ping,
                                    std::size_t sonar, std::uint64_t number);

/// Faces near a point, in this order:
///
/// | values   | type    | what |
/// | 1        | uint32  | the number of faces |
/// | 3        | float32 | the point, local metres |
/// | 1        | float32 | metres of a step |
/// | 9 a face | int16   | the three corners, in steps from the point |
/// | 1 a face | uint16  | 1: an exact face; 0: another one |
struct MeshPatch {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double step_m = 0.01;
  std::vector<std::int16_t> corners;
  std::vector<std::uint16_t> exact;
};
Bytes mesh_frame(const MeshPatch& patch);

/// Heights on a regular grid, in this order:
///
/// | values    | type    | what |
/// | 2         | uint32  | columns, rows |
/// | 4         | float32 | west, south, east and north of the outer points, local metres |
/// | 1 a point | float32 | heights, row by row from the south; NaN over holes |
/// | 1         | uint32  | the number of the points that follow |
/// | 2 a point | float32 | places along the track, local metres |
struct BedMap {
  std::size_t columns = 0, rows = 0;
  Eigen::Vector2f lowest, highest;
  std::vector<float> heights_m;
  std::vector<Eigen::Vector2f> track;
};
Bytes bed_frame(const BedMap& map);

}  // namespace ensonify::engine
