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

/// What the page is sent: a row of frames, little-endian. Each begins with its kind and the bytes
/// that follow, two uint32; setting, status and gap then hold JSON, the others what is said here.
enum class FrameKind : std::uint32_t {
  setting = 1,  ///< sonars, names, palettes: what the lines after it mean
  line = 2,     ///< one line of one sonar
  status = 3,   ///< how it goes
  mesh = 4,     ///< the active mesh near the sonar
  gap = 5,      ///< lines that this page has missed
  bed = 6       ///< the seafloor's heights from above, and the track
};

Bytes json_frame(FrameKind kind, std::string_view json);
Bytes gap_frame(std::uint64_t first, std::uint64_t count);

/// A level over that of mid-brightness as it is sent: 0 for none, else 256 a decibel, 32768 for 0
/// dB.
std::uint16_t level_number(float level);

/// A line: uint64 its number; uint32 ping, sonar, columns, flags (bit 0: lost); float32 x, y,
/// z (local metres), heading, pitch, roll (radians), altitude (NaN over a hole), time (s); int32
/// first bin with an echo, port and starboard; then by column uint16 levels, uint8 brightness (as
/// the run's picture has it, before its palette), uint8 region, uint8 class (255: that or beyond);
/// a pad to 4 bytes; uint32 n and n places of 3 float32 that the rays of the ping ended at.
/// `brightness` is a picture of the row in grey; `row` a waterfall of that row alone.
std::shared_ptr<LiveLine> make_line(const Waterfall& row, const Renderer& renderer,
                                    const Picture& brightness, std::uint64_t ping,
                                    std::size_t sonar, std::uint64_t number);

/// Faces near a place: uint32 faces; float32 x, y, z (local metres), metres a step; then for each
/// face nine int16 steps from there, corner by corner, and a uint16, 1 for exact faces.
struct MeshPatch {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double step_m = 0.01;
  std::vector<std::int16_t> corners;
  std::vector<std::uint16_t> exact;
};
Bytes mesh_frame(const MeshPatch& patch);

/// Heights over an even grid: uint32 columns, rows; float32 west, south, east, north (of the outer
/// points); the heights row by row from the south, NaN over holes; uint32 n and n places of 2
/// float32 along the track.
struct BedMap {
  std::size_t columns = 0, rows = 0;
  Eigen::Vector2f lowest, highest;
  std::vector<float> heights_m;
  std::vector<Eigen::Vector2f> track;
};
Bytes bed_frame(const BedMap& map);

}  // namespace ensonify::engine
