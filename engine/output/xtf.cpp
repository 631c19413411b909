#include <ensonify/engine/output/xtf.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <ensonify/engine/output/packed_bytes.h>

namespace ensonify::engine {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double knot_mps = 1852.0 / 3600.0;
constexpr std::size_t file_header = 1024, channel_info = 128, ping_header = 256,
                      channel_header = 64, packet_multiple = 64;

float as_float(double value) { return static_cast<float>(value); }

/// Rounded and clamped to a field of 16 bits.
std::uint16_t as_word(double value) {
  return static_cast<std::uint16_t>(
      std::lround(std::clamp(value, 0.0, double(std::numeric_limits<std::uint16_t>::max()))));
}

void add_file_header(PackedBytes& bytes, const Recording& recording) {
  bytes.begin(file_header);
  bytes.put<std::uint8_t>(0, 123);
  bytes.put<std::uint8_t>(1, 1);
  bytes.text(2, 8, "ensonify");
  bytes.text(10, 8, ENSONIFY_VERSION);
  bytes.text(18, 16, recording.name);
  bytes.text(36, 64, "ensonify " ENSONIFY_VERSION "; place and attitude are the sonar's own");
  bytes.put<std::uint16_t>(34, 0);  // sonar type: not in the list
  bytes.text(100, 64, recording.name + ".xtf");
  bytes.put<std::uint16_t>(164, 3);  // positions are latitudes and longitudes
  bytes.put<std::uint16_t>(166, 2);  // sonar channels
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t at = 256 + channel_info * k;
    bytes.put<std::uint8_t>(at, k == 0 ? 1 : 2);  // port, starboard
    bytes.put<std::uint8_t>(at + 1, static_cast<std::uint8_t>(k));
    bytes.put<std::uint16_t>(at + 2, 1);  // slant range
    bytes.put<std::uint16_t>(at + 4, 1);  // unipolar
    bytes.put<std::uint16_t>(at + 6, 2);  // bytes per sample
    bytes.put<std::uint32_t>(at + 8, static_cast<std::uint32_t>(recording.bins));
    bytes.text(at + 12, 16, k == 0 ? "port" : "starboard");
    bytes.put<float>(at + 28, 5.0f);  // volts
    bytes.put<float>(at + 32, as_float(recording.frequency_hz / 1000.0));
    bytes.put<float>(at + 36, as_float(recording.beamwidth_rad / degree));
    bytes.put<float>(at + 40, as_float(recording.tilt_rad[k] / degree));
    bytes.put<float>(at + 44, as_float(recording.vertical_beamwidth_rad / degree));
    bytes.put<std::uint8_t>(at + 74, 3);  // unsigned, 16 bits
  }
}

void put_time(PackedBytes& bytes, std::int64_t unix_ms) {
  const CalendarTime time = calendar_time(unix_ms);
  bytes.put<std::uint16_t>(14, static_cast<std::uint16_t>(time.year));
  int at = 16;
  for (const int value : {time.month, time.day, time.hour, time.minute, time.second, time.ms / 10})
    bytes.put<std::uint8_t>(static_cast<std::size_t>(at++), static_cast<std::uint8_t>(value));
  bytes.put<std::uint16_t>(22, static_cast<std::uint16_t>(time.day_of_year));
  bytes.put<std::uint32_t>(224, static_cast<std::uint32_t>(time.ms_of_day));
}

/// Heading in degrees. North is 360, because some readers take an attitude of zeros as missing.
float heading_deg(double heading_rad) {
  const float degrees = as_float(heading_rad / degree);
  return degrees == 0.0f ? 360.0f : degrees;
}

void add_ping(PackedBytes& bytes, const Recording& recording, const NavPing& ping) {
  const std::size_t side_bytes = channel_header + 2 * recording.bins;
  const std::size_t whole = ping_header + 2 * side_bytes;
  const std::size_t padded = (whole + packet_multiple - 1) / packet_multiple * packet_multiple;
  bytes.begin(padded);
  bytes.put<std::uint16_t>(0, 0xFACE);
  bytes.put<std::uint8_t>(2, 0);   // sonar
  bytes.put<std::uint16_t>(4, 2);  // channels to follow
  bytes.put<std::uint32_t>(10, static_cast<std::uint32_t>(padded));
  put_time(bytes, ping.unix_ms);
  bytes.put<std::uint32_t>(28, static_cast<std::uint32_t>(ping.number));
  bytes.put<float>(32, as_float(0.5 * recording.sound_speed_mps));
  bytes.put<float>(72, as_float(recording.sound_speed_mps));
  bytes.put<float>(152, as_float(ping.speed_mps / knot_mps));
  bytes.put<double>(160, ping.place.latitude_rad / degree);
  bytes.put<double>(168, ping.place.longitude_rad / degree);
  bytes.put<float>(192, as_float(ping.depth_m));
  bytes.put<float>(196, as_float(ping.altitude_m));
  bytes.put<float>(204, as_float(ping.pitch_rad / degree));
  bytes.put<float>(208, as_float(ping.roll_rad / degree));
  bytes.put<float>(212, heading_deg(ping.heading_rad));
  const double two_way_s = 2.0 * recording.range_m / recording.sound_speed_mps;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t at = ping_header + k * side_bytes;
    bytes.put<std::uint16_t>(at, static_cast<std::uint16_t>(k));
    bytes.put<float>(at + 4, as_float(recording.range_m));
    bytes.put<float>(at + 16, as_float(two_way_s));
    bytes.put<float>(at + 20, as_float(two_way_s));
    bytes.put<std::uint16_t>(at + 24, 4);  // time-varied gain was applied
    bytes.put<std::uint16_t>(at + 26, as_word(recording.frequency_hz / 1000.0));
    bytes.put<std::uint16_t>(at + 28, as_word(recording.near_full_scale_db));
    bytes.put<std::uint16_t>(at + 30, as_word(recording.far_full_scale_db));
    bytes.put<std::uint16_t>(at + 32, as_word(std::ceil(recording.bandwidth_hz / 1000.0)));
    bytes.put<std::uint32_t>(at + 42, static_cast<std::uint32_t>(recording.bins));
    bytes.put<float>(at + 54, as_float(ping.speed_mps * ping.interval_s * 100.0));  // cm per ping
    bytes.samples(at + channel_header,
                  recording.side(ping.row, k == 0 ? Side::port : Side::starboard));
  }
}

}  // namespace

std::vector<std::byte> encode_xtf(const Recording& recording) {
  std::vector<std::byte> file;
  PackedBytes bytes(file);
  add_file_header(bytes, recording);
  for (const NavPing& ping : recording.pings) add_ping(bytes, recording, ping);
  return file;
}

}  // namespace ensonify::engine
