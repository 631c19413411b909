#include <ensonify/engine/output/jsf.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/packed_bytes.h>

namespace ensonify::engine {
namespace {

template <class T>
T rounded(double value) {
  return static_cast<T>(std::llround(value));
}

double interval_s(const Recording& recording) {
  return 2.0 * recording.range_m / static_cast<double>(recording.bins) / recording.sound_speed_mps;
}

/// Writes position, attitude and time. h + N is offset N in the sonar header of 240 bytes.
void put_navigation(PackedBytes& bytes, const NavPing& ping) {
  constexpr std::size_t h = jsf_message_header;
  // Validity bits: position, speed, heading, pitch and roll, altitude, depth, annotation, sound
  // speed, and "interpolated": the position is that of the sonar at the time of the ping, and not
  // the ship's last position fix.
  const bool over_bed = ping.altitude_m > 0.0;
  bytes.put<std::uint16_t>(h + 30, 0x662D | (over_bed ? 0x40 : 0));
  constexpr double units = 60.0 * 1e4 / degree;  // units of 1e-4 arc minutes per radian
  bytes.put<std::int32_t>(h + 80, rounded<std::int32_t>(ping.place.longitude_rad * units));
  bytes.put<std::int32_t>(h + 84, rounded<std::int32_t>(ping.place.latitude_rad * units));
  bytes.put<std::int16_t>(h + 88, 2);
  bytes.put<std::int32_t>(h + 136, rounded<std::int32_t>(ping.depth_m * 1000.0));
  bytes.put<std::int32_t>(h + 144, rounded<std::int32_t>(ping.altitude_m * 1000.0));
  const auto hundredths = rounded<std::uint32_t>(ping.heading_rad / degree * 100.0) % 36000;
  bytes.put<std::uint16_t>(h + 172, hundredths);
  constexpr double turns = 32768.0 / 180.0 / degree;
  bytes.put<std::int16_t>(h + 174, rounded<std::int16_t>(ping.pitch_rad * turns));
  bytes.put<std::int16_t>(h + 176, rounded<std::int16_t>(ping.roll_rad * turns));

  const CalendarTime time = calendar_time(ping.unix_ms);
  bytes.put<std::int32_t>(h, std::floor(static_cast<double>(ping.unix_ms) / 1000.0));
  const auto put_words = [&](std::size_t at, std::initializer_list<int> values) {
    for (const int value : values) {
      bytes.put<std::int16_t>(at, value);
      at += 2;
    }
  };
  put_words(h + 156, {time.year, time.day_of_year, time.hour, time.minute, time.second});
  bytes.put<std::int16_t>(h + 166, 3);  // time basis: UTC
  bytes.put<std::uint32_t>(h + 200, time.ms_of_day);

  // The time of the position fix is the time of the ping.
  put_words(h + 186, {time.hour, time.minute, time.second});
  put_words(h + 196, {time.day_of_year, time.year});
}

/// The subsystem: 20 is low frequency, 21 high, 22 very high. From 40 on it is no sidescan sonar.
std::uint8_t subsystem(int frequency_rank) {
  return static_cast<std::uint8_t>(20 + std::min(frequency_rank, 19));
}

/// Writes pulse length and speed. Milliseconds and tenths of a knot have separate fields. The word
/// at offset 20 has microseconds (bits 4 to 13) and hundredths of a knot (bits 0 to 3).
void put_pulse_length_and_speed(PackedBytes& bytes, double pulse_length_s, double speed_mps) {
  constexpr std::size_t h = jsf_message_header;
  const auto sweep_us = rounded<std::uint32_t>(1e6 * pulse_length_s);
  const auto hundredths_kn = rounded<std::uint32_t>(speed_mps / knot_mps * 100.0);
  bytes.put<std::uint16_t>(h + 130, sweep_us / 1000);
  bytes.put<std::int16_t>(h + 194, hundredths_kn / 10);
  bytes.put<std::uint16_t>(h + 20, sweep_us % 1000 << 4 | hundredths_kn % 10);
}

/// Bits 16 to 19 of a value, as bits from `shift` on of the word at offset 16. (The lower 16 bits
/// of the value have a separate field.)
std::uint16_t more_bits(std::uint32_t value, int shift) {
  return static_cast<std::uint16_t>((value >> 16 & 0xfu) << shift);
}

void add_message(PackedBytes& bytes, const Recording& recording, const NavPing& ping, Side side) {
  constexpr std::size_t h = jsf_message_header;
  const auto bins = static_cast<std::uint32_t>(recording.bins);
  bytes.begin(jsf_message_header + jsf_sonar_header + 2 * recording.bins);
  bytes.put<std::uint16_t>(0, 0x1601);
  bytes.put<std::uint8_t>(2, 0x0D);
  bytes.put<std::uint16_t>(4, 80);
  bytes.put<std::uint8_t>(6, 2);  // normal data
  bytes.put<std::uint8_t>(7, subsystem(recording.frequency_rank));
  bytes.put<std::uint8_t>(8, side == Side::port ? 0 : 1);
  bytes.put<std::int32_t>(12, jsf_sonar_header + 2 * bins);

  put_navigation(bytes, ping);
  bytes.put<std::uint32_t>(h + 8, ping.number);
  bytes.put<std::int16_t>(h + 28, 1);  // always 1
  bytes.put<std::int16_t>(h + 34, 0);  // envelope
  constexpr double ten_hz = 10.0;
  const auto low = rounded<std::uint32_t>(
      std::max(0.0, recording.frequency_hz - 0.5 * recording.bandwidth_hz) / ten_hz);
  const auto high =
      rounded<std::uint32_t>((recording.frequency_hz + 0.5 * recording.bandwidth_hz) / ten_hz);
  bytes.put<std::uint16_t>(h + 16, more_bits(low, 0) | more_bits(high, 4) | more_bits(bins, 8));
  bytes.put<std::uint16_t>(h + 114, bins);
  bytes.put<std::uint16_t>(h + 126, low);
  bytes.put<std::uint16_t>(h + 128, high);
  put_pulse_length_and_speed(bytes, recording.pulse_length_s, ping.speed_mps);
  bytes.put<std::uint32_t>(h + 116, rounded<std::uint32_t>(interval_s(recording) * 1e9));
  bytes.put<std::uint16_t>(  // the sample rate, modulo 65536 Hz
      h + 140, static_cast<std::uint16_t>(rounded<std::uint64_t>(1.0 / interval_s(recording))));
  bytes.put<float>(h + 148, recording.sound_speed_mps);
  bytes.put<float>(h + 152, recording.frequency_hz);
  bytes.put<std::uint16_t>(h + 120, 1);   // gain factor of the digitiser
  bytes.put<std::int16_t>(h + 122, 100);  // transmit level, percent
  const double gain_db = recording.gain_db[ping.row][static_cast<std::size_t>(side)];
  const FullScale& full_scale = recording.full_scale[static_cast<std::size_t>(ping.beam)];
  bytes.text(h + 90, 24,
             fmt::format("full scale {:.0f}..{:.0f} dB", full_scale.near_db - gain_db,
                         full_scale.far_db - gain_db));
  const double two_way_s = 2.0 * recording.range_m / recording.sound_speed_mps;
  const double pulses = ping.interval_s > 0.0 ? std::ceil(two_way_s / ping.interval_s) : 1.0;
  bytes.put<std::int16_t>(h + 170, rounded<std::int16_t>(std::min(pulses, 1000.0)));
  bytes.put<std::int16_t>(h + 168, 0);   // weighting factor
  bytes.put<std::uint16_t>(h + 220, 1);  // first packet of the ping

  const std::span<const std::uint16_t> samples = recording.side(ping.row, side);
  std::vector<std::uint16_t> near_to_far(samples.begin(), samples.end());
  if (recording.layout().mirrored(static_cast<std::size_t>(side)))
    std::ranges::reverse(near_to_far);
  bytes.put<std::uint16_t>(h + 204,
                           near_to_far.empty() ? std::uint16_t{0} : std::ranges::max(near_to_far));
  bytes.samples(jsf_message_header + jsf_sonar_header, near_to_far);
}

}  // namespace

std::string fault_of_jsf(std::int64_t unix_ms, double sample_s) {
  constexpr std::int64_t most_ms = std::int64_t{1000} * std::numeric_limits<std::int32_t>::max();
  if (std::abs(unix_ms) >= most_ms)
    return fmt::format(
        "output.jsf: a ping is in {}, and JSF counts seconds from 1970 up to January 2038; set "
        "output.start_time, or leave JSF out",
        calendar_time(unix_ms).year);
  constexpr double longest_s = 4.29;  // of 2^32 ns
  if (!(sample_s < longest_s))
    return fmt::format(
        "output.jsf: a sample is {:.3g} s long, and JSF states at most {} s; use more bins, or leave "
        "JSF out",
        sample_s, longest_s);
  return "";
}

std::vector<std::byte> encode_jsf(std::span<const Recording> sonars) {
  for (const Recording& recording : sonars)
    for (const NavPing& ping : recording.pings)
      if (const std::string fault = fault_of_jsf(ping.unix_ms, interval_s(recording));
          !fault.empty())
        throw std::runtime_error(fault);
  if (sonars.empty() || sonars.size() > max_sonars_of_jsf)
    throw std::invalid_argument(fmt::format("a JSF holds 1 to {} sonars", max_sonars_of_jsf));
  std::vector<std::byte> file;
  PackedBytes bytes(file);
  std::vector<std::size_t> all(sonars.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (const auto& [sonar, number] : pings_by_time(sonars, all)) {
    const Recording& recording = sonars[sonar];
    const NavPing& ping = recording.pings[number];
    if (recording.port) add_message(bytes, recording, ping, Side::port);
    if (recording.starboard) add_message(bytes, recording, ping, Side::starboard);
  }
  return file;
}

}  // namespace ensonify::engine
