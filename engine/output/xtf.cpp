#include <ensonify/engine/output/xtf.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/packed_bytes.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t file_header = 1024, channel_info = 128, ping_header = 256,
                      channel_header = 64, packet_multiple = 64;

/// The value, rounded and clamped to 16 bits.
std::uint16_t as_word(double value) {
  return static_cast<std::uint16_t>(
      std::lround(std::clamp(value, 0.0, double(std::numeric_limits<std::uint16_t>::max()))));
}

void add_channel_info(PackedBytes& bytes, std::size_t channel, std::string_view name,
                      const Recording& recording) {
  const std::size_t side = channel % 2;  // port, starboard
  const std::size_t at = 256 + channel_info * channel;
  bytes.put<std::uint8_t>(at, 1 + side);
  bytes.put<std::uint8_t>(at + 1, channel);
  bytes.put<std::uint16_t>(at + 2, 1);  // slant range
  bytes.put<std::uint16_t>(at + 4, 1);  // unipolar
  bytes.put<std::uint16_t>(at + 6, 2);  // bytes per sample
  bytes.put<std::uint32_t>(at + 8, recording.bins);
  bytes.text(at + 12, 16, name);
  bytes.put<float>(at + 28, 5.0f);  // volts
  bytes.put<float>(at + 32, recording.frequency_hz / 1000.0);
  bytes.put<float>(at + 36, recording.beamwidth_rad / degree);
  bytes.put<float>(at + 40, recording.tilt_rad[side] / degree);
  bytes.put<float>(at + 44, recording.vertical_beamwidth_rad / degree);
  bytes.put<std::uint8_t>(at + 74, 3);  // unsigned, 16 bits
}

void add_file_header(PackedBytes& bytes, std::span<const Recording> sonars) {
  const bool alone = sonars.size() == 1;
  const std::string name = alone ? sonars.front().name : "";
  bytes.begin(file_header);
  bytes.put<std::uint8_t>(0, 123);
  bytes.put<std::uint8_t>(1, 1);
  bytes.text(2, 8, "ensonify");
  bytes.text(10, 8, program_version());
  bytes.text(18, 16, name);
  bytes.text(36, 64,
             fmt::format("ensonify {}; place and attitude are the sonar's own", program_version()));
  bytes.put<std::uint16_t>(34, 0);  // sonar type: not in the list
  bytes.text(100, 64, sonars.front().file + ".xtf");
  bytes.put<std::uint16_t>(164, 3);                  // positions are latitudes and longitudes
  bytes.put<std::uint16_t>(166, 2 * sonars.size());  // channels
  for (std::size_t channel = 0; channel < 2 * sonars.size(); ++channel) {
    const Recording& recording = sonars[channel / 2];
    add_channel_info(bytes, channel,
                     alone ? name_of(channel % 2 == 0 ? Side::port : Side::starboard)
                           : std::string_view(recording.name),
                     recording);
  }
}

void put_time(PackedBytes& bytes, std::int64_t unix_ms) {
  const CalendarTime time = calendar_time(unix_ms);
  bytes.put<std::uint16_t>(14, time.year);
  std::size_t at = 16;
  for (const int value : {time.month, time.day, time.hour, time.minute, time.second, time.ms / 10})
    bytes.put<std::uint8_t>(at++, value);
  bytes.put<std::uint16_t>(22, time.day_of_year);
  bytes.put<std::uint32_t>(224, time.ms_of_day);
}

/// Heading in degrees. North is 360, because some readers treat an attitude of zeros as missing.
float heading_deg(double heading_rad) {
  constexpr float rounding_deg = 1e-6f;
  const auto degrees = static_cast<float>(heading_rad / degree);
  return degrees < rounding_deg ? 360.0f : degrees;
}

void add_channel(PackedBytes& bytes, std::size_t at, std::size_t channel,
                 const Recording& recording, const NavPing& ping) {
  const double two_way_s = 2.0 * recording.range_m / recording.sound_speed_mps;
  const double gain_db = recording.gain_db[ping.row][channel % 2];
  const FullScale& full_scale = recording.full_scale[static_cast<std::size_t>(ping.beam)];
  const double row_m =
      ping.speed_mps * ping.interval_s / static_cast<double>(recording.full_scale.size());
  bytes.put<std::uint16_t>(at, channel);
  bytes.put<float>(at + 4, recording.range_m);
  bytes.put<float>(at + 16, two_way_s);
  bytes.put<float>(at + 20, two_way_s);
  bytes.put<std::uint16_t>(at + 24, 4);  // time-varied gain was applied
  bytes.put<std::uint16_t>(at + 26, as_word(recording.frequency_hz / 1000.0));
  bytes.put<std::uint16_t>(at + 28, as_word(full_scale.near_db - gain_db));
  bytes.put<std::uint16_t>(at + 30, as_word(full_scale.far_db - gain_db));
  bytes.put<std::uint16_t>(at + 32, as_word(std::ceil(recording.bandwidth_hz / 1000.0)));
  bytes.put<std::uint32_t>(at + 42, recording.bins);
  bytes.put<float>(at + 54, row_m * 100.0);  // cm along the track
  bytes.samples(at + channel_header,
                recording.side(ping.row, channel % 2 == 0 ? Side::port : Side::starboard));
}

/// Indices of sonars with the same navigation.
using SonarGroup = std::vector<std::size_t>;

std::vector<SonarGroup> groups_by_navigation(std::span<const Recording> sonars) {
  std::vector<SonarGroup> groups;
  for (std::size_t k = 0; k < sonars.size(); ++k) {
    const auto same = std::ranges::find_if(groups, [&](const SonarGroup& group) {
      return sonars[group.front()].pings == sonars[k].pings;
    });
    if (same == groups.end())
      groups.push_back({k});
    else
      same->push_back(k);
  }
  return groups;
}

void add_packet(PackedBytes& bytes, std::span<const Recording> sonars, const SonarGroup& group,
                std::size_t number) {
  const Recording& recording = sonars[group.front()];
  const NavPing& ping = recording.pings.at(number);
  std::size_t whole = ping_header;
  for (const std::size_t k : group) whole += 2 * (channel_header + 2 * sonars[k].bins);
  const std::size_t padded = (whole + packet_multiple - 1) / packet_multiple * packet_multiple;
  bytes.begin(padded);
  bytes.put<std::uint16_t>(0, 0xFACE);
  bytes.put<std::uint8_t>(2, 0);  // sonar
  bytes.put<std::uint8_t>(3, ping.beam);
  bytes.put<std::uint16_t>(4, 2 * group.size());  // channels to follow
  bytes.put<std::uint32_t>(10, padded);
  put_time(bytes, ping.unix_ms);
  bytes.put<std::uint32_t>(28, ping.number);
  bytes.put<float>(32, 0.5 * recording.sound_speed_mps);
  bytes.put<float>(72, recording.sound_speed_mps);
  bytes.put<float>(152, ping.speed_mps / knot_mps);
  bytes.put<double>(160, ping.place.latitude_rad / degree);
  bytes.put<double>(168, ping.place.longitude_rad / degree);
  bytes.put<float>(192, ping.depth_m);
  bytes.put<float>(196, ping.altitude_m);
  bytes.put<float>(204, ping.pitch_rad / degree);
  bytes.put<float>(208, ping.roll_rad / degree);
  bytes.put<float>(212, heading_deg(ping.heading_rad));
  std::size_t at = ping_header;
  for (const std::size_t k : group)
    for (const std::size_t side : {0u, 1u}) {
      add_channel(bytes, at, 2 * k + side, sonars[k], ping);
      at += channel_header + 2 * sonars[k].bins;
    }
}

}  // namespace

std::vector<std::byte> encode_xtf(std::span<const Recording> sonars) {
  if (sonars.empty() || sonars.size() > max_sonars_of_xtf)
    throw std::invalid_argument(fmt::format("an XTF holds 1 to {} sonars", max_sonars_of_xtf));
  std::vector<std::byte> file;
  PackedBytes bytes(file);
  add_file_header(bytes, sonars);
  const std::vector<SonarGroup> groups = groups_by_navigation(sonars);
  std::vector<std::size_t> firsts;
  for (const SonarGroup& group : groups) firsts.push_back(group.front());
  for (const auto& [group, number] : pings_by_time(sonars, firsts))
    add_packet(bytes, sonars, groups[group], number);
  return file;
}

}  // namespace ensonify::engine
