#include <ensonify/engine/recording/recorded_line.h>

#include <array>
#include <numbers>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {
namespace {

using Value = std::optional<double>;

Value degrees(Value angle_rad) {
  if (!angle_rad) return std::nullopt;
  return *angle_rad * 180.0 / std::numbers::pi;
}

Value compass(Value angle_rad) {
  const Value angle_deg = degrees(angle_rad);
  return angle_deg ? Value(compass_deg(*angle_deg)) : std::nullopt;
}

constexpr std::array columns{
    PingColumn{"utc_s", "time, seconds since 1970, UTC",
               [](const RecordedPing& ping) { return ping.t_s; }},
    PingColumn{"range_m", "slant range of the far edge of the last sample",
               [](const RecordedPing& ping) {
                 return ping.range_m > 0.0 ? Value(ping.range_m) : std::nullopt;
               }},
    PingColumn{"lat_deg", "latitude, north",
               [](const RecordedPing& ping) {
                 return ping.place ? degrees(ping.place->latitude_rad) : std::nullopt;
               }},
    PingColumn{"lon_deg", "longitude, east",
               [](const RecordedPing& ping) {
                 return ping.place ? degrees(ping.place->longitude_rad) : std::nullopt;
               }},
    PingColumn{"easting_m", "metres east on the file's own map, where it has no latitudes",
               [](const RecordedPing& ping) {
                 return ping.place_m ? Value(ping.place_m->x()) : std::nullopt;
               }},
    PingColumn{"northing_m", "metres north on that map",
               [](const RecordedPing& ping) {
                 return ping.place_m ? Value(ping.place_m->y()) : std::nullopt;
               }},
    PingColumn{"layback_m", "from the ship back to the sonar, where the places were computed by it",
               [](const RecordedPing& ping) { return ping.layback_m; }},
    PingColumn{"depth_m", "of the sonar, below the sea surface",
               [](const RecordedPing& ping) { return ping.depth_m; }},
    PingColumn{"altitude_m", "of the sonar, above the bed",
               [](const RecordedPing& ping) { return ping.altitude_m; }},
    PingColumn{"roll_deg", "starboard down",
               [](const RecordedPing& ping) { return degrees(ping.roll_rad); }},
    PingColumn{"pitch_deg", "nose up",
               [](const RecordedPing& ping) { return degrees(ping.pitch_rad); }},
    PingColumn{"heading_deg", "clockwise from north, from 0 up to 360",
               [](const RecordedPing& ping) { return compass(ping.heading_rad); }},
    PingColumn{"gyro_deg", "the ship's heading, by its gyro, from 0 up to 360",
               [](const RecordedPing& ping) { return compass(ping.gyro_rad); }},
    PingColumn{"speed_mps", "of the sonar or the ship",
               [](const RecordedPing& ping) { return ping.speed_mps; }}};

}  // namespace

std::span<const PingColumn> ping_columns() { return columns; }

}  // namespace ensonify::engine
