#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/recording/formats.h>
#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/packets.h>
#include <ensonify/engine/recording/places.h>
#include <ensonify/engine/recording/recording_bytes.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {
namespace {

constexpr std::uint16_t jsf_magic = 0x1601;

/// The size that a message at the beginning of these bytes states; 0: no message begins there.
std::size_t message_size(const RecordingBytes& bytes) {
  const auto data_bytes = bytes.at<std::int32_t>(12);
  return bytes.at<std::uint16_t>(0) == jsf_magic && data_bytes >= 0
             ? jsf_message_header + static_cast<std::size_t>(data_bytes)
             : 0;
}

constexpr std::size_t validity_flags = 30;

/// Bits of the field that states which other fields are valid.
enum Valid : unsigned {
  position = 1u << 0,
  speed = 1u << 2,
  heading = 1u << 3,
  pitch_roll = 1u << 5,
  altitude = 1u << 6,
  depth = 1u << 9
};

/// The values of the navigation and their names in messages.
constexpr std::array<std::pair<Valid, std::string_view>, 6> navigation{{{position, "place"},
                                                                        {heading, "heading"},
                                                                        {pitch_roll, "pitch, roll"},
                                                                        {depth, "depth"},
                                                                        {altitude, "altitude"},
                                                                        {speed, "speed"}}};

/// The value of 20 bits whose lower 16 bits are at `offset`. The word at offset 16 has the upper
/// four bits of three values; those of this value begin at bit `shift`.
std::uint32_t with_more_bits(const RecordingBytes& header, std::size_t offset, int shift) {
  const std::uint32_t more = header.at<std::uint16_t>(16) >> shift & 0xfu;
  return more << 16 | header.at<std::uint16_t>(offset);
}

void set_place(const RecordingBytes& header, RecordedPing& ping, LineBuilder& lines) {
  const double x = header.at<std::int32_t>(80), y = header.at<std::int32_t>(84);
  constexpr double unit_deg = 1e-4 / 60.0;  // 1e-4 arc minutes
  switch (header.at<std::int16_t>(88)) {
    case 1: ping.place_m = Eigen::Vector2d(1e-3 * x, 1e-3 * y); break;  // millimetres
    case 2:
      if (is_on_earth(y * unit_deg, x * unit_deg))
        ping.place = GeographicPlace{y * unit_deg * degree, x * unit_deg * degree};
      else
        lines.impossible(std::string(impossible_place), ping.number,
                         place_text(y * unit_deg, x * unit_deg));
      break;
    case 3: ping.place_m = Eigen::Vector2d(0.1 * x, 0.1 * y); break;    // decimetres
    case 4: ping.place_m = Eigen::Vector2d(0.01 * x, 0.01 * y); break;  // centimetres
    default: break;
  }
}

/// The field has hundredths of a degree: from 0 to 360 degrees, or in old files from -180 to 180.
void set_heading(const RecordingBytes& header, RecordedPing& ping, LineBuilder& lines) {
  const double unsigned_deg = 0.01 * header.at<std::uint16_t>(172),
               signed_deg = 0.01 * header.at<std::int16_t>(172);
  if (unsigned_deg <= 360.0)
    ping.heading_rad = unsigned_deg * degree;
  else if (signed_deg >= -180.0)
    ping.heading_rad = signed_deg * degree;
  else
    lines.impossible("heading; it is left out", ping.number,
                     fmt::format("{:g} degrees", unsigned_deg));
}

double speed_mps(const RecordingBytes& header) {
  return knot_mps *
         (0.1 * header.at<std::int16_t>(194) + 0.01 * (header.at<std::uint16_t>(20) & 0xf));
}

/// Bits of Valid for a file without validity flags: the values that are possible and not 0.
unsigned plausible(const RecordingBytes& header) {
  const auto is_within = [&](std::size_t offset, double largest_m) {
    const double value_m = 1e-3 * header.at<std::int32_t>(offset);
    return value_m > 0.0 && value_m <= largest_m;
  };
  constexpr double deepest_m = 11e3, highest_m = 1e3, fastest_mps = 15.0;
  constexpr int max_pitch = 32768 / 3;  // 60 degrees
  unsigned found = 0;
  if (header.at<std::int32_t>(80) != 0 || header.at<std::int32_t>(84) != 0) found |= position;
  const int pitch = header.at<std::int16_t>(174), roll = header.at<std::int16_t>(176);
  const bool has_attitude = pitch != 0 || roll != 0 || header.at<std::int16_t>(172) != 0;
  if (has_attitude) found |= heading;
  if (has_attitude && std::abs(pitch) <= max_pitch) found |= pitch_roll;
  if (is_within(136, deepest_m)) found |= depth;
  if (is_within(144, highest_m)) found |= altitude;
  if (const double mps = speed_mps(header); mps > 0.0 && mps <= fastest_mps) found |= speed;
  return found;
}

/// The ping's time since 1970. Headers before protocol version 8 have only a date and time of day.
std::optional<double> jsf_time_s(const RecordingBytes& header) {
  constexpr double day_s = 86400.0;
  const double seconds = header.at<std::int32_t>(0),
               in_day_s = 1e-3 * header.at<std::uint32_t>(200);
  // The fraction of the second is in the milliseconds of the day.
  if (seconds > 0.0) return seconds + in_day_s - std::floor(in_day_s);
  const int year = header.at<std::int16_t>(156), day = header.at<std::int16_t>(158);
  if (year < 1970 || day < 1 || day > 366) return std::nullopt;
  const std::chrono::sys_days new_year(std::chrono::year(year) / 1 / 1);
  const double begin_s =
      day_s * (static_cast<double>(new_year.time_since_epoch().count()) + day - 1);
  if (in_day_s > 0.0 && in_day_s < day_s) return begin_s + in_day_s;
  return begin_s + 3600.0 * header.at<std::int16_t>(160) + 60.0 * header.at<std::int16_t>(162) +
         header.at<std::int16_t>(164);
}

/// The ping that a header states, without samples. `valid`: bits of Valid for the values to read.
RecordedPing ping_of(const RecordingBytes& header, unsigned valid, LineBuilder& lines) {
  RecordedPing ping{.number = header.at<std::uint32_t>(8), .t_s = jsf_time_s(header)};
  if (valid & position) set_place(header, ping, lines);
  if (valid & heading) set_heading(header, ping, lines);
  constexpr double turn = 180.0 / 32768.0 * degree;
  if (valid & pitch_roll) {
    ping.pitch_rad = header.at<std::int16_t>(174) * turn;
    ping.roll_rad = header.at<std::int16_t>(176) * turn;
  }
  if (valid & depth) ping.depth_m = 1e-3 * header.at<std::int32_t>(136);
  if (valid & altitude) ping.altitude_m = 1e-3 * header.at<std::int32_t>(144);
  if (valid & speed) ping.speed_mps = speed_mps(header);
  return ping;
}

/// Data formats: one value per sample, or a real and an imaginary value.
enum DataFormat : int { envelope = 0, analytic = 1 };

std::vector<float> samples_of(const RecordingBytes& header, const RecordingBytes& data) {
  const int format = header.at<std::int16_t>(34);
  if (format != envelope && format != analytic) return {};
  const std::size_t values = format == analytic ? 2 : 1;
  const std::size_t samples = with_more_bits(header, 114, 8);
  if (samples > data.size() / (values * sizeof(std::int16_t))) return {};
  const int weight = header.at<std::int16_t>(168);
  std::vector<float> amplitudes(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const std::size_t at = i * values * sizeof(std::int16_t);
    const float re = data.at<std::int16_t>(at);
    const float im = format == analytic ? data.at<std::int16_t>(at + sizeof(std::int16_t)) : 0.0f;
    const float magnitude = format == analytic ? std::sqrt(re * re + im * im)
                                               : static_cast<float>(data.at<std::uint16_t>(at));
    const float amplitude = std::ldexp(magnitude, -weight);
    amplitudes[i] = std::isfinite(amplitude) ? amplitude : 0.0f;
  }
  return amplitudes;
}

void set_facts(const RecordingBytes& header, RecordedLine& line) {
  const double low_hz = 10.0 * with_more_bits(header, 126, 0);
  const double high_hz = 10.0 * with_more_bits(header, 128, 4);
  line.bandwidth_hz = std::abs(high_hz - low_hz);
  line.frequency_hz = 0.5 * (low_hz + high_hz);
  line.pulse_length_s =
      1e-3 * header.at<std::uint16_t>(130) + 1e-6 * (header.at<std::uint16_t>(20) >> 4 & 0x3ff);
  const double speed_mps = header.at<float>(148);
  if (is_sound_speed(speed_mps)) line.sound_speed_mps = speed_mps;
}

constexpr int sonar_data = 80, first_sidescan = 20, last_sidescan = 39;

bool is_sidescan(const RecordingBytes& message) {
  const int subsystem = message.at<std::uint8_t>(7);
  return message.at<std::uint16_t>(4) == sonar_data && subsystem >= first_sidescan &&
         subsystem <= last_sidescan && message.size() >= jsf_message_header + jsf_sonar_header;
}

/// The kind of a message without sidescan samples, for messages about the file.
std::string kind_of(const RecordingBytes& message) {
  const int type = message.at<std::uint16_t>(4), subsystem = message.at<std::uint8_t>(7);
  if (type != sonar_data) return fmt::format("messages of type {}", type);
  constexpr int last_sub_bottom = 19, first_bathymetry = 40, last_bathymetry = 79;
  std::string_view of = "another instrument";
  if (subsystem <= last_sub_bottom) of = "a sub-bottom profiler";
  if (subsystem >= first_bathymetry && subsystem <= last_bathymetry) of = "bathymetry";
  if (subsystem >= first_sidescan && subsystem <= last_sidescan) of = "a sidescan without samples";
  return fmt::format("messages of {}, subsystem {}", of, subsystem);
}

/// Whether a file has no validity flags in any of its pings, as EdgeTech wrote files before 2008,
/// and which values were read from the file (bits of Valid).
struct NoFlags {
  bool none = true;
  unsigned read = 0;
};

void read_message(const RecordingBytes& message, NoFlags& no_flags, LineBuilder& lines) {
  constexpr int nmea_string = 2002;
  if (!is_sidescan(message)) {
    if (message.at<std::uint16_t>(4) == nmea_string)
      lines.other_navigation("messages of type 2002, NMEA");
    else
      lines.other(kind_of(message));
    return;
  }
  const int subsystem = message.at<std::uint8_t>(7);
  const RecordingBytes header = message.part(jsf_message_header, jsf_sonar_header);
  std::vector<float> samples =
      samples_of(header, message.part(jsf_message_header + jsf_sonar_header));
  if (samples.empty()) {
    lines.other(kind_of(message));
    return;
  }
  RecordedLine& line = lines.line(subsystem);
  if (line.pings.empty()) set_facts(header, line);
  const unsigned valid =
      no_flags.none ? plausible(header) : header.at<std::uint16_t>(validity_flags);
  no_flags.read |= valid;
  RecordedPing ping = ping_of(header, valid, lines);
  // The field is the starting depth (window offset) in samples. If it is more than longest_offset
  // times the recorded samples, it has another meaning.
  constexpr std::size_t longest_offset = 4;
  const std::size_t offset = header.at<std::uint32_t>(4);
  if (offset <= longest_offset * samples.size()) {
    ping.unrecorded = offset;
    samples.insert(samples.begin(), offset, 0.0f);
  }
  // Without a stated sound speed, EdgeTech's programs assume this nominal sound speed.
  const double speed_mps =
      line.sound_speed_mps > 0.0 ? line.sound_speed_mps : scatter::nominal_sound_speed_mps;
  ping.range_m =
      0.5 * speed_mps * 1e-9 * header.at<std::uint32_t>(116) * static_cast<double>(samples.size());
  lines.add(subsystem, ping, message.at<std::uint8_t>(8) == 0 ? Side::port : Side::starboard,
            std::move(samples));
}

}  // namespace

bool is_jsf(std::span<const std::byte> begin) {
  return RecordingBytes(begin).at<std::uint16_t>(0) == jsf_magic;
}

std::vector<RecordedLine> parse_jsf(std::span<const std::byte> bytes, std::string_view name) {
  const RecordingBytes file(bytes);
  const auto over_messages = [&](const auto& take, LineBuilder& lines) {
    over_packets(file, 0, &message_size, take, lines);
  };
  NoFlags no_flags;
  LineBuilder uncounted("JSF"), builder("JSF");
  over_messages(
      [&](const RecordingBytes& message) {
        if (is_sidescan(message) &&
            message.at<std::uint16_t>(jsf_message_header + validity_flags) != 0)
          no_flags.none = false;
      },
      uncounted);
  over_messages([&](const RecordingBytes& message) { read_message(message, no_flags, builder); },
                builder);
  std::vector<RecordedLine> lines = builder.finish(name);
  if (no_flags.none && no_flags.read != 0) {
    std::vector<std::string_view> read;
    for (const auto& [bit, what] : navigation)
      if (no_flags.read & bit) read.push_back(what);
    for (RecordedLine& line : lines)
      line.warnings.push_back(fmt::format(
          "{}: its pings do not state which of their values are valid, as JSF before 2008; read "
          "where it is plausible: {}",
          name, fmt::join(read, ", ")));
  }
  return lines;
}

}  // namespace ensonify::engine
