// Port and starboard of one sonar in two files.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// A JSF of one side.
void write_side(const std::filesystem::path& file, Recording recording, Side side) {
  (side == Side::port ? recording.starboard : recording.port) = false;
  tests::write_text(file, tests::as_text(encode_jsf({&recording, 1})));
}

void expect_same(const RecordedLine& line, const Recording& of, std::size_t first) {
  for (std::size_t row = 0; row < 3; ++row) {
    CHECK(line.pings[first + row].number == of.pings[row].number);
    const auto port = of.side(row, Side::port);
    CHECK(std::ranges::equal(line.row(Side::port, first + row),
                             std::vector(port.rbegin(), port.rend())));
    CHECK(
        std::ranges::equal(line.row(Side::starboard, first + row), of.side(row, Side::starboard)));
  }
}

}  // namespace

TEST_CASE("files of port and of starboard are joined ping by ping, also in several parts") {
  const tests::TemporaryFolder folder;
  const Recording first = tests::small_recording();
  Recording second = first;
  for (NavPing& ping : second.pings) {
    ping.number += 100;
    ping.unix_ms += 60'000;
  }
  const std::filesystem::path port = folder / "p.jsf", starboard = folder / "s.jsf",
                              port2 = folder / "p2.jsf", starboard2 = folder / "s2.jsf";
  write_side(port, first, Side::port);
  write_side(starboard, first, Side::starboard);
  write_side(port2, second, Side::port);
  write_side(starboard2, second, Side::starboard);
  for (const auto& files : {std::vector{port, starboard}, std::vector{starboard, port}}) {
    const auto lines = read_recordings(files);
    REQUIRE(lines.size() == 1);
    REQUIRE(lines[0].pings.size() == 3);
    expect_same(lines[0], first, 0);
    CHECK(lines[0].warnings ==
          std::vector{files[1].string() + ": has " + (files[1] == port ? "port" : "starboard") +
                      " of the pings of a file before it; joined"});
  }
  for (const auto& files : {std::vector{port, starboard, port2, starboard2},
                            std::vector{port, port2, starboard, starboard2}}) {
    const RecordedLine line = read_recordings(files).front();
    REQUIRE(line.pings.size() == 6);
    expect_same(line, first, 0);
    expect_same(line, second, 3);
  }
}

TEST_CASE("a ping that one of the two files lacks has one side") {
  const tests::TemporaryFolder folder;
  const Recording whole = tests::small_recording();
  Recording less = whole;
  less.pings.erase(less.pings.begin() + 1);
  write_side(folder / "p", whole, Side::port);
  write_side(folder / "s", less, Side::starboard);
  const std::vector<std::filesystem::path> files{folder / "p", folder / "s"};
  const RecordedLine line = read_recordings(files).front();
  REQUIRE(line.pings.size() == 3);
  CHECK(std::ranges::equal(line.row(Side::starboard, 2), whole.side(2, Side::starboard)));
  CHECK(std::ranges::count(line.row(Side::starboard, 1), 0.0f) == 5);
  CHECK(std::ranges::count(line.row(Side::port, 1), 0.0f) == 0);
}

TEST_CASE("files of one side each, of other pings or another frequency, follow each other") {
  const tests::TemporaryFolder folder;
  const Recording first = tests::small_recording();
  write_side(folder / "p", first, Side::port);
  for (const bool other_pings : {true, false}) {
    Recording second = first;
    if (!other_pings) second.frequency_hz = 900e3;
    for (NavPing& ping : second.pings) ping.unix_ms += other_pings ? 60'000 : 0;
    write_side(folder / "s", second, Side::starboard);
    const std::vector<std::filesystem::path> files{folder / "p", folder / "s"};
    CHECK(read_recordings(files).front().pings.size() == 6);
  }
}
