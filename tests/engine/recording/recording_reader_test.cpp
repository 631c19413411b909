#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engine/recording/recording_bytes.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/recording_reader.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::error_of, ensonify::tests::put;

namespace {

std::vector<RecordedLine> parse(const std::string& bytes) {
  return parse_recording(std::as_bytes(std::span(bytes)), "r");
}

/// An XTF file of one ping and one starboard channel, with these samples.
template <class T>
std::string one_ping_xtf(const std::vector<T>& samples, int format, bool bipolar = false) {
  std::string bytes(1024 + 256 + 64 + samples.size() * sizeof(T), '\0');
  put<std::uint8_t>(bytes, 0, 123);
  put<std::uint16_t>(bytes, 166, 1);  // channels
  put<std::uint8_t>(bytes, 256, 2);   // starboard
  put<std::uint16_t>(bytes, 256 + 4, bipolar ? 0 : 1);
  put<std::uint16_t>(bytes, 256 + 6, sizeof(T));
  put<std::uint8_t>(bytes, 256 + 74, static_cast<std::uint8_t>(format));
  put<std::uint16_t>(bytes, 1024, 0xFACE);
  put<std::uint16_t>(bytes, 1024 + 4, 1);
  put<std::uint32_t>(bytes, 1024 + 10, static_cast<std::uint32_t>(bytes.size() - 1024));
  put<float>(bytes, 1024 + 32, 750.0f);      // half the sound speed
  put<float>(bytes, 1024 + 256 + 16, 0.1f);  // two-way time of the range
  put<std::uint32_t>(bytes, 1024 + 256 + 42, static_cast<std::uint32_t>(samples.size()));
  std::memcpy(bytes.data() + 1024 + 256 + 64, samples.data(), samples.size() * sizeof(T));
  return bytes;
}

}  // namespace

TEST_CASE("what was written as XTF or JSF is read again") {
  Recording written = tests::small_recording();
  written.beamwidth_rad = 0.5 * degree;
  written.vertical_beamwidth_rad = 40.0 * degree;
  written.tilt_rad = {20.0 * degree, 20.0 * degree};
  for (const bool jsf : {false, true}) {
    CAPTURE(jsf);
    const auto lines =
        parse_recording(jsf ? encode_jsf({&written, 1}) : encode_xtf({&written, 1}), "r");
    REQUIRE(lines.size() == 1);
    const RecordedLine& line = lines.front();
    CHECK(line.format == (jsf ? "JSF" : "XTF"));
    CHECK(line.warnings.empty());
    CHECK(line.frequency_hz == Approx(455e3));
    CHECK(line.bandwidth_hz == Approx(40e3));
    CHECK(line.sound_speed_mps == 1480.0);
    if (jsf) {
      CHECK(line.pulse_length_s == Approx(2.5e-3));
    } else {
      CHECK(line.sonar == "towfish");
      CHECK(line.beamwidth_rad == Approx(0.5 * degree));
      CHECK(line.vertical_beamwidth_rad == Approx(40.0 * degree));
      CHECK(line.tilt_rad.value() == Approx(20.0 * degree));
      CHECK_FALSE(line.peak_detector);
    }
    REQUIRE(line.samples == written.bins);
    REQUIRE(line.pings.size() == 3);
    for (std::size_t row = 0; row < 3; ++row) {
      const RecordedPing& ping = line.pings[row];
      const NavPing& of = written.pings[row];
      CHECK(ping.number == of.number);
      CHECK(ping.t_s.value() ==
            Approx(static_cast<double>(of.unix_ms) / 1e3).epsilon(0).margin(1e-3));
      CHECK(ping.place.value().latitude_rad ==
            Approx(of.place.latitude_rad).epsilon(0).margin(1e-6 * degree));
      CHECK(ping.place.value().longitude_rad ==
            Approx(of.place.longitude_rad).epsilon(0).margin(1e-6 * degree));
      CHECK(ping.heading_rad.value() == Approx(of.heading_rad).epsilon(0).margin(0.005 * degree));
      CHECK(ping.pitch_rad.value() == Approx(of.pitch_rad).epsilon(0).margin(0.005 * degree));
      CHECK(ping.roll_rad.value() == Approx(of.roll_rad).epsilon(0).margin(0.005 * degree));
      CHECK(ping.depth_m.value() == Approx(12.5));
      CHECK(ping.altitude_m.value() == Approx(7.25));
      CHECK(ping.speed_mps.value() == Approx(1.5).epsilon(0).margin(0.003));
      CHECK(ping.range_m == Approx(30.0).epsilon(1e-6));
      const auto port = written.side(row, Side::port);
      CHECK(std::ranges::equal(line.row(Side::port, row), std::vector(port.rbegin(), port.rend())));
      CHECK(std::ranges::equal(line.row(Side::starboard, row), written.side(row, Side::starboard)));
    }
  }
}

TEST_CASE("the sonars of one recording are read as a line each") {
  std::vector<Recording> written{tests::small_recording(), tests::small_recording(8)};
  written[1].name = "low";
  written[1].frequency_hz = 100e3;
  written[1].frequency_rank = 1;
  for (const bool apart : {false, true}) {  // in position
    if (apart)
      for (NavPing& ping : written[1].pings) ping.depth_m += 1.0;
    for (const bool jsf : {false, true}) {
      CAPTURE(apart, jsf);
      const auto lines = parse_recording(jsf ? encode_jsf(written) : encode_xtf(written), "r");
      REQUIRE(lines.size() == 2);
      for (const std::size_t k : {0u, 1u}) {
        const RecordedLine& line = lines[k];
        const Recording& of = written[k];
        CHECK(line.warnings.empty());
        CHECK(line.sonar == (jsf ? "" : of.name));
        CHECK(line.frequency_hz == Approx(of.frequency_hz));
        REQUIRE(line.samples == of.bins);
        REQUIRE(line.pings.size() == 3);
        for (std::size_t row = 0; row < 3; ++row) {
          CHECK(line.pings[row].number == of.pings[row].number);
          CHECK(line.pings[row].depth_m.value() == Approx(of.pings[row].depth_m));
          CHECK(std::ranges::equal(line.row(Side::starboard, row), of.side(row, Side::starboard)));
        }
      }
    }
  }
}

TEST_CASE("a recording of one side has one side") {
  Recording written = tests::small_recording();
  written.port = false;
  const RecordedLine line = parse_recording(encode_jsf({&written, 1}), "r").front();
  CHECK(line.port.empty());
  CHECK(line.starboard.size() == 15);
}

TEST_CASE("an XTF's channel of the side that a sonar does not have is left out, with a warning") {
  // As output/recording writes them: 0 on the side that is not there.
  const auto without = [](Side side, Recording recording) {
    for (std::size_t row = 0; row < 3; ++row)
      for (std::uint16_t& sample :
           std::span(recording.samples)
               .subspan((2 * row + (side == Side::port ? 0 : 1)) * recording.bins, recording.bins))
        sample = 0;
    (side == Side::port ? recording.port : recording.starboard) = false;
    return recording;
  };
  const Recording port = without(Side::starboard, tests::small_recording()),
                  starboard = without(Side::port, tests::small_recording(8)),
                  both = tests::small_recording();
  for (const std::vector<Recording>& written :
       {std::vector{port}, std::vector{starboard}, std::vector{both, starboard},
        std::vector{port, both, starboard}}) {
    const auto lines = parse_recording(encode_xtf(written), "r");
    REQUIRE(lines.size() == written.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const RecordedLine& line = lines[i];
      const Recording& of = written[i];
      CAPTURE(written.size(), i);
      CHECK(line.port.empty() != of.port);
      CHECK(line.starboard.empty() != of.starboard);
      REQUIRE(line.samples == of.bins);
      REQUIRE(line.pings.size() == 3);
      std::vector<std::string> warnings;
      if (!of.port || !of.starboard)
        warnings.push_back(fmt::format(
            "r: {} is 0 in every sample; left out, as if the file did not have this side",
            of.port ? "starboard" : "port"));
      CHECK(line.warnings == warnings);
      for (std::size_t row = 0; row < 3; ++row) {
        const auto from = of.side(row, Side::port);
        if (of.port)
          CHECK(std::ranges::equal(line.row(Side::port, row),
                                   std::vector(from.rbegin(), from.rend())));
        if (of.starboard)
          CHECK(std::ranges::equal(line.row(Side::starboard, row), of.side(row, Side::starboard)));
      }
    }
  }
}

TEST_CASE("a side that is silent in some pings, or as silent as the other one, stays") {
  Recording written = tests::small_recording();
  for (const std::size_t silent_pings : {2u, 3u}) {
    for (std::size_t row = 0; row < silent_pings; ++row)
      std::fill_n(written.samples.begin() + static_cast<std::ptrdiff_t>(2 * row * written.bins),
                  (silent_pings == 3 ? 2 : 1) * written.bins, std::uint16_t{0});
    const RecordedLine line = parse_recording(encode_xtf({&written, 1}), "r").front();
    CHECK(line.port.size() == 15);
    CHECK(line.starboard.size() == 15);
    CHECK(line.warnings.empty());
  }
}

TEST_CASE("files of one recording are read as one line") {
  const tests::TemporaryFolder folder;
  Recording written = tests::small_recording();
  const std::string first = tests::as_text(encode_xtf({&written, 1}));
  written = tests::small_recording(8);  // another length
  for (NavPing& ping : written.pings) ping.number += 100;
  tests::write_text(folder / "a.xtf", first);
  tests::write_text(folder / "b.xtf", tests::as_text(encode_xtf({&written, 1})));
  tests::write_text(folder / "c.jsf", tests::as_text(encode_jsf({&written, 1})));
  const std::vector<std::filesystem::path> files = {folder / "a.xtf", folder / "b.xtf"};
  const RecordedLine line = read_recordings(files).front();
  REQUIRE(line.samples == 8);
  REQUIRE(line.pings.size() == 6);
  CHECK(line.pings[3].number == 107);
  CHECK(std::ranges::equal(line.row(Side::starboard, 1),
                           std::vector{205, 206, 207, 208, 209, 0, 0, 0}));
  CHECK(line.row(Side::starboard, 5)[7] == 315);
  const std::vector<std::filesystem::path> mixed = {folder / "a.xtf", folder / "c.jsf"};
  CHECK_THROWS_AS(read_recordings(mixed), RecordingError);
  CHECK(is_recording(folder / "c.jsf"));
  tests::write_text(folder / "d.csv", "t_s,x_m,y_m\n");
  CHECK_FALSE(is_recording(folder / "d.csv"));
}

TEST_CASE("XTF samples of every format are amplitudes") {
  CHECK(parse(one_ping_xtf<std::uint8_t>({1, 200}, 8)).front().starboard ==
        std::vector{1.0f, 200.0f});
  CHECK(parse(one_ping_xtf<std::uint16_t>({1, 40000}, 3)).front().starboard ==
        std::vector{1.0f, 40000.0f});
  CHECK(parse(one_ping_xtf<std::int16_t>({1, -40}, 3, true)).front().starboard ==
        std::vector{1.0f, 40.0f});
  CHECK(parse(one_ping_xtf<std::int32_t>({-70000}, 2, true)).front().starboard ==
        std::vector{70000.0f});
  for (const int format : {0, 2})
    CHECK(parse(one_ping_xtf<std::uint32_t>({3000000000}, format)).front().starboard ==
          std::vector{3e9f});
  CHECK(parse(one_ping_xtf<float>({0.5f, NAN}, 5)).front().starboard == std::vector{0.5f, 0.0f});
  CHECK_THAT(error_of(one_ping_xtf<float>({1.0f}, 1)),
             Catch::StartsWith("r: its samples have format 1, which is not supported"));
  // An old file has no format, but bytes per sample.
  CHECK(parse(one_ping_xtf<std::uint8_t>({3}, 0)).front().starboard == std::vector{3.0f});
  const RecordedLine line = parse(one_ping_xtf<std::uint16_t>({1, 2}, 0)).front();
  CHECK(line.starboard == std::vector{1.0f, 2.0f});
  CHECK(line.sound_speed_mps == 1500.0);
  CHECK(line.pings.front().range_m == Approx(75.0));
  CHECK_FALSE(line.pings.front().t_s);
  CHECK_FALSE(line.pings.front().place);
  CHECK_FALSE(line.pings.front().heading_rad);
  CHECK_FALSE(line.pings.front().altitude_m);
}

TEST_CASE("the headings in tables of recordings are those of a compass") {
  const auto heading_deg = std::ranges::find(ping_columns(), "heading_deg", &PingColumn::name);
  REQUIRE(heading_deg != ping_columns().end());
  RecordedPing ping;
  CHECK_FALSE(heading_deg->value(ping));
  for (const auto& [stated_deg, expected_deg] :
       {std::pair{-10.0, 350.0}, {370.0, 10.0}, {360.0, 0.0}, {90.0, 90.0}}) {
    ping.heading_rad = stated_deg * degree;
    CHECK(heading_deg->value(ping).value() == Approx(expected_deg).margin(1e-9));
  }
}

TEST_CASE("an XTF sample is scaled by its channel's weight") {
  std::string bytes = one_ping_xtf<std::uint16_t>({4, 40000}, 3);
  const auto samples = [&](std::int16_t weight) {
    put(bytes, 1024 + 256 + 58, weight);
    return parse(bytes).front().starboard;
  };
  CHECK(samples(2) == std::vector{1.0f, 10000.0f});
  CHECK(samples(-3) == std::vector{32.0f, 320000.0f});
  CHECK(samples(-9000) == std::vector{4.0f, 40000.0f});  // is no weight
}

TEST_CASE("an analytic JSF sample is the magnitude of its two numbers, scaled by the weight") {
  Recording written = tests::small_recording();
  written.starboard = false;
  std::string bytes = tests::as_text(encode_jsf({&written, 1}));
  bytes.resize(bytes.size() / 3);  // the first message: 5 samples
  const std::vector<std::int16_t> pairs = {3, 4, -6, 8, 0, -5, 0, 0, 30000, -30000};
  bytes.resize(16 + 240);
  bytes.append(reinterpret_cast<const char*>(pairs.data()), 2 * pairs.size());
  put<std::int32_t>(bytes, 12, 240 + 20);
  put<std::int16_t>(bytes, 16 + 34, 1);   // analytic
  put<std::int16_t>(bytes, 16 + 168, 1);  // 2^-1
  const RecordedLine line = parse(bytes).front();
  CHECK(line.port == std::vector{2.5f, 5.0f, 2.5f, 0.0f, std::sqrt(1.8e9f) / 2.0f});
}

TEST_CASE("the samples of a JSF that begin late lie at their ranges") {
  Recording written = tests::small_recording();
  written.starboard = false;
  std::string bytes = tests::as_text(encode_jsf({&written, 1}));
  bytes.resize(bytes.size() / 3);  // the first message
  const RecordedLine whole = parse(bytes).front();
  put<std::uint32_t>(bytes, 16 + 4, 3);  // the starting depth in samples
  const RecordedLine late = parse(bytes).front();
  CHECK(late.pings.front().unrecorded == 3);
  CHECK(late.samples == whole.samples + 3);
  CHECK(late.pings.front().range_m / static_cast<double>(late.samples) ==
        Approx(whole.pings.front().range_m / static_cast<double>(whole.samples)));
  CHECK(std::ranges::equal(std::span(late.port).subspan(3), whole.port));
  put<std::uint32_t>(bytes, 16 + 4, 0xffffffff);  // not used
  CHECK(parse(bytes).front().pings.front().unrecorded == 0);
}

TEST_CASE("an XTF whose samples lie in ground range gets a warning") {
  std::string bytes = one_ping_xtf<std::uint16_t>({1, 2, 3, 4}, 3);
  CHECK(parse(bytes).front().warnings.empty());
  put<std::uint16_t>(bytes, 256 + 2, 2);  // CorrectionFlags
  const RecordedLine line = parse(bytes).front();
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings.front(),
             Catch::StartsWith("r: states that its samples lie in ground range"));
}

TEST_CASE("a JSF's pulse length and speed have their smallest digits in one word") {
  const Recording written = tests::small_recording();
  std::string bytes = tests::as_text(encode_jsf({&written, 1}));
  put<std::uint16_t>(bytes, 16 + 18, 0xffff);  // of the sample interval and the course
  put<std::uint16_t>(bytes, 16 + 20, 0xc000 | 678 << 4 | 9);
  put<std::uint16_t>(bytes, 16 + 130, 12);
  put<std::int16_t>(bytes, 16 + 194, 43);
  const RecordedLine line = parse(bytes).front();
  CHECK(line.pulse_length_s == Approx(12.678e-3));
  CHECK(line.pings.front().speed_mps.value() == Approx(4.39 * 1852.0 / 3600.0));
}

TEST_CASE("a latitude beyond the poles and a longitude beyond a full turn are no place") {
  const Recording written = tests::small_recording();
  std::string jsf = tests::as_text(encode_jsf({&written, 1}));
  put<std::int32_t>(jsf, 16 + 84, 100 * 600000);  // 1e-4 arc minutes
  std::string xtf = tests::as_text(encode_xtf({&written, 1}));
  put<double>(xtf, 1024 + 160, 100.0);
  put<double>(xtf, 1024 + 128, 100.0);
  std::string far_jsf = tests::as_text(encode_jsf({&written, 1}));
  put<std::int32_t>(far_jsf, 16 + 80, 361 * 600000);
  std::string far_xtf = tests::as_text(encode_xtf({&written, 1}));
  put<double>(far_xtf, 1024 + 168, 361.0);
  put<double>(far_xtf, 1024 + 136, 361.0);
  for (const std::string* file : {&jsf, &xtf, &far_jsf, &far_xtf}) {
    const RecordedLine line = parse(*file).front();
    CHECK_FALSE(line.pings[0].place);
    CHECK(line.pings[1].place);
  }
}

TEST_CASE("positions of an XTF that are metres by its header and can only be degrees are degrees") {
  const auto line_of = [](double x, double y, double step) {
    const Recording written = tests::small_recording();
    std::string bytes = tests::as_text(encode_xtf({&written, 1}));
    put<std::uint16_t>(bytes, 164, 0);  // metres
    const std::size_t packet = (bytes.size() - 1024) / 3;
    for (std::size_t i = 0; i < 3; ++i) {
      put<double>(bytes, 1024 + i * packet + 160, y + step * static_cast<double>(i));
      put<double>(bytes, 1024 + i * packet + 168, x);
    }
    return parse(bytes).front();
  };
  const RecordedLine line = line_of(-69.0, 42.0, 1e-5);
  REQUIRE(line.pings[2].place);
  CHECK_FALSE(line.pings[2].place_m);
  CHECK(line.pings[2].place->latitude_rad == Approx(42.00002 * degree).epsilon(1e-12));
  CHECK(line.pings[2].place->longitude_rad == Approx(-69.0 * degree).epsilon(1e-12));
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings.front(), Catch::StartsWith("r: ") && Catch::Contains("degrees"));
  for (const RecordedLine& other : {line_of(-69.0, 42.0, 2.0), line_of(500000.0, 42.0, 1e-3)}) {
    CHECK(other.pings[2].place_m);
    CHECK(other.warnings.empty());
  }
}

TEST_CASE("positions of an XTF that are degrees by its header and can only be metres are metres") {
  const auto line_of = [](double x, double y, double last_y) {
    const Recording written = tests::small_recording();
    std::string bytes = tests::as_text(encode_xtf({&written, 1}));
    const std::size_t packet = (bytes.size() - 1024) / 3;
    for (std::size_t i = 0; i < 3; ++i)
      for (const std::size_t place : {128, 160}) {
        put<double>(bytes, 1024 + i * packet + place, i < 2 ? y : last_y);
        put<double>(bytes, 1024 + i * packet + place + 8, x);
      }
    return parse(bytes).front();
  };
  const RecordedLine line = line_of(500000.0, 6100000.0, 6100002.0);
  REQUIRE(line.pings[2].place_m);
  CHECK_FALSE(line.pings[2].place);
  CHECK(*line.pings[2].place_m == Eigen::Vector2d(500000.0, 6100002.0));
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings.front(), Catch::StartsWith("r: ") && Catch::Contains("metres"));
  // A damaged position among degrees, and one that is too small for a map's metres.
  for (const auto& [other, warning] :
       {std::pair{line_of(8.0, 54.0, 6100000.0),
                  "r: 1 pings state an impossible latitude or longitude; it is left out; the first "
                  "is ping 10, with latitude 6.1e+06, longitude 8"},
        {line_of(8.0, 100.0, 100.0),
         "r: 3 pings state an impossible latitude or longitude; it is left out; the first is ping "
         "7, with latitude 100, longitude 8"}}) {
    CHECK_FALSE(other.pings[2].place_m);
    CHECK_FALSE(other.pings[2].place);
    CHECK(other.warnings == std::vector<std::string>{warning});
  }
}

TEST_CASE("impossible places and angles of an XTF are left out and named") {
  const Recording written = tests::small_recording();
  const auto with = [&](auto&& alter) {
    std::string bytes = tests::as_text(encode_xtf({&written, 1}));
    const std::size_t packet = (bytes.size() - 1024) / 3;
    for (std::size_t i = 1; i < 3; ++i) alter(bytes, 1024 + i * packet);
    return parse(bytes).front();
  };
  RecordedLine line = with([](std::string& bytes, std::size_t at) {
    put<double>(bytes, at + 160, 129.5);
    put<double>(bytes, at + 128, 54.0);
    put<double>(bytes, at + 136, 8.0);
  });
  CHECK(line.pings[1].place.value().latitude_rad == Approx(54.0 * degree));
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0],
             Catch::StartsWith("r: 2 pings state an impossible place of the sonar; the ship's ") &&
                 Catch::EndsWith("ping 9, with latitude 129.5, longitude -10.5"));
  line = with([](std::string& bytes, std::size_t at) {
    for (const std::size_t place : {128, 160}) put<double>(bytes, at + place, 1e300);
  });
  CHECK(line.pings[0].place);
  CHECK_FALSE(line.pings[1].place);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings[0],
             Catch::StartsWith("r: 2 pings state an impossible place; it is left out;") &&
                 Catch::EndsWith("ping 9, with latitude 1e+300, longitude -10.5"));
  for (const auto& [offset, name] : {std::pair{std::size_t{204}, "pitch"},
                                     {208, "roll"},
                                     {212, "heading"},
                                     {124, "heading of the ship"}}) {
    line = with([offset = offset](std::string& bytes, std::size_t at) {
      put<float>(bytes, at + offset, 361.0f);
    });
    CHECK(line.warnings ==
          std::vector{fmt::format("r: 2 pings state an impossible {}; it is left out; the first is "
                                  "ping 9, with 361 degrees",
                                  name)});
    line = with([offset = offset](std::string& bytes, std::size_t at) {
      put<float>(bytes, at + offset, NAN);
    });
    CHECK(line.warnings.empty());  // that is how some recorders write what they do not know
  }
}

TEST_CASE("the gyro of the ship is read from an XTF") {
  std::string bytes = one_ping_xtf<std::uint16_t>({1, 2}, 3);
  CHECK_FALSE(parse(bytes).front().pings.front().gyro_rad);
  put<float>(bytes, 1024 + 124, 90.0f);
  CHECK(parse(bytes).front().pings.front().gyro_rad.value() == Approx(90.0 * degree));
}

TEST_CASE("times go on over midnight, and those that step back are counted") {
  const Recording written = tests::small_recording();
  constexpr int day_s = 86400;
  // The writer sorts its pings, so the times are put in afterwards.
  const auto with_times = [&](std::array<int, 3> times_s) {
    std::string bytes = tests::as_text(encode_xtf({&written, 1}));
    const std::size_t packet = (bytes.size() - 1024) / 3;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = 1024 + i * packet;
      put<std::uint16_t>(bytes, at + 14, 1970);
      const int fields[] = {1,  // January
                            1 + times_s[i] / day_s,
                            times_s[i] / 3600 % 24,
                            times_s[i] / 60 % 60,
                            times_s[i] % 60,
                            0};
      for (std::size_t k = 0; k < 6; ++k)
        put<std::uint8_t>(bytes, at + 16 + k, static_cast<std::uint8_t>(fields[k]));
    }
    return bytes;
  };
  for (const int late_s : {0, day_s}) {  // the date does not move, or a ping late
    const RecordedLine line = parse(with_times({day_s - 1, 1, 2 + late_s})).front();
    CHECK(line.pings[1].t_s.value() == day_s + 1);
    CHECK(line.pings[2].t_s.value() == day_s + 2);
    CHECK(line.warnings.empty());
  }
  const RecordedLine line = parse(with_times({5, 2, 6})).front();
  CHECK(line.pings[1].t_s.value() == 2);
  REQUIRE(line.warnings.size() == 1);
  CHECK_THAT(line.warnings.front(), Catch::StartsWith("r: 1 of 3 pings have times before"));
  const tests::TemporaryFolder folder;
  const std::vector<std::filesystem::path> files = {folder / "a.xtf", folder / "b.xtf"};
  tests::write_text(files[0], with_times({day_s - 1, 1, 2}));
  tests::write_text(files[1], with_times({3, 4, 5}));
  CHECK(read_recordings(files).front().pings[5].t_s.value() == day_s + 5);
}

TEST_CASE("a file that begins before the end of the file before it gets a warning") {
  const tests::TemporaryFolder folder;
  std::vector<std::filesystem::path> files = {folder / "a.xtf", folder / "b.xtf"};
  Recording written = tests::small_recording();
  for (const std::filesystem::path& file : files) {
    tests::write_text(file, tests::as_text(encode_xtf({&written, 1})));
    for (NavPing& ping : written.pings) ping.unix_ms += 3'600'000;
  }
  CHECK(read_recordings(files).front().warnings.empty());
  std::ranges::reverse(files);
  const std::vector<std::string> warnings = read_recordings(files).front().warnings;
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(),
             Catch::StartsWith(files[1].string() + ": begins before the end of the files before"));
}

TEST_CASE("the samples of an XTF that begin late lie at their ranges") {
  std::string bytes = one_ping_xtf<std::uint16_t>({1, 2, 3, 4}, 3);  // of 0.025 s each
  const auto samples = [&](double range_m) {
    const RecordedLine line = parse(bytes).front();
    CHECK(line.warnings.empty());
    CHECK(line.pings.front().samples == line.samples);
    CHECK(line.pings.front().range_m == Approx(range_m).epsilon(1e-6));
    const std::size_t unrecorded = line.pings.front().unrecorded;
    CHECK(std::ranges::equal(std::span(line.starboard).subspan(unrecorded),
                             std::vector<float>{1, 2, 3, 4}));
    CHECK(std::ranges::count(std::span(line.starboard).first(unrecorded), 0.0f) ==
          static_cast<std::ptrdiff_t>(unrecorded));
    return unrecorded;
  };
  const std::size_t delay = 1024 + 256 + 12, slant_range = 1024 + 256 + 4;
  CHECK(samples(75.0) == 0);
  put<float>(bytes, delay, 0.01f);  // less than half a sample
  CHECK(samples(75.0) == 0);
  put<float>(bytes, delay, 0.05f);
  CHECK(samples(112.5) == 2);
  put<float>(bytes, slant_range, 75.0f);  // of the data
  CHECK(samples(112.5) == 2);
  put<float>(bytes, slant_range, 112.5f);  // to the far edge: as delay and duration have it
  CHECK(samples(112.5) == 2);
  for (const float none : {-0.05f, NAN, INFINITY}) {
    put<float>(bytes, slant_range, 75.0f);
    put<float>(bytes, delay, none);
    CHECK(samples(75.0) == 0);
  }
  put<float>(bytes, delay, 0.5f);
  const RecordedLine doubtful = parse(bytes).front();
  CHECK(doubtful.pings.front().range_m == 75.0);
  REQUIRE(doubtful.warnings.size() == 1);
  CHECK_THAT(doubtful.warnings.front(),
             Catch::StartsWith("r: states that its samples begin 0.5 s after the transmission"));
}

TEST_CASE("what is no recording is refused, and says so") {
  CHECK(error_of("") == "r: is no recording, expected an XTF or a JSF file");
  CHECK(error_of("t_s,x_m\n0,0\n").starts_with("r: is no recording"));
  std::string empty(1024, '\0');
  put<std::uint8_t>(empty, 0, 123);
  put<std::uint16_t>(empty, 166, 2);
  CHECK(error_of(empty) ==
        "r: has no sidescan samples; it has sonar channels (2), expected a recording of a sidescan "
        "sonar");
  const tests::TemporaryFolder folder;
  CHECK_THROWS_AS(read_recording(folder / "nothing.xtf"), RecordingError);
  CHECK_THROWS_AS(read_recording(folder.path()), RecordingError);
}

TEST_CASE("the header of an XTF grows with its channels") {
  std::string bytes = one_ping_xtf(std::vector<std::uint8_t>{1, 2, 3}, 8);
  for (const std::uint16_t channels : {6, 7, 14}) {
    CAPTURE(channels);
    put<std::uint16_t>(bytes, 166, channels);
    std::string file = bytes;
    if (channels > 6) file.insert(1024, 1024, '\0');
    const RecordedLine line = parse(file).front();
    CHECK(line.warnings.empty());
    CHECK(line.starboard == std::vector{1.0f, 2.0f, 3.0f});
  }
}

TEST_CASE("damaged packets are left out, with a warning") {
  const Recording written = tests::small_recording();
  const std::string file = tests::as_text(encode_xtf({&written, 1}));
  const std::size_t packet = (file.size() - 1024) / 3;
  const std::string junk = file.substr(0, 1024 + packet) + "some junk" + file.substr(1024 + packet);
  RecordedLine line = parse(junk).front();
  CHECK(line.pings.size() == 3);
  CHECK(line.warnings ==
        std::vector<std::string>{"r: 9 bytes between its packets are no packet; skipped"});
  line = parse(file.substr(0, file.size() - 10)).front();
  CHECK(line.pings.size() == 2);
  CHECK(line.warnings == std::vector<std::string>{"r: its last packet is cut off; left out"});
}

TEST_CASE("a packet that states a wrong size loses itself alone") {
  Recording written = tests::small_recording();
  written.starboard = false;  // a JSF message is a ping
  for (const bool jsf : {false, true}) {
    const std::string file =
        tests::as_text(jsf ? encode_jsf({&written, 1}) : encode_xtf({&written, 1}));
    const std::size_t header = jsf ? 0 : 1024, packet = (file.size() - header) / 3;
    const RecordedLine sound = parse(file).front();
    REQUIRE(sound.pings.size() == 3);
    const auto expect_without = [&](const std::string& bytes, std::size_t ping,
                                    std::size_t skipped) {
      CAPTURE(ping);
      const RecordedLine line = parse(bytes).front();
      REQUIRE(line.pings.size() == 2);
      for (std::size_t i = 0; i < 2; ++i) {
        const std::size_t same = i + (i >= ping);
        CHECK(line.pings[i].number == sound.pings[same].number);
        CHECK(std::ranges::equal(line.row(Side::port, i), sound.row(Side::port, same)));
      }
      CHECK(line.warnings ==
            std::vector{
                fmt::format("r: {} bytes between its packets are no packet; skipped", skipped)});
    };
    for (const std::size_t ping : {0u, 1u})
      // Beyond the end of the file; into the middle of the last packet.
      for (const std::size_t size : {std::size_t{1} << 30, (2 - ping) * packet + packet / 2}) {
        CAPTURE(jsf, size);
        std::string bytes = file;
        const std::size_t at = header + ping * packet;
        put(bytes, at + (jsf ? 12 : 10), static_cast<std::uint32_t>(size));
        expect_without(bytes, ping, packet);
        // Its samples may look like packets, with a size that is too large or leads nowhere.
        for (const std::uint32_t false_size : {0x7fffffffu, std::uint32_t(packet) - 9}) {
          CAPTURE(false_size);
          std::string samples(16, '\0');
          put<std::uint16_t>(samples, 0, jsf ? 0x1601 : 0xFACE);
          put(samples, jsf ? 12 : 10, false_size);
          std::string longer = bytes;
          longer.insert(at + packet, samples);
          expect_without(longer, ping, packet + samples.size());
        }
      }
    // None follows the last one: it is cut off.
    std::string bytes = file;
    put(bytes, header + 2 * packet + (jsf ? 12 : 10), std::uint32_t{1} << 30);
    const RecordedLine line = parse(bytes).front();
    CHECK(line.pings.size() == 2);
    CHECK(line.warnings == std::vector<std::string>{"r: its last packet is cut off; left out"});
  }
}

TEST_CASE("bytes that all look like packets take a time in proportion to their number") {
  // As many beginnings of packets as there is room for, none of which ends well.
  constexpr std::size_t step = 16, packets = 300000;
  const std::string header = one_ping_xtf(std::vector<std::uint8_t>{1}, 8);
  std::string bytes = header + std::string(step * packets, '\0');
  for (std::size_t i = 0; i < packets; ++i) {
    const std::size_t at = header.size() + i * step;
    put<std::uint16_t>(bytes, at, 0xFACE);
    put(bytes, at + 10,
        static_cast<std::uint32_t>(i % 2 == 0 ? bytes.size() : bytes.size() / 2 + 1));
  }
  CHECK(parse(bytes).front().pings.size() == 1);
}

TEST_CASE("a ping that claims too many samples does not fill the memory") {
  // One ping of 3 million samples, and 3000 of one sample: their rows would take 9e9 values.
  std::string bytes = one_ping_xtf(std::vector<std::uint8_t>(3000000), 8);
  const std::string one = one_ping_xtf(std::vector<std::uint8_t>(1), 8).substr(1024);
  for (std::uint32_t number = 1; number <= 3000; ++number) {
    const std::size_t at = bytes.size();
    bytes += one;
    put(bytes, at + 28, number);
  }
  CHECK(error_of(bytes).starts_with(
      "r: the longest ping has 3000000 samples, but all 3001 pings together have"));
}

TEST_CASE("no damage to a recording does more than an error") {
  std::mt19937 random(1);
  for (const bool jsf : {false, true}) {
    const Recording written = tests::small_recording();
    const std::string sound =
        tests::as_text(jsf ? encode_jsf({&written, 1}) : encode_xtf({&written, 1}));
    for (std::size_t size = 0; size < sound.size(); size += 13) error_of(sound.substr(0, size));
    for (int i = 0; i < 3000; ++i) {
      std::string damaged = sound;
      for (int k = 0; k < 3; ++k)
        damaged[random() % damaged.size()] = static_cast<char>(random() % 3 ? random() : 255);
      try {
        for (const RecordedLine& line : parse(damaged)) {
          for (const Side side : {Side::port, Side::starboard}) {
            const std::vector<float>& samples = line.side(side);
            REQUIRE((samples.empty() || samples.size() == line.pings.size() * line.samples));
            REQUIRE(
                std::ranges::all_of(samples, [](float a) { return std::isfinite(a) && a >= 0; }));
          }
          for (const RecordedPing& ping : line.pings)
            for (const PingColumn& column : ping_columns())
              if (const auto value = column.value(ping)) REQUIRE(std::isfinite(*value));
        }
      } catch (const RecordingError&) {
      }
    }
  }
}

TEST_CASE("real recordings are read whole") {
  const auto scotsman = tests::data_file("sidescan/scotsman-iver2.xtf");
  const auto river = tests::data_file("sidescan/river-1236.xtf");
  const auto navigation = tests::data_file("nav/scotsman_iver2_nav.csv");
  if (!scotsman || !river || !navigation) {
    WARN("skipped: the recordings are not there");
    return;
  }
  RecordedLine line = read_recording(*scotsman).front();
  CHECK(line.warnings.empty());
  CHECK(line.pings.size() == 461);
  CHECK(line.samples == 1024);
  CHECK(line.frequency_hz == 600e3);
  CHECK(line.sound_speed_mps == 1500.0);
  CHECK_FALSE(line.pings.front().place);  // the first ping has no navigation
  // Near to far: the water column is dark, on both sides.
  for (const Side side : {Side::port, Side::starboard}) {
    double near = 0.0, far = 0.0;
    for (std::size_t ping = 0; ping < line.pings.size(); ++ping)
      for (std::size_t bin = 0; bin < 50; ++bin) {
        near += line.row(side, ping)[50 + bin];
        far += line.row(side, ping)[500 + bin];
      }
    CHECK(far > 3.0 * near);
  }
  // Its navigation, as another program extracted it: ping,utc_s,lat,lon,kn,depth,altitude,...
  std::ifstream rows(*navigation);
  std::string row;
  std::size_t compared = 0;
  while (std::getline(rows, row)) {
    double n, t, lat, lon, kn, depth, altitude, pitch, roll, heading;
    if (std::sscanf(row.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &n, &t, &lat, &lon, &kn,
                    &depth, &altitude, &pitch, &roll, &heading) != 10)
      continue;
    const RecordedPing& ping = line.pings.at(static_cast<std::size_t>(n));
    ++compared;
    CHECK(std::fmod(ping.t_s.value(), 86400.0) == Approx(t).epsilon(0).margin(0.006));
    CHECK(ping.place.value().latitude_rad == Approx(lat * degree).epsilon(0).margin(1e-9));
    CHECK(ping.place.value().longitude_rad == Approx(lon * degree).epsilon(0).margin(1e-9));
    CHECK(ping.depth_m.value() == Approx(depth));
    CHECK(ping.altitude_m.value() == Approx(altitude));
    CHECK(ping.pitch_rad.value() == Approx(pitch * degree).epsilon(0).margin(1e-4));
    CHECK(ping.roll_rad.value() == Approx(roll * degree).epsilon(0).margin(1e-4));
    CHECK(ping.heading_rad.value() == Approx(heading * degree).epsilon(0).margin(1e-3));
  }
  CHECK(compared == 460);

  line = read_recording(*river).front();
  CHECK(line.pings.size() == 1446);
  CHECK(line.samples == 512);
  CHECK(line.pings[700].range_m == Approx(36.74).epsilon(1e-3));
  CHECK_FALSE(line.pings[700].altitude_m);
}
