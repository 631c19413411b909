#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/byte_order.h>
#include <ensonify/engine/recording/formats.h>
#include <ensonify/engine/recording/line_builder.h>
#include <ensonify/engine/recording/packets.h>
#include <ensonify/engine/recording/recording_bytes.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/sides.h>
#include <ensonify/engine/recording/xtf_navigation.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t file_header = 1024, first_channel_info = 256, channel_info = 128,
                      ping_header = 256, channel_header = 64;
constexpr std::uint16_t xtf_magic = 0xFACE;

enum class SampleFormat { u8, u16, i16, u32, i32, f32, unknown };  // in the order of bytes_of()

std::size_t bytes_of(SampleFormat format) {
  constexpr std::array<std::size_t, 7> bytes{1, 2, 2, 4, 4, 4, 0};
  return bytes[static_cast<std::size_t>(format)];
}

/// A channel as the file's header describes it, completed from the channel headers of the pings.
struct Channel {
  std::string name;
  bool sidescan = false;
  int line = -1;  ///< number of the channel's line; -1: none
  Side side = Side::port;
  bool ground_range = false;  ///< as stated
  int format_code = 0;        ///< as in the file; 0: the bytes per sample define the format
  SampleFormat format = SampleFormat::unknown;
  std::size_t samples = 0;        ///< for pings that do not state a number of samples
  std::size_t first_samples = 0;  ///< in the first ping with samples; 0: no ping has samples
  double frequency_hz = 0.0;
  double beamwidth_rad = 0.0, vertical_beamwidth_rad = 0.0, tilt_rad = 0.0;
};

/// The size that a packet at the beginning of these bytes states; 0: no packet begins there.
std::size_t packet_size(const RecordingBytes& bytes) {
  constexpr std::size_t packet_header = 14;
  const std::size_t size = bytes.at<std::uint32_t>(10);
  return bytes.at<std::uint16_t>(0) == xtf_magic && size >= packet_header ? size : 0;
}

/// An angle of CHANINFO in radians; 0 if it is unknown or beyond 180 degrees.
double beam_rad(const RecordingBytes& info, std::size_t offset) {
  const double degrees = info.known<float>(offset).value_or(0.0);
  return std::abs(degrees) <= 180.0 ? degrees * degree : 0.0;
}

/// The sample format that CHANINFO states: by its code, or if that is 0 by the bytes per sample,
/// and by whether samples are unipolar or bipolar.
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

/// The number of channels of each kind in the file's header, and the name of the kind.
std::vector<std::pair<std::size_t, std::string_view>> counted_channels(const RecordingBytes& file) {
  return {{file.at<std::uint16_t>(166), "sonar"},
          {file.at<std::uint16_t>(168), "bathymetry"},
          {file.at<std::uint8_t>(170), "snippet"},
          {file.at<std::uint8_t>(171), "forward-looking"},
          {file.at<std::uint16_t>(172), "echo-strength"},
          {file.at<std::uint8_t>(174), "interferometry"}};
}

std::size_t number_of_channels(const RecordingBytes& file) {
  std::size_t sum = 0;
  for (const auto& [count, kind] : counted_channels(file)) sum += count;
  return sum;
}

bool is_navigation(int packet_type) { return packet_type == 42 || packet_type == 107; }

/// The kind of a packet without sidescan samples, for messages (Triton, eXtended Triton Format,
/// rev. 41, HeaderType).
std::string kind_of_packet(int type) {
  constexpr std::array bathymetry{2, 9, 10, 14, 17, 18, 25, 28, 61, 65, 68, 73};
  std::string_view kind;
  if (type == 0) kind = ", sonar without samples of port or starboard";
  if (type == 1) kind = ", notes";
  if (type == 3) kind = ", attitude";
  if (is_navigation(type)) kind = ", navigation";
  if (std::ranges::find(bathymetry, type) != bathymetry.end()) kind = ", bathymetry";
  return fmt::format("packets of type {}{}", type, kind);
}

class XtfReader {
 public:
  explicit XtfReader(std::span<const std::byte> bytes) : file_(bytes) {
    // Some files have more than 6 channels, but a file header of only 1024 bytes.
    begin_ = packet_size(file_.part(file_header)) > 0 ? file_header : header_end();
    const std::size_t channels = number_of_channels(file_);
    for (std::size_t k = 0; k < channels && file_.has(first_channel_info + k * channel_info, 1);
         ++k) {
      const RecordingBytes info = file_.part(first_channel_info + k * channel_info, channel_info);
      const int type = info.at<std::uint8_t>(0);  // 1: port, 2: starboard
      channels_.push_back({.name = info.text(12, 16),
                           .sidescan = type == 1 || type == 2,
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
    pair_channels();
    const bool geographic = file_.at<std::uint16_t>(164) == 3;
    const auto read_pings = [&] {
      unlike_header_ = 0;
      for (const auto& [count, kind] : counted_channels(file_))
        if (count > 0) lines_.other(fmt::format("{} channels", kind), count);
      over_packets(
          file_, begin_, &packet_size,
          [&](const RecordingBytes& packet) {
            if (is_sonar(packet) && read_ping(packet, geographic)) return;
            const int type = packet.at<std::uint8_t>(2);
            if (is_navigation(type))
              lines_.other_navigation(kind_of_packet(type));
            else
              lines_.other(kind_of_packet(type));
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
      settle_units(line, geographic, name);
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
      if (const auto [port, starboard] = lone_channels(); port && starboard)
        line.warnings.push_back(fmt::format(
            "{}: port of {:g} kHz and starboard of {:g} kHz are separate lines, because their "
            "frequencies differ",
            name, 1e-3 * port->frequency_hz, 1e-3 * starboard->frequency_hz));
      if (file_.at<std::uint16_t>(166) == 0)
        line.warnings.push_back(fmt::format(
            "{}: its header counts no sonar channels, but {} of its channels are port or "
            "starboard and have samples; read as a sidescan's",
            name, std::ranges::count_if(channels_, [](const Channel& channel) {
              return channel.line >= 0;
            })));
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
  /// Throws RecordingError if there are sidescan channels, but none has a supported sample format.
  void refuse_formats(std::string_view name) const {
    const Channel* unknown = nullptr;
    for (const Channel& channel : channels_) {
      if (!channel.sidescan) continue;
      if (channel.format != SampleFormat::unknown) return;
      unknown = &channel;
    }
    if (unknown && unknown->format_code != 0)
      throw RecordingError(fmt::format(
          "{}: its samples have format {}, which is not supported; expected 2, 3, 5 or 8", name,
          unknown->format_code));
  }

  /// The size of the file's header: whole blocks of 1024 bytes; the first block has 6 channels.
  std::size_t header_end() const {
    const std::size_t used = first_channel_info + number_of_channels(file_) * channel_info;
    return (used + file_header - 1) / file_header * file_header;
  }

  static bool is_sonar(const RecordingBytes& packet) {
    constexpr std::uint8_t sonar_packet = 0;
    return packet.at<std::uint8_t>(2) == sonar_packet && packet.size() >= ping_header;
  }

  /// Calls take(channel, header, bytes, samples) for each channel with samples in a ping's packet.
  /// `bytes` begins with the channel's samples and ends with the packet.
  template <class Take>
  void over_samples(const RecordingBytes& packet, Take&& take) {
    std::size_t at = ping_header;
    for (int left = packet.at<std::uint16_t>(4); left > 0 && packet.has(at, channel_header);
         --left) {
      const RecordingBytes header = packet.part(at, channel_header);
      const std::size_t number = header.at<std::uint16_t>(0);
      if (number >= channels_.size()) {  // the length of a sample is unknown
        ++unlike_header_;
        return;
      }
      Channel& channel = channels_[number];
      std::size_t samples = header.at<std::uint32_t>(42);
      if (samples == 0) samples = channel.samples;
      const std::size_t bytes = bytes_of(channel.format);
      at += channel_header;
      if (bytes == 0) {
        unlike_header_ += left > 1;
        return;
      }
      if (samples > (packet.size() - at) / bytes) {
        ++unlike_header_;
        return;
      }
      if (samples > 0) take(channel, header, packet.part(at), samples);
      at += samples * bytes;
    }
  }

  /// Sets the line of each sidescan channel that has samples. A line has a port and a starboard
  /// channel of one frequency, best with equal numbers of samples, in the order of the header.
  void pair_channels() {
    LineBuilder uncounted(format_name);
    over_packets(
        file_, begin_, &packet_size,
        [&](const RecordingBytes& packet) {
          if (is_sonar(packet))
            over_samples(packet, [](Channel& channel, const RecordingBytes& header,
                                    const RecordingBytes&, std::size_t samples) {
              if (channel.first_samples == 0) channel.first_samples = samples;
              if (channel.frequency_hz == 0.0)
                channel.frequency_hz = 1e3 * header.at<std::uint16_t>(26);
            });
        },
        uncounted);
    int lines = 0;
    for (std::size_t k = 0; k < channels_.size(); ++k) {
      Channel& channel = channels_[k];
      if (!channel.sidescan || channel.first_samples == 0) continue;
      const Channel* partner = nullptr;
      for (const Channel& other : std::span(channels_).first(k))
        if (other.line >= 0 && other.side != channel.side && is_alone(other) &&
            unlikeness(channel, other) < (partner ? unlikeness(channel, *partner) : unlike))
          partner = &other;
      channel.line = partner ? partner->line : lines++;
    }
  }

  /// The first port and the first starboard channel that are alone in their lines; null: none.
  std::pair<const Channel*, const Channel*> lone_channels() const {
    const auto first = [&](Side side) -> const Channel* {
      const auto found = std::ranges::find_if(channels_, [&](const Channel& channel) {
        return channel.line >= 0 && channel.side == side && is_alone(channel);
      });
      return found == channels_.end() ? nullptr : &*found;
    };
    return {first(Side::port), first(Side::starboard)};
  }

  bool is_alone(const Channel& channel) const {
    return std::ranges::count(channels_, channel.line, &Channel::line) == 1;
  }

  /// How much two channels differ from two sides of one line; `unlike`: they are of two sonars.
  static constexpr double unlike = 10.0;
  static double unlikeness(const Channel& a, const Channel& b) {
    constexpr double one_unstated = 1.0, other_samples = 0.01;
    if (!may_be_of_one_sonar(a.frequency_hz, b.frequency_hz)) return unlike;
    const auto [low_hz, high_hz] = std::minmax(a.frequency_hz, b.frequency_hz);
    const double of_frequency = low_hz == high_hz ? 0.0
                                : low_hz == 0.0   ? one_unstated
                                                  : high_hz / low_hz - 1.0;
    return of_frequency + (a.first_samples == b.first_samples ? 0.0 : other_samples);
  }

  /// Returns whether the packet has sidescan samples.
  bool read_ping(const RecordingBytes& packet, bool geographic) {
    RecordedPing ping = xtf_ping(packet, geographic, lines_);
    bool has_samples = false;
    over_samples(packet, [&](const Channel& channel, const RecordingBytes& header,
                             const RecordingBytes& values, std::size_t samples) {
      if (channel.line >= 0) {
        has_samples = true;
        RecordedLine& line = lines_.line(channel.line);
        const double speed_mps = xtf_sound_speed_mps(packet);
        if (line.sound_speed_mps == 0.0) line.sound_speed_mps = speed_mps;
        if (line.frequency_hz == 0.0) line.frequency_hz = channel.frequency_hz;
        line.sonar = sonar_name(channel);
        if (line.bandwidth_hz == 0.0) line.bandwidth_hz = 1e3 * header.at<std::uint16_t>(32);
        line.beamwidth_rad = channel.beamwidth_rad;
        line.vertical_beamwidth_rad = channel.vertical_beamwidth_rad;
        if (channel.vertical_beamwidth_rad > 0.0) line.tilt_rad = channel.tilt_rad;
        constexpr std::uint16_t keeps_largest = 2;  // DownsampleMethod
        line.peak_detector = header.at<std::uint16_t>(2) == keeps_largest;
        if (const std::size_t width = bytes_of(channel.format); !high_byte_first_ && width > 1)
          byte_order_.take(values, samples, width, channel.format == SampleFormat::f32);
        const Extent extent = extent_of(header, samples, speed_mps);
        ping.unrecorded = extent.unrecorded;
        ping.range_m = extent.sample_m * static_cast<double>(extent.unrecorded + samples);
        lines_.add(channel.line, ping, channel.side,
                   near_to_far(values, channel, samples, extent.unrecorded, weight_of(header)));
      }
    });
    return has_samples;
  }

  /// The sonar's name in the file header, else the name that both channels of the line have.
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
  /// The specification (Triton, eXtended Triton Format, rev. 41, XTFPINGCHANHEADER) has three
  /// fields: SlantRange, "of the data"; TimeDelay, the seconds to the start of the recorded data;
  /// and TimeDuration, the seconds recorded, typically SlantRange / 750 m/s. So SlantRange is the
  /// extent of the samples, unless delay and duration, as ranges, add up to SlantRange. Then the
  /// extent is the duration.
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

  /// The weight of a channel's samples: amplitude = sample x 2^-weight.
  static int weight_of(const RecordingBytes& header) {
    constexpr int most = 31;  // a larger number is no weight
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
  std::size_t begin_ = 0;  // of the first packet
  std::vector<Channel> channels_;
  ByteOrder byte_order_;
  bool high_byte_first_ = false;
  std::size_t unlike_header_ = 0;          // packets that do not agree with the file's header
  static constexpr int longest_delay = 4;  // as a multiple of the recorded extent
  double doubtful_delay_s_ = 0.0;          // the last longer delay; 0: none
  LineBuilder lines_{format_name};
};

}  // namespace

bool is_xtf(std::span<const std::byte> begin) {
  const RecordingBytes bytes(begin);
  constexpr std::uint8_t file_format = 123, system_type = 1;
  const std::size_t channels = number_of_channels(bytes);
  return bytes.at<std::uint8_t>(0) == file_format && channels < 256 &&
         (channels > 0 || bytes.at<std::uint8_t>(1) == system_type);
}

std::vector<RecordedLine> parse_xtf(std::span<const std::byte> bytes, std::string_view name) {
  return XtfReader(bytes).read(name);
}

}  // namespace ensonify::engine
