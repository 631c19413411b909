// Which channels of an XTF are the sides of one sonar, and files that have none.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/recording/recording_bytes.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::error_of, ensonify::tests::put;

namespace {

constexpr std::size_t ping_header = 256, channel_header = 64;
constexpr int port = 1, starboard = 2, bathymetry = 3;

struct TestChannel {
  int type = port;
  double frequency_khz = 0.0;  ///< of the file's header
  std::uint8_t first = 1;      ///< its samples are this and the following numbers
  std::size_t samples = 4;     ///< 0: its pings have no such channel
  std::uint16_t ping_khz = 0;  ///< of the headers of its samples
};

/// Two pings of these channels.
std::vector<std::byte> xtf_of_channels(const std::vector<TestChannel>& channels) {
  std::vector<std::byte> bytes(1024);
  put<std::uint8_t>(bytes, 0, 123);
  put<std::uint8_t>(bytes, 1, 1);
  put(bytes, 166, static_cast<std::uint16_t>(channels.size()));
  for (std::size_t k = 0; k < channels.size(); ++k) {
    const std::size_t info = 256 + 128 * k;
    put(bytes, info, static_cast<std::uint8_t>(channels[k].type));
    put<std::uint16_t>(bytes, info + 6, 1);  // bytes per sample
    put(bytes, info + 32, static_cast<float>(channels[k].frequency_khz));
  }
  for (std::uint32_t number = 1; number <= 2; ++number) {
    const std::size_t packet = bytes.size();
    bytes.resize(packet + ping_header);
    put<std::uint16_t>(bytes, packet, 0xFACE);
    put(bytes, packet + 28, number);
    std::uint16_t present = 0;
    for (std::size_t k = 0; k < channels.size(); ++k) {
      if (channels[k].samples == 0) continue;
      ++present;
      const std::size_t at = bytes.size();
      bytes.resize(at + channel_header + channels[k].samples);
      put(bytes, at, static_cast<std::uint16_t>(k));
      put<float>(bytes, at + 4, 50.0f);  // slant range
      put(bytes, at + 26, channels[k].ping_khz);
      put(bytes, at + 42, static_cast<std::uint32_t>(channels[k].samples));
      for (std::size_t i = 0; i < channels[k].samples; ++i)
        put(bytes, at + channel_header + i, static_cast<std::uint8_t>(channels[k].first + i));
    }
    put(bytes, packet + 4, present);
    put(bytes, packet + 10, static_cast<std::uint32_t>(bytes.size() - packet));
  }
  return bytes;
}

/// The first sample in the file of each side of each line; 0: it has no such side.
std::vector<std::pair<int, int>> pairs_of(const std::vector<TestChannel>& channels) {
  std::vector<std::pair<int, int>> pairs;
  for (const RecordedLine& line : parse_recording(xtf_of_channels(channels), "r"))
    pairs.emplace_back(
        line.port.empty() ? 0 : static_cast<int>(line.row(Side::port, 0)[line.samples - 1]),
        line.starboard.empty() ? 0 : static_cast<int>(line.row(Side::starboard, 0)[0]));
  return pairs;
}

using Pairs = std::vector<std::pair<int, int>>;

}  // namespace

TEST_CASE("port and starboard of one frequency are one line, in any order of the channels") {
  const TestChannel low_port{port, 100.0, 10}, low_starboard{starboard, 100.0, 20},
      high_port{port, 400.0, 30}, high_starboard{starboard, 400.0, 40};
  CHECK(pairs_of({low_port, low_starboard, high_port, high_starboard}) ==
        Pairs{{10, 20}, {30, 40}});
  CHECK(pairs_of({low_port, high_port, high_starboard, low_starboard}) ==
        Pairs{{10, 20}, {30, 40}});
  CHECK(pairs_of({high_starboard, low_port, low_starboard, high_port}) ==
        Pairs{{30, 40}, {10, 20}});
  // One side is not there, or silent.
  CHECK(pairs_of({low_port, high_starboard, high_port}) == Pairs{{10, 0}, {30, 40}});
  CHECK(pairs_of({low_port, high_port, low_starboard}) == Pairs{{10, 20}, {30, 0}});
  for (const RecordedLine& line :
       parse_recording(xtf_of_channels({low_port, high_port, high_starboard, low_starboard}), "r"))
    CHECK(line.warnings.empty());
}

TEST_CASE("frequencies that only the samples' headers state pair the channels, too") {
  const TestChannel low_port{port, 0.0, 10, 4, 100}, low_starboard{starboard, 0.0, 20, 4, 100},
      high_port{port, 0.0, 30, 4, 400}, high_starboard{starboard, 0.0, 40, 4, 400};
  CHECK(pairs_of({low_port, high_port, high_starboard, low_starboard}) ==
        Pairs{{10, 20}, {30, 40}});
  const auto lines =
      parse_recording(xtf_of_channels({low_port, high_port, high_starboard, low_starboard}), "r");
  CHECK(lines[0].frequency_hz == 100e3);
  CHECK(lines[1].frequency_hz == 400e3);
}

TEST_CASE("sides may differ by some percent in frequency, and one may not state it") {
  CHECK(pairs_of({{port, 445.0, 10}, {starboard, 465.0, 20}}) == Pairs{{10, 20}});
  CHECK(pairs_of({{port, 0.0, 10}, {starboard, 465.0, 20}}) == Pairs{{10, 20}});
  CHECK(pairs_of(
            {{port, 0.0, 10}, {port, 465.0, 20}, {starboard, 450.0, 30}, {starboard, 0.0, 40}}) ==
        Pairs{{10, 40}, {20, 30}});
  // Two frequencies are not those of two sides.
  CHECK(pairs_of({{port, 100.0, 10}, {starboard, 400.0, 20}}) == Pairs{{10, 0}, {0, 20}});
  const auto lines =
      parse_recording(xtf_of_channels({{port, 100.0, 10}, {starboard, 400.0, 20}}), "r");
  CHECK(lines[0].warnings ==
        std::vector<std::string>{"r: port of 100 kHz and starboard of 400 kHz are separate lines, "
                                 "because their frequencies differ"});
}

TEST_CASE("channels of one frequency are paired by the number of samples, then by their order") {
  CHECK(pairs_of({{port, 400.0, 10, 4},
                  {port, 400.0, 20, 6},
                  {starboard, 400.0, 30, 6},
                  {starboard, 400.0, 40, 4}}) == Pairs{{10, 40}, {20, 30}});
  CHECK(pairs_of({{port, 0.0, 10}, {port, 0.0, 20}, {starboard, 0.0, 30}, {starboard, 0.0, 40}}) ==
        Pairs{{10, 30}, {20, 40}});
  // A channel that no ping has takes no other's place.
  CHECK(pairs_of({{port, 400.0, 10}, {starboard, 400.0, 20, 0}, {starboard, 400.0, 30}}) ==
        Pairs{{10, 30}});
}

TEST_CASE("an XTF without sidescan samples is named by what it has") {
  std::vector<std::byte> bytes = xtf_of_channels({{bathymetry}, {bathymetry}});
  put<std::uint16_t>(bytes, 166, 0);
  put<std::uint16_t>(bytes, 168, 2);
  const std::size_t packet = (bytes.size() - 1024) / 2;
  put<std::uint8_t>(bytes, 1024 + 2, 28);
  put<std::uint8_t>(bytes, 1024 + packet + 2, 28);
  CHECK(error_of(bytes) ==
        "r: has no sidescan samples; it has bathymetry channels (2) and packets of type 28, "
        "bathymetry (2), expected a recording of a sidescan sonar");
  const tests::TemporaryFolder folder;
  tests::write_text(folder / "r.xtf", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  CHECK(is_recording(folder / "r.xtf"));
  put<std::uint16_t>(bytes, 168, 0);
  put<std::uint8_t>(bytes, 1024 + 2, 3);
  CHECK(error_of(bytes) ==
        "r: has no sidescan samples; it has packets of type 28, bathymetry (1) and packets of type "
        "3, attitude (1), expected a recording of a sidescan sonar");
  CHECK_THAT(error_of(xtf_of_channels({{0, 4.0}})),  // a sub-bottom profiler
             Catch::Contains("packets of type 0, sonar without samples of port or starboard (2)"));
  // Text is none of it.
  const std::string text = "{\"a\": 1}" + std::string(2000, ' ');
  CHECK(error_of(text) == "r: is no recording, expected an XTF or a JSF file");
}

TEST_CASE("places of an XTF that only its navigation packets have are not lost in silence") {
  std::vector<std::byte> bytes = xtf_of_channels({{port, 400.0, 10}, {starboard, 400.0, 20}});
  put<std::uint8_t>(bytes, 1024 + (bytes.size() - 1024) / 2 + 2, 42);
  CHECK(parse_recording(bytes, "r").front().warnings ==
        std::vector<std::string>{"r: its pings have no places; places in packets of type 42, "
                                 "navigation (1) are not read"});
  put<double>(bytes, 1024 + 160, 55.0);
  put<double>(bytes, 1024 + 168, 8.0);
  CHECK(parse_recording(bytes, "r").front().warnings.empty());
}

TEST_CASE("channels of port and starboard are read although the header counts them as bathymetry") {
  std::vector<std::byte> bytes = xtf_of_channels({{port, 400.0, 10}, {starboard, 400.0, 20}});
  put<std::uint16_t>(bytes, 166, 0);
  put<std::uint16_t>(bytes, 168, 2);
  const auto lines = parse_recording(bytes, "r");
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].port.size() == 8);
  CHECK(lines[0].starboard.size() == 8);
  REQUIRE(lines[0].warnings.size() == 1);
  CHECK_THAT(lines[0].warnings[0], Catch::StartsWith("r: its header counts no sonar channels") &&
                                       Catch::Contains("2 of its channels") &&
                                       Catch::EndsWith("sidescan's"));
}
