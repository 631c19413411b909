#include <cmath>
#include <cstdint>

#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/recording/formats.h>
#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/packets.h>
#include <ensonify/engine/recording/recording_bytes.h>
#include <ensonify/engine/units.h>
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

/// Bits of the field that states which others are valid.
enum Valid : unsigned {
  position = 1u << 0,
  speed = 1u << 2,
  heading = 1u << 3,
  pitch_roll = 1u << 5,
  altitude = 1u << 6,
  depth = 1u << 9
};

/// Adds bits 16 to 19 to a value; the word at offset 16 has those of three values.
std::uint32_t with_more_bits(const RecordingBytes& header, std::size_t offset, int shift) {
  const std::uint32_t more = header.at<std::uint16_t>(16) >> shift & 0xfu;
  return more << 16 | header.at<std::uint16_t>(offset);
}

void set_place(const RecordingBytes& header, RecordedPing& ping) {
  const double x = header.at<std::int32_t>(80), y = header.at<std::int32_t>(84);
  constexpr double unit = degree / 60.0 * 1e-4;  // 1e-4 arc minutes
  switch (header.at<std::int16_t>(88)) {
    case 1: ping.place_m = Eigen::Vector2d(1e-3 * x, 1e-3 * y); break;  // millimetres
    case 2:
      if (std::abs(y * unit) <= 90.0 * degree && std::abs(x * unit) <= 360.0 * degree)
        ping.place = GeographicPlace{y * unit, x * unit};
      break;
    case 3: ping.place_m = Eigen::Vector2d(0.1 * x, 0.1 * y); break;    // decimetres
    case 4: ping.place_m = Eigen::Vector2d(0.01 * x, 0.01 * y); break;  // centimetres
    default: break;
  }
}

RecordedPing ping_of(const RecordingBytes& header) {
  RecordedPing ping{.number = header.at<std::uint32_t>(8)};
  const double seconds = header.at<std::int32_t>(0);
  const double in_day_s = 1e-3 * header.at<std::uint32_t>(200);
  if (seconds > 0.0) {  // the milliseconds of the day have the fraction
    const double fraction_s = in_day_s - std::floor(in_day_s);
    ping.t_s = seconds + fraction_s;
  }
  const unsigned valid = header.at<std::uint16_t>(30);
  if (valid & position) set_place(header, ping);
  if (valid & heading) ping.heading_rad = header.at<std::uint16_t>(172) * 0.01 * degree;
  constexpr double turn = 180.0 / 32768.0 * degree;
  if (valid & pitch_roll) {
    ping.pitch_rad = header.at<std::int16_t>(174) * turn;
    ping.roll_rad = header.at<std::int16_t>(176) * turn;
  }
  if (valid & depth) ping.depth_m = 1e-3 * header.at<std::int32_t>(136);
  if (valid & altitude) ping.altitude_m = 1e-3 * header.at<std::int32_t>(144);
  if (valid & speed)
    ping.speed_mps = knot_mps * (0.1 * header.at<std::int16_t>(194) +
                                 0.01 * (header.at<std::uint16_t>(20) & 0xf));
  return ping;
}

/// Data formats: one value per sample, or a real and an imaginary one.
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

void read_message(const RecordingBytes& message, LineBuilder& lines) {
  const int subsystem = message.at<std::uint8_t>(7);
  constexpr int sonar_data = 80, first_sidescan = 20, last_sidescan = 39;
  if (message.at<std::uint16_t>(4) != sonar_data || subsystem < first_sidescan ||
      subsystem > last_sidescan || message.size() < jsf_message_header + jsf_sonar_header)
    return;
  const RecordingBytes header = message.part(jsf_message_header, jsf_sonar_header);
  std::vector<float> samples =
      samples_of(header, message.part(jsf_message_header + jsf_sonar_header));
  if (samples.empty()) return;
  RecordedLine& line = lines.line(subsystem);
  if (line.pings.empty()) set_facts(header, line);
  RecordedPing ping = ping_of(header);
  // The starting depth, or window offset, in samples.
  constexpr std::size_t longest_offset = 4;  // times what was recorded; beyond, it is another value
  const std::size_t offset = header.at<std::uint32_t>(4);
  if (offset <= longest_offset * samples.size()) {
    ping.unrecorded = offset;
    samples.insert(samples.begin(), offset, 0.0f);
  }
  // The fallback is what EdgeTech's own programs assume.
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
  LineBuilder lines("JSF");
  over_packets(
      file, 0, &message_size, [&](const RecordingBytes& message) { read_message(message, lines); },
      lines);
  return lines.finish(name);
}

}  // namespace ensonify::engine
