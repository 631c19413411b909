// Pings that a file has twice, or in another order than they were sent.

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "support/altered_xtf.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

using namespace ensonify;
using namespace ensonify::engine;
using tests::AlteredXtf;

namespace {

constexpr std::size_t numbered_pings = 60;

Recording ordered() {
  Recording recording = tests::small_recording();
  const NavPing first = recording.pings.front();
  recording.pings.clear();
  recording.samples.clear();
  recording.gain_db.resize(numbered_pings);
  for (std::size_t i = 0; i < numbered_pings; ++i) {
    NavPing ping = first;
    ping.row = i;
    ping.number = 1000 + i;
    ping.unix_ms += static_cast<std::int64_t>(100 * i);
    recording.pings.push_back(ping);
    for (std::size_t k = 0; k < 10; ++k)
      recording.samples.push_back(static_cast<std::uint16_t>(10 * i + k + 1));
  }
  return recording;
}

void check_alike(const RecordedLine& line, const RecordedLine& with) {
  REQUIRE(line.pings.size() == with.pings.size());
  for (std::size_t i = 0; i < line.pings.size(); ++i) {
    CHECK(line.pings[i].number == with.pings[i].number);
    CHECK(line.pings[i].t_s == with.pings[i].t_s);
  }
  CHECK(line.port == with.port);
  CHECK(line.starboard == with.starboard);
}

}  // namespace

TEST_CASE("pings in a wrong order are sorted by their numbers, with a warning") {
  const AlteredXtf file(ordered());
  const RecordedLine whole = file.line();
  REQUIRE(whole.warnings.empty());
  std::mt19937 random(2);
  for (int way = 0; way < 3; ++way) {
    AlteredXtf other = file;
    auto& packets = other.packets;
    if (way == 0) std::ranges::shuffle(packets, random);
    if (way == 1) std::ranges::reverse(packets);
    // Not std::ranges::rotate, which clang 14 does not compile.
    if (way == 2) std::rotate(packets.begin(), packets.begin() + numbered_pings / 2, packets.end());
    const RecordedLine line = other.line();
    check_alike(line, whole);
    CHECK(line.warnings ==
          std::vector<std::string>{
              "r: its pings are not in the order of their numbers and times; sorted"});
  }
}

TEST_CASE("pings whose numbers ascend stay where they are when the clock is set back") {
  AlteredXtf file(ordered());
  for (std::size_t i = numbered_pings / 2; i < numbered_pings; ++i) {
    constexpr std::size_t second = 20;
    AlteredXtf::put(
        file.packets[i], second,
        static_cast<std::uint8_t>(AlteredXtf::get<std::uint8_t>(file.packets[i], second) - 2));
  }
  const RecordedLine line = file.line();
  REQUIRE(line.pings.size() == numbered_pings);
  CHECK(line.pings[40].number == 1040);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0], Catch::Contains("of 60 pings have times before"));
}

TEST_CASE("pings that a file has twice count once, with a warning") {
  const AlteredXtf file(ordered());
  const RecordedLine whole = file.line();
  AlteredXtf each = file, appended = file;
  each.packets.clear();
  for (const std::vector<std::byte>& packet : file.packets)
    each.packets.insert(each.packets.end(), 2, packet);
  appended.packets.insert(appended.packets.end(), file.packets.begin(), file.packets.end());
  for (const AlteredXtf& other : {each, appended}) {
    const RecordedLine line = other.line();
    check_alike(line, whole);
    CHECK(line.warnings == std::vector<std::string>{
                               "r: 60 of 120 pings are there before, with the same number, time "
                               "and samples; left out"});
  }
  // A file that is given twice.
  const tests::TemporaryFolder folder;
  const Recording recording = ordered();
  const auto path = folder / "a.xtf";
  tests::write_text(path, tests::as_text(encode_xtf({&recording, 1})));
  const std::vector<std::filesystem::path> files{path, path};
  check_alike(read_recordings(files).at(0), whole);
}

TEST_CASE("a ping with the samples of another, but a number of its own, stays") {
  Recording recording = ordered();
  std::copy_n(recording.samples.begin(), 10, recording.samples.begin() + 10);
  const RecordedLine line = AlteredXtf(recording).line();
  CHECK(line.pings.size() == numbered_pings);
  CHECK(line.warnings.empty());
}
