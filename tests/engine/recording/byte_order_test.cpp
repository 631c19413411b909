// Recordings whose samples have the highest byte first.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "support/altered_xtf.h"
#include "support/catch.h"
#include "support/small_recording.h"

using namespace ensonify;
using namespace ensonify::engine;
using tests::AlteredXtf;

namespace {

constexpr std::size_t bins = 400, pings = 40;

/// Rayleigh amplitudes of a bed behind a dark water column; up to about three times `level`.
Recording bed_recording(double level) {
  std::mt19937 random(7);
  std::exponential_distribution<double> power;
  Recording recording = tests::small_recording(bins);
  const NavPing first = recording.pings.front();
  recording.pings.clear();
  recording.samples.clear();
  recording.gain_db.resize(pings);
  for (std::size_t i = 0; i < pings; ++i) {
    NavPing ping = first;
    ping.row = ping.number = i;
    ping.unix_ms += static_cast<std::int64_t>(100 * i);
    recording.pings.push_back(ping);
    for (std::size_t k = 0; k < 2 * bins; ++k) {
      const double range = std::abs(static_cast<double>(k) - bins),
                   rms = range < 80.0 ? 0.02 * level : level * 80.0 / range;
      recording.samples.push_back(
          static_cast<std::uint16_t>(std::min(32767.0, rms * std::sqrt(power(random)))));
    }
  }
  return recording;
}

/// Exchanges the bytes of every sample of `width` bytes.
AlteredXtf exchanged(AlteredXtf file, std::size_t width) {
  for (std::vector<std::byte>& packet : file.packets)
    for (std::size_t channel = 0; channel < 2; ++channel) {
      const std::size_t of_channel = AlteredXtf::channel_header + bins * width,
                        first = AlteredXtf::ping_header + channel * of_channel +
                                AlteredXtf::channel_header;
      for (std::size_t at = first; at < first + bins * width; at += width)
        std::reverse(packet.begin() + static_cast<std::ptrdiff_t>(at),
                     packet.begin() + static_cast<std::ptrdiff_t>(at + width));
    }
  return file;
}

/// The same file with samples of 32 bits. `of` makes them from the samples of 16 bits.
template <class T, class Of>
AlteredXtf with_samples_of_32_bits(AlteredXtf file, int format, Of&& of) {
  for (const std::size_t channel : {0u, 1u}) {
    AlteredXtf::put<std::uint16_t>(file.head, 256 + 128 * channel + 6, sizeof(T));
    AlteredXtf::put(file.head, 256 + 128 * channel + 74, static_cast<std::uint8_t>(format));
  }
  for (std::vector<std::byte>& packet : file.packets) {
    std::vector<std::byte> wider(packet.begin(), packet.begin() + AlteredXtf::ping_header);
    for (const std::size_t channel : {0u, 1u}) {
      const std::size_t from =
          AlteredXtf::ping_header + channel * (AlteredXtf::channel_header + 2 * bins);
      wider.insert(wider.end(), packet.begin() + static_cast<std::ptrdiff_t>(from),
                   packet.begin() + static_cast<std::ptrdiff_t>(from + AlteredXtf::channel_header));
      for (std::size_t k = 0; k < bins; ++k) {
        wider.resize(wider.size() + sizeof(T));
        AlteredXtf::put(
            wider, wider.size() - sizeof(T),
            of(AlteredXtf::get<std::uint16_t>(packet, from + AlteredXtf::channel_header + 2 * k)));
      }
    }
    AlteredXtf::put(wider, 10, static_cast<std::uint32_t>(wider.size()));
    packet = std::move(wider);
  }
  return file;
}

void check_both_orders(const AlteredXtf& file, std::size_t width) {
  const RecordedLine as_written = file.line(), turned = exchanged(file, width).line();
  CHECK(as_written.warnings.empty());
  CHECK(std::ranges::equal(turned.port, as_written.port));
  CHECK(std::ranges::equal(turned.starboard, as_written.starboard));
  REQUIRE(turned.warnings.size() == 1);
  CHECK(turned.warnings[0] ==
        "r: the bytes of its samples are in the other order, the highest first; read so");
}

}  // namespace

TEST_CASE("samples of 16 bits with the high byte first are read right, with a warning") {
  for (const double level : {200.0, 300.0, 1000.0, 4000.0, 12000.0}) {
    CAPTURE(level);
    check_both_orders(AlteredXtf(bed_recording(level)), 2);
  }
}

TEST_CASE("samples of 32 bits with the high byte first are read right, with a warning") {
  const AlteredXtf file(bed_recording(4000.0));
  check_both_orders(with_samples_of_32_bits<float>(
                        file, 5, [](std::uint16_t sample) { return sample / 32767.0f; }),
                    4);
  check_both_orders(
      with_samples_of_32_bits<float>(file, 5, [](std::uint16_t sample) { return float(sample); }),
      4);
  check_both_orders(with_samples_of_32_bits<std::uint32_t>(
                        file, 2, [](std::uint16_t sample) { return 65000u * sample; }),
                    4);
}

TEST_CASE("samples whose low bits are not used have their order") {
  for (const int unused_bits : {4, 6, 8}) {
    CAPTURE(unused_bits);
    Recording recording = bed_recording(4000.0);
    for (std::uint16_t& sample : recording.samples)
      sample = static_cast<std::uint16_t>(sample >> unused_bits << unused_bits);
    CHECK(AlteredXtf(recording).line().warnings.empty());
  }
  // Faint samples, which hardly use the high byte.
  CHECK(AlteredXtf(bed_recording(120.0)).line().warnings.empty());
}
