// Sides with samples of different lengths, and packets that lack some.

#include <vector>

#include "support/altered_xtf.h"
#include "support/catch.h"
#include "support/small_recording.h"

#include <ensonify/engine/recording/some_pings.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::AlteredXtf;

namespace {

/// A file of 3 pings to 30 m with 8 samples on port and, of starboard, the first `kept` samples
/// with this slant range.
AlteredXtf with_starboard(std::size_t kept, float slant_m) {
  AlteredXtf file(tests::small_recording(8));
  constexpr std::size_t starboard =
      AlteredXtf::ping_header + AlteredXtf::channel_header + 8 * sizeof(std::uint16_t);
  for (std::vector<std::byte>& packet : file.packets) {
    AlteredXtf::put(packet, starboard + 42, static_cast<std::uint32_t>(kept));
    AlteredXtf::put(packet, starboard + 4, slant_m);
  }
  return file;
}

std::vector<float> row_of(const RecordedLine& line, Side side) {
  const auto row = line.row(side, 0);
  return {row.begin(), row.end()};
}

}  // namespace

TEST_CASE("samples of a side that are longer are repeated, so that both lie at the same ranges") {
  const RecordedLine line = with_starboard(4, 30.0f).line();
  REQUIRE(line.samples == 8);
  CHECK(row_of(line, Side::port) == std::vector<float>{107, 106, 105, 104, 103, 102, 101, 100});
  CHECK(row_of(line, Side::starboard) ==
        std::vector<float>{108, 108, 109, 109, 110, 110, 111, 111});
  CHECK(line.pings[0].range_m == Approx(30.0));
  CHECK(line.pings[0].samples == 8);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0], Catch::StartsWith("r: in 3 pings ") &&
                                   Catch::Contains("3.75 m long on port and 7.5 m on starboard") &&
                                   Catch::Contains("repeated"));
}

TEST_CASE("a side that ends earlier has its samples at their ranges, and then none") {
  const RecordedLine line = with_starboard(4, 15.0f).line();
  CHECK(row_of(line, Side::starboard) == std::vector<float>{108, 109, 110, 111, 0, 0, 0, 0});
  CHECK(line.pings[0].range_m == Approx(30.0));
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0], Catch::Contains("one side ends at a shorter range"));
}

TEST_CASE("alike pings end where the shorter side ends, so that they have no made-up zeros") {
  const auto [alike, left_out] = alike_pings(with_starboard(4, 15.0f).line());
  CHECK(alike.samples == 4);
  CHECK(row_of(alike, Side::port) == std::vector<float>{107, 106, 105, 104});
  CHECK(row_of(alike, Side::starboard) == std::vector<float>{108, 109, 110, 111});
  for (const RecordedPing& ping : alike.pings) {
    CHECK(ping.range_m == Approx(15.0));
    CHECK(ping.samples == 4);
  }
  CHECK(left_out ==
        "in 3 pings one side ends at a shorter range, and the samples beyond it of the other are "
        "left out");
}

TEST_CASE("packets that are too short for their samples are counted") {
  const RecordedLine line = with_starboard(8000, 30.0f).line();
  CHECK(line.starboard.empty());
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0],
             Catch::StartsWith("r: 3 packets are too short for the samples that they state"));
}
