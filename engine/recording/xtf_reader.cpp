#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

#include <ensonify/engine/recording/byte_order.h>
#include <ensonify/engine/recording/formats.h>
#include <ensonify/engine/recording/layback.h>
#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/packets.h>
#include <ensonify/engine/recording/recording_bytes.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/units.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t file_header = 1024, first_channel_info = 256, channel_info = 128,
                      ping_header = 256, channel_header = 64;
constexpr std::uint16_t xtf_magic = 0xFACE;

enum class SampleFormat { u8, u16, i16, u32, i32, f32, unknown };

std::size_t bytes_of(SampleFormat format) {
  switch (format) {
    case SampleFormat::u8: return 1;
    case SampleFormat::u16:
    case SampleFormat::i16: return 2;
    case SampleFormat::u32:
    case SampleFormat::i32:
    case SampleFormat::f32: return 4;
    case SampleFormat::unknown: break;
  }
  return 0;
}

/// A channel as the file's header describes it.
struct Channel {
  std::string name;
  int line = 0;  ///< number of its line; -1: no sidescan
  Side side = Side::port;
  bool ground_range = false;  ///< as stated
  int format_code = 0;        ///< as in the file; 0: its number of bytes tells the format
  SampleFormat format = SampleFormat::unknown;
  std::size_t samples = 0;  ///< where a ping does not state them
  double frequency_hz = 0.0;
  double beamwidth_rad = 0.0, vertical_beamwidth_rad = 0.0, tilt_rad = 0.0;
};

/// The size that a packet at the beginning of these bytes states; 0: no packet begins there.
std::size_t packet_size(const RecordingBytes& bytes) {
  constexpr std::size_t packet_header = 14;
  const std::size_t size = bytes.at<std::uint32_t>(10);
  return bytes.at<std::uint16_t>(0) == xtf_magic && size >= packet_header ? size : 0;
}

/// An angle of CHANINFO in radians; 0 if it is no beam's.
double beam_rad(const RecordingBytes& info, std::size_t offset) {
  const double degrees = info.known<float>(offset).value_or(0.0);
  return std::abs(degrees) <= 180.0 ? degrees * degree : 0.0;
}

/// From the codes of CHANINFO: its sample format, else its bytes per sample; unipolar or bipolar.
SampleFormat sample_format(const RecordingBytes& info) {
  const bool bipolar = info.at<std::uint16_t>(4) == 0;
  switch (info.at<std::uint8_t>(74)) {
    case 2: return bipolar ? SampleFormat::i32 : SampleFormat::u32;
    case 3: return bipolar ? SampleFormat::i16 : SampleFormat::u16;
    case 5: return SampleFormat::f32;
    case 8: return SampleFormat::u8;
    case 0: break;
    default: return SampleFormat::unknown;
  }
  switch (info.at<std::uint16_t>(6)) {
    case 1: return SampleFormat::u8;
    case 2: return bipolar ? SampleFormat::i16 : SampleFormat::u16;
    case 4: return bipolar ? SampleFormat::i32 : SampleFormat::u32;
    default: return SampleFormat::unknown;
  }
}

float sample_at(const RecordingBytes& bytes, SampleFormat format, std::size_t i,
                bool high_byte_first) {
  const std::size_t width = bytes_of(format), offset = i * width;
  if (high_byte_first && width > 1) {
    std::array<std::uint8_t, 4> turned{};
    for (std::size_t k = 0; k < width; ++k)
      turned[k] = bytes.at<std::uint8_t>(offset + width - 1 - k);
    return sample_at(RecordingBytes(std::as_bytes(std::span(turned))), format, 0, false);
  }
  switch (format) {
    case SampleFormat::u8: return bytes.at<std::uint8_t>(offset);
    case SampleFormat::u16: return bytes.at<std::uint16_t>(offset);
    case SampleFormat::i16: return std::abs(static_cast<float>(bytes.at<std::int16_t>(offset)));
    case SampleFormat::u32: return static_cast<float>(bytes.at<std::uint32_t>(offset));
    case SampleFormat::i32: return std::abs(static_cast<float>(bytes.at<std::int32_t>(offset)));
    case SampleFormat::f32: break;
    case SampleFormat::unknown: return 0.0f;
  }
  return std::abs(bytes.at<float>(offset));
}

std::optional<double> time_s(const RecordingBytes& ping) {
  using namespace std::chrono;
  const year_month_day date{year(ping.at<std::uint16_t>(14)), month(ping.at<std::uint8_t>(16)),
                            day(ping.at<std::uint8_t>(17))};
  if (!date.ok()) return std::nullopt;
  const auto days = static_cast<double>(sys_days(date).time_since_epoch().count());
  return days * 86400.0 + ping.at<std::uint8_t>(18) * 3600.0 + ping.at<std::uint8_t>(19) * 60.0 +
         ping.at<std::uint8_t>(20) + ping.at<std::uint8_t>(21) * 0.01;
}

/// 0: not stated.
double sound_speed_mps(const RecordingBytes& ping) {
  const double computed = ping.at<float>(72), stated = ping.at<float>(32);
  for (const double speed_mps : {computed, stated, 2.0 * stated})
    if (is_sound_speed(speed_mps)) return speed_mps;
  return 0.0;
}

/// The places of the sensor and of the ship in a ping's header.
constexpr std::size_t sensor_place = 160, ship_place = 128;

/// The layback of a ping whose header has no place of the sonar but the ship's, or the ship's as
/// that of the sonar, too.
std::optional<double> layback_m(const RecordingBytes& header) {
  const auto same = [&](std::size_t part) {
    return header.at<double>(sensor_place + part) == header.at<double>(ship_place + part);
  };
  const bool no_sensor =
      header.at<double>(sensor_place) == 0.0 && header.at<double>(sensor_place + 8) == 0.0;
  if (!no_sensor && !(same(0) && same(8))) return std::nullopt;
  return stated_layback_m(header.at<float>(184),
                          header.at<std::uint16_t>(182) + 0.01 * header.at<std::uint8_t>(249),
                          header.known<float>(192).value_or(0.0));
}

constexpr double farthest_m = 1e8;  // no map reaches farther from its origin

RecordedPing ping_of(const RecordingBytes& header, bool geographic) {
  RecordedPing ping{.number = header.at<std::uint32_t>(28),
                    .beam = header.at<std::uint8_t>(3),  // SubChannelNumber
                    .t_s = time_s(header)};
  for (const std::size_t y_offset : {sensor_place, ship_place}) {
    const double y = header.at<double>(y_offset), x = header.at<double>(y_offset + 8);
    if ((x == 0.0 && y == 0.0) || !(std::abs(x) <= farthest_m && std::abs(y) <= farthest_m))
      continue;
    if (!geographic)
      ping.place_m = Eigen::Vector2d(x, y);
    else if (std::abs(y) <= 90.0 && std::abs(x) <= 360.0)
      ping.place = GeographicPlace{y * degree, x * degree};
    else {
      if (!ping.place_m) ping.place_m = Eigen::Vector2d(x, y);  // see take_as_metres()
      continue;
    }
    break;
  }
  if (ping.place) ping.place_m.reset();
  const auto radians = [&](std::size_t offset) -> std::optional<double> {
    const double value = header.at<float>(offset);
    if (!(std::abs(value) <= 360.0)) return std::nullopt;
    return value * degree;
  };
  if (header.known<float>(204) || header.known<float>(208) || header.known<float>(212)) {
    ping.pitch_rad = radians(204);
    ping.roll_rad = radians(208);
    ping.heading_rad = radians(212);
  }
  if (ping.place || ping.place_m) ping.layback_m = layback_m(header);
  ping.depth_m = header.known<float>(192);
  ping.altitude_m = header.known<float>(196);
  if (const auto knots = header.known<float>(152)) ping.speed_mps = *knots * knot_mps;
  return ping;
}

/// Whether positions that the file says are metres can only be longitudes and latitudes: as metres
/// the vehicle would hardly move.
bool looks_geographic(const RecordedLine& line) {
  constexpr double max_moved_m = 1.0;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(INFINITY), high = -low;
  for (const RecordedPing& ping : line.pings)
    if (ping.place_m) {
      low = low.cwiseMin(*ping.place_m);
      high = high.cwiseMax(*ping.place_m);
    }
  const double moved = (high - low).maxCoeff();
  return moved > 0.0 && moved < max_moved_m && low.x() >= -180.0 && high.x() <= 180.0 &&
         low.y() >= -90.0 && high.y() <= 90.0;
}

void take_as_degrees(RecordedLine& line, std::string_view name) {
  for (RecordedPing& ping : line.pings)
    if (ping.place_m) {
      ping.place = GeographicPlace{ping.place_m->y() * degree, ping.place_m->x() * degree};
      ping.place_m.reset();
    }
  line.warnings.push_back(
      fmt::format("{}: its header says that positions are metres, but they look like degrees; read "
                  "as longitudes and latitudes",
                  name));
}

/// Positions that cannot be degrees, of a file whose header says so, are metres if all are like
/// that, and otherwise damaged.
void take_as_metres(RecordedLine& line, std::string_view name) {
  constexpr double nearest_m = 1000.0;  // from the origin of a map
  const auto has_metres = [](const RecordedPing& ping) { return ping.place_m.has_value(); };
  if (std::ranges::none_of(line.pings, has_metres)) return;
  const bool all = std::ranges::all_of(line.pings, [](const RecordedPing& ping) {
    const double largest_m = ping.place_m ? ping.place_m->cwiseAbs().maxCoeff() : nearest_m;
    return !ping.place && largest_m >= nearest_m;
  });
  if (all)
    line.warnings.push_back(
        fmt::format("{}: its header says that positions are degrees, but they are too large; read "
                    "as metres east and north",
                    name));
  else
    for (RecordedPing& ping : line.pings) {
      ping.place_m.reset();
      if (!ping.place) ping.layback_m.reset();  // nothing to be moved back
    }
}

class XtfReader {
 public:
  explicit XtfReader(std::span<const std::byte> bytes) : file_(bytes) {
    const std::size_t channels = file_.at<std::uint16_t>(166);
    int ports = 0, starboards = 0;
    for (std::size_t k = 0; k < channels && file_.has(first_channel_info + k * channel_info, 1);
         ++k) {
      const RecordingBytes info = file_.part(first_channel_info + k * channel_info, channel_info);
      const int type = info.at<std::uint8_t>(0);  // 1: port, 2: starboard
      channels_.push_back({.name = info.text(12, 16),
                           .line = type == 1   ? ports++
                                   : type == 2 ? starboards++
                                               : -1,
                           .side = type == 1 ? Side::port : Side::starboard,
                           .ground_range = info.at<std::uint16_t>(2) == 2,
                           .format_code = info.at<std::uint8_t>(74),
                           .format = sample_format(info),
                           .samples = info.at<std::uint32_t>(8),
                           .frequency_hz = 1e3 * info.known<float>(32).value_or(0.0),
                           .beamwidth_rad = std::max(0.0, beam_rad(info, 36)),
                           .vertical_beamwidth_rad = std::max(0.0, beam_rad(info, 44)),
                           .tilt_rad = beam_rad(info, 40)});
    }
  }

  std::vector<RecordedLine> read(std::string_view name) {
    refuse_formats(name);
    const bool geographic = file_.at<std::uint16_t>(164) == 3;
    // The header of some files is 1024 bytes although they have more than 6 channels.
    const std::size_t begin = packet_size(file_.part(file_header)) > 0 ? file_header : header_end();
    const auto read_pings = [&] {
      unlike_header_ = 0;
      over_packets(
          file_, begin, &packet_size,
          [&](const RecordingBytes& packet) {
            constexpr std::uint8_t sonar_packet = 0;
            if (packet.at<std::uint8_t>(2) == sonar_packet && packet.size() >= ping_header)
              read_ping(packet, geographic);
          },
          lines_);
    };
    read_pings();
    high_byte_first_ = byte_order_.is_exchanged();
    if (high_byte_first_) {
      lines_ = LineBuilder(format_name);
      read_pings();
    }
    std::vector<RecordedLine> lines = lines_.finish(name);
    for (RecordedLine& line : lines) {
      if (geographic)
        take_as_metres(line, name);
      else if (looks_geographic(line))
        take_as_degrees(line, name);
      tow_back(line, name);
      if (high_byte_first_)
        line.warnings.push_back(fmt::format(
            "{}: the bytes of its samples are in the other order, the highest first; read so",
            name));
      if (unlike_header_ > 0)
        line.warnings.push_back(
            fmt::format("{}: {} packets are too short for the samples that they state, or have a "
                        "channel that the file's header lacks; what follows there is left out",
                        name, unlike_header_));
      if (std::ranges::any_of(channels_, [](const Channel& channel) {
            return channel.line >= 0 && channel.ground_range;
          }))
        line.warnings.push_back(
            fmt::format("{}: states that its samples lie in ground range; read as slant ranges, "
                        "expected a recording without slant-range correction",
                        name));
      if (doubtful_delay_s_ > 0.0)
        line.warnings.push_back(fmt::format(
            "{}: states that its samples begin {:g} s after the transmission, more than "
            "{} times as long as they last; read as if they began with it",
            name, doubtful_delay_s_, longest_delay));
    }
    return lines;
  }

 private:
  /// Throws RecordingError if no sidescan channel can be read, because of its sample format.
  void refuse_formats(std::string_view name) const {
    const Channel* unknown = nullptr;
    for (const Channel& channel : channels_) {
      if (channel.line < 0) continue;
      if (channel.format != SampleFormat::unknown) return;
      unknown = &channel;
    }
    if (unknown && unknown->format_code != 0)
      throw RecordingError(fmt::format(
          "{}: its samples have format {}, which is not supported; expected 2, 3, 5 or 8", name,
          unknown->format_code));
  }

  /// With more than 6 channels the file's header takes more blocks of 1024 bytes.
  std::size_t header_end() const {
    const std::size_t used = first_channel_info + channels_.size() * channel_info;
    return (used + file_header - 1) / file_header * file_header;
  }

  void read_ping(const RecordingBytes& packet, bool geographic) {
    RecordedPing ping = ping_of(packet, geographic);
    std::size_t at = ping_header;
    for (int left = packet.at<std::uint16_t>(4); left > 0 && packet.has(at, channel_header);
         --left) {
      const RecordingBytes header = packet.part(at, channel_header);
      const std::size_t number = header.at<std::uint16_t>(0);
      if (number >= channels_.size()) {  // the length of its samples is unknown
        ++unlike_header_;
        return;
      }
      const Channel& channel = channels_[number];
      std::size_t samples = header.at<std::uint32_t>(42);
      if (samples == 0) samples = channel.samples;
      const std::size_t bytes = bytes_of(channel.format);
      at += channel_header;
      if (bytes == 0) return;
      if (samples > (packet.size() - at) / bytes) {
        ++unlike_header_;
        return;
      }
      if (channel.line >= 0 && samples > 0) {
        RecordedLine& line = lines_.line(channel.line);
        const double speed_mps = sound_speed_mps(packet);
        if (line.sound_speed_mps == 0.0) line.sound_speed_mps = speed_mps;
        if (line.frequency_hz == 0.0)
          line.frequency_hz = channel.frequency_hz > 0.0 ? channel.frequency_hz
                                                         : 1e3 * header.at<std::uint16_t>(26);
        line.sonar = sonar_name(channel);
        if (line.bandwidth_hz == 0.0) line.bandwidth_hz = 1e3 * header.at<std::uint16_t>(32);
        line.beamwidth_rad = channel.beamwidth_rad;
        line.vertical_beamwidth_rad = channel.vertical_beamwidth_rad;
        if (channel.vertical_beamwidth_rad > 0.0) line.tilt_rad = channel.tilt_rad;
        constexpr std::uint16_t keeps_largest = 2;  // DownsampleMethod
        line.peak_detector = header.at<std::uint16_t>(2) == keeps_largest;
        if (!high_byte_first_ && bytes > 1)
          byte_order_.take(packet.part(at), samples, bytes, channel.format == SampleFormat::f32);
        const Extent extent = extent_of(header, samples, speed_mps);
        ping.unrecorded = extent.unrecorded;
        ping.range_m = extent.sample_m * static_cast<double>(extent.unrecorded + samples);
        lines_.add(
            channel.line, ping, channel.side,
            near_to_far(packet.part(at), channel, samples, extent.unrecorded, weight_of(header)));
      }
      at += samples * bytes;
    }
  }

  /// The file's, else the name that both channels of a line have.
  std::string sonar_name(const Channel& channel) const {
    std::string name = file_.text(18, 16);
    if (name.empty() && std::ranges::count_if(channels_, [&](const Channel& other) {
                          return other.line == channel.line && other.name == channel.name;
                        }) == 2)
      name = channel.name;
    return name;
  }

  /// Where samples lie in slant range.
  struct Extent {
    double sample_m = 0.0;       ///< 0: not stated
    std::size_t unrecorded = 0;  ///< as RecordedPing::unrecorded
  };
  /// The specification (Triton, eXtended Triton Format, rev. 41, XTFPINGCHANHEADER) has SlantRange,
  /// "of the data", TimeDelay, the seconds to the start of the recorded data, and TimeDuration, the
  /// seconds recorded, typically SlantRange / 750 m/s. So SlantRange is the extent of the samples,
  /// unless delay and duration add up to it.
  Extent extent_of(const RecordingBytes& header, std::size_t samples, double speed_mps) {
    const double slant_m = header.at<float>(4), delay_s = header.at<float>(12),
                 duration_m = 0.5 * speed_mps * header.at<float>(16);
    const double delay_m = std::isfinite(delay_s) ? std::max(0.0, 0.5 * speed_mps * delay_s) : 0.0;
    constexpr double alike = 0.01;
    const bool to_far_edge =
        duration_m > 0.0 && std::abs(delay_m + duration_m - slant_m) < alike * delay_m;
    const double extent_m = slant_m > 0.0 && !to_far_edge ? slant_m : duration_m;
    if (!std::isfinite(extent_m) || extent_m <= 0.0) return {};
    const double sample_m = extent_m / static_cast<double>(samples);
    if (delay_m > longest_delay * extent_m) {
      doubtful_delay_s_ = delay_s;
      return {sample_m};
    }
    return {sample_m, static_cast<std::size_t>(std::lround(delay_m / sample_m))};
  }

  /// The weight of the ping's samples: an amplitude is sample x 2^-weight.
  static int weight_of(const RecordingBytes& header) {
    constexpr int most = 31;  // beyond, the field holds something else
    const int weight = header.at<std::int16_t>(58);
    return std::abs(weight) <= most ? weight : 0;
  }

  std::vector<float> near_to_far(const RecordingBytes& bytes, const Channel& channel,
                                 std::size_t samples, std::size_t unrecorded, int weight) const {
    std::vector<float> values(unrecorded + samples);
    for (std::size_t i = 0; i < samples; ++i) {
      const float amplitude =
          std::ldexp(sample_at(bytes, channel.format, i, high_byte_first_), -weight);
      values[unrecorded + (channel.side == Side::port ? samples - 1 - i : i)] =
          std::isfinite(amplitude) ? amplitude : 0.0f;
    }
    return values;
  }

  static constexpr const char* format_name = "XTF";
  RecordingBytes file_;
  std::vector<Channel> channels_;
  ByteOrder byte_order_;
  bool high_byte_first_ = false;
  std::size_t unlike_header_ = 0;          // packets
  static constexpr int longest_delay = 4;  // times what was recorded
  double doubtful_delay_s_ = 0.0;          // a longer one
  LineBuilder lines_{format_name};
};

}  // namespace

bool is_xtf(std::span<const std::byte> begin) {
  const RecordingBytes bytes(begin);
  constexpr int file_format = 123;
  const int channels = bytes.at<std::uint16_t>(166);
  return bytes.at<std::uint8_t>(0) == file_format && channels > 0 && channels < 256;
}

std::vector<RecordedLine> parse_xtf(std::span<const std::byte> bytes, std::string_view name) {
  return XtfReader(bytes).read(name);
}

}  // namespace ensonify::engine
