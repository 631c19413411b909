#pragma once

#include <cstdint>
#include <span>
#include <string>
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
  bed = 6       ///< the seafloor's heights from above, and the track
};

Bytes json_frame(FrameKind kind, std::string_view json);
Bytes gap_frame(std::uint64_t first, std::uint64_t count);

/// An intensity relative to mid-brightness in a frame's units: 256 per dB, 32768 for 0 dB; 0: no
/// echo.
std::uint16_t level_number(float level);

/// A line: uint64 its number; uint32 ping, sonar, columns, flags (bit 0: lost); float32 x, y, z
/// (local metres), heading, pitch, roll (radians), altitude (NaN over a hole), time (s), all of the
/// vehicle; int32 first bin with an echo, port and starboard; then arrays by column, which is by
/// slant range: uint16 levels, uint8 brightness (as in the run's picture, before its palette),
/// uint8 region, uint8 class (255: 255 or more); padding to 4 bytes; uint32 n and n points of 3
/// float32 where rays of the ping end; float64 x, y, z, heading of the sonar, and its height over
/// the bed, by which a picture in ground range is made (picture_columns.h).
/// `row` is a waterfall with this row only, `brightness` its picture in grey.
std::shared_ptr<LiveLine> make_line(const Waterfall& row, const Renderer& renderer,
                                    const Picture& brightness, std::uint64_t ping,
                                    std::size_t sonar, std::uint64_t number);

/// Faces near a point: uint32 number of faces; float32 x, y, z of the point (local metres), metres
/// per step; nine int16 per face, its corners in steps from the point; then one uint16 per face, 1
/// for exact faces.
struct MeshPatch {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double step_m = 0.01;
  std::vector<std::int16_t> corners;
  std::vector<std::uint16_t> exact;
};
Bytes mesh_frame(const MeshPatch& patch);

/// Heights on a regular grid: uint32 columns, rows; float32 west, south, east, north (of the outer
/// points); float32 heights row by row from the south, NaN over holes; uint32 n and n points of 2
/// float32 along the track.
struct BedMap {
  std::size_t columns = 0, rows = 0;
  Eigen::Vector2f lowest, highest;
  std::vector<float> heights_m;
  std::vector<Eigen::Vector2f> track;
};
Bytes bed_frame(const BedMap& map);

}  // namespace ensonify::engine
