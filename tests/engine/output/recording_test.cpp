#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/at.h"
#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/output/xtf.h>

using namespace ensonify::engine;
using ensonify::tests::at;

namespace {

std::string text_at(const std::vector<std::byte>& bytes, std::size_t offset, std::size_t width) {
  std::string text(reinterpret_cast<const char*>(bytes.data()) + offset, width);
  return text.substr(0, text.find('\0'));
}

/// A line towards the north-east in shallow water; each sample numbers its ping, side and bin.
Waterfall sample_line(std::size_t pings, int bins = 50) {
  Sonar sonar;
  sonar.name = "towfish";
  sonar.bins = bins;
  sonar.range_m = 40.0;
  sonar.frequency_hz = 900e3;
  sonar.pulse = {.kind = PulseKind::lfm, .bandwidth_hz = 60e3, .length_s = 2.345e-3};
  Waterfall line(sonar, pings);
  for (std::size_t ping = 0; ping < pings; ++ping) {
    EchoLine sides[2];
    for (const Sector& sector : sidescan_sectors) {
      EchoLine& echo = sides[sector.number == 1];
      echo.sector = sector.number;
      echo.bins.assign(static_cast<std::size_t>(bins));
      for (int bin = 0; bin < bins; ++bin) {
        const auto b = static_cast<std::size_t>(bin);
        const auto range_m = static_cast<float>((bin + 0.5) * sonar.bin_m());
        echo.bins.range_m[b] = range_m;
        echo.bins.region[b] = static_cast<std::uint32_t>(Region::seabed);
        const float amplitude =
            static_cast<float>(1 + bin + (sector.number == 1 ? 100 : 0) + ping % 7);
        echo.bins.sample[b] = static_cast<std::uint32_t>(100.0f * amplitude);
      }
    }
    PingRow record;
    record.pose.t_s = 0.05 * static_cast<double>(ping);
    record.pose.velocity_mps = {1.0, 1.0, 0.0};
    record.reported = record.pose;
    record.reported.position = {100.0 + 0.05 * static_cast<double>(ping), 200.0, -12.5};
    record.reported.heading_rad = -45.0 * degree;
    record.reported.pitch_rad = 2.0 * degree;
    record.reported.roll_rad = -3.0 * degree;
    record.altitude_m = 7.25;
    if (pings > 1) record.interval_s = 0.05;
    line.set_row(ping, sides, record);
  }
  return line;
}

RecordingFrame sample_frame() {
  return {.origin = GeographicPlace{55.0 * degree, 10.0 * degree},
          .start_time = "2024-02-29T23:59:59Z",
          .sound_speed_mps = 1480.0,
          // A bed that rises to the north.
          .altitude_m = [](const Eigen::Vector3d& at) { return 7.25 + at.z() - 0.1 * at.y(); }};
}

/// The received level at full scale is 160 dB at 1 m and falls by 40 dB per factor of ten in range.
std::vector<FullScale> sample_levels(int beams = 1) {
  const Recorder recorder(ReceiverOptions{}, 0.8, 50, 0.0, -160.0);
  return std::vector<FullScale>(static_cast<std::size_t>(beams), FullScale::of(recorder.gains()));
}

}  // namespace

TEST_CASE("a start time is a valid calendar date and time, and other texts are refused") {
  CHECK(unix_time("1970-01-01T00:00:00Z") == 0);
  CHECK(unix_time("2024-02-29T23:59:59Z") == 1709251199);
  for (const char* wrong : {"", "2023-02-29T00:00:00Z", "2024-13-01T00:00:00Z",
                            "2024-01-01T24:00:00Z", "2024-01-01 00:00:00Z", "2024-01-01T00:00:00"})
    CHECK(!unix_time(wrong));
}

TEST_CASE("each beam of a ping is a ping of a recording, with its place and, in XTF, its number") {
  Sonar sonar;
  sonar.bins = 10;
  sonar.beams = 3;
  sonar.beam_spacing_m = 0.5;
  sonar.mounting.forward_m = 2.0;
  Waterfall line(sonar, 2, 4);
  std::vector<EchoLine> lines(6);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i].sector = i % 2;
    lines[i].bins.assign(10);
  }
  PingRow record;
  record.interval_s = 0.1;
  for (const std::size_t ping : {0u, 1u}) {
    record.pose.t_s = 0.1 * static_cast<double>(ping);
    record.reported.velocity_mps = {0.0, 15.0, 0.0};
    record.pose.position =
        record.reported.position = {0.0, 10.0 + 1.5 * static_cast<double>(ping), -5.0};
    CHECK(line.set_ping(ping, lines, record).empty());
  }
  std::vector<FullScale> levels = sample_levels(3);
  levels[2].near_db += 7.0;  // an outer beam gets less sound near the sonar
  const Recording recording = make_recording(line, levels, sample_frame());
  REQUIRE(recording.pings.size() == 6);
  const std::vector<std::byte> file = encode_xtf({&recording, 1});
  const std::size_t packet = (file.size() - 1024) / 6;
  for (std::size_t row = 0; row < 6; ++row) {
    CAPTURE(row);
    const NavPing& ping = recording.pings[row];
    CHECK(ping.number == 12 + row);
    CHECK(ping.beam == static_cast<int>(row % 3));
    CHECK(ping.unix_ms == recording.pings[row / 3 * 3].unix_ms);
    const double north_m = (ping.place.latitude_rad - 55.0 * degree) * 6.37e6;
    CHECK(north_m == Approx(11.5 + 0.5 * static_cast<double>(row)).epsilon(0.01));
    CHECK(at<std::uint32_t>(file, 1024 + packet * row + 28) == 12 + row);
    CHECK(at<std::uint8_t>(file, 1024 + packet * row + 3) == row % 3);
    const std::size_t channel = 1024 + packet * row + 256;
    CHECK(at<std::uint16_t>(file, channel + 28) == std::lround(levels[row % 3].near_db));
    CHECK(at<float>(file, channel + 54) == Approx(50.0));  // cm of the track per row
  }
}

TEST_CASE("an XTF follows its format description byte by byte") {
  for (const std::size_t pings : {std::size_t{1}, std::size_t{2}, std::size_t{1000}}) {
    CAPTURE(pings);
    const Waterfall line = sample_line(pings);
    const Recording recording = make_recording(line, sample_levels(), sample_frame());
    const std::vector<std::byte> file = encode_xtf({&recording, 1});

    CHECK(at<std::uint8_t>(file, 0) == 123);
    CHECK(at<std::uint8_t>(file, 1) == 1);
    CHECK(text_at(file, 2, 8) == "ensonif");  // seven letters and the final zero
    CHECK(text_at(file, 18, 16) == "towfish");
    CHECK(text_at(file, 36, 64).starts_with("ensonify "));
    CHECK(at<std::uint16_t>(file, 34) == 0);
    CHECK(text_at(file, 100, 64) == "towfish.xtf");
    CHECK(at<std::uint16_t>(file, 164) == 3);
    CHECK(at<std::uint16_t>(file, 166) == 2);
    for (const std::size_t k : {0u, 1u}) {
      const std::size_t channel = 256 + 128 * k;
      CHECK(at<std::uint8_t>(file, channel) == k + 1);
      CHECK(at<std::uint8_t>(file, channel + 1) == k);
      CHECK(at<std::uint16_t>(file, channel + 2) == 1);
      CHECK(at<std::uint16_t>(file, channel + 4) == 1);
      CHECK(at<std::uint16_t>(file, channel + 6) == 2);
      CHECK(at<std::uint32_t>(file, channel + 8) == 50);
      CHECK(text_at(file, channel + 12, 16) == (k == 0 ? "port" : "starboard"));
      CHECK(at<float>(file, channel + 32) == 900.0f);
      CHECK(at<std::uint8_t>(file, channel + 74) == 3);
    }

    std::size_t packet = 1024, count = 0;
    std::int64_t last_time = 0;
    for (; packet < file.size(); ++count) {
      REQUIRE(at<std::uint16_t>(file, packet) == 0xFACE);
      CHECK(at<std::uint8_t>(file, packet + 2) == 0);
      CHECK(at<std::uint16_t>(file, packet + 4) == 2);
      const auto size = at<std::uint32_t>(file, packet + 10);
      CHECK(size % 64 == 0);
      CHECK(size >= 256 + 2 * (64 + 2 * 50));
      CHECK(size < 256 + 2 * (64 + 2 * 50) + 64);
      CHECK(at<std::uint32_t>(file, packet + 28) == count);

      const int year = at<std::uint16_t>(file, packet + 14),
                month = at<std::uint8_t>(file, packet + 16),
                day = at<std::uint8_t>(file, packet + 17);
      const int hour = at<std::uint8_t>(file, packet + 18),
                minute = at<std::uint8_t>(file, packet + 19),
                second = at<std::uint8_t>(file, packet + 20);
      const int hundredths = at<std::uint8_t>(file, packet + 21),
                day_of_year = at<std::uint16_t>(file, packet + 22);
      const double t_s = 0.05 * static_cast<double>(count);
      if (t_s < 1.0) {
        CHECK((year == 2024 && month == 2 && day == 29 && day_of_year == 60));
        CHECK((hour == 23 && minute == 59 && second == 59));
      } else {
        CHECK((year == 2024 && month == 3 && day == 1 && day_of_year == 61));
      }
      const std::int64_t time =
          ((((day_of_year * 24 + hour) * 60 + minute) * 60) + second) * 100 + hundredths;
      CHECK(time >= last_time);
      CHECK(std::abs(double(time) / 100.0 - (60 * 86400.0 + 86399.0 + t_s)) < 0.011);
      last_time = time;
      CHECK(hundredths < 100);

      CHECK(at<float>(file, packet + 32) == 740.0f);  // half the sound speed
      CHECK(at<float>(file, packet + 72) == 1480.0f);
      CHECK(at<float>(file, packet + 152) == Approx(std::sqrt(2.0) * 3600.0 / 1852.0));
      // By the radii of curvature at 55 degrees: 111.315 km and 63.994 km per degree.
      CHECK(at<double>(file, packet + 160) == Approx(55.0 + 0.2 / 111.315).margin(2e-7));
      CHECK(at<double>(file, packet + 168) ==
            Approx(10.0 + (0.1 + 0.00005 * double(count)) / 63.994).margin(4e-7));
      CHECK(at<float>(file, packet + 192) == 12.5f);
      CHECK(at<float>(file, packet + 196) == 7.25f);
      CHECK(at<float>(file, packet + 204) == Approx(2.0));
      CHECK(at<float>(file, packet + 208) == Approx(-3.0));
      CHECK(at<float>(file, packet + 212) == Approx(315.0));

      const std::size_t one = packet + 256, two = one + 64 + 100;
      for (const std::size_t header : {one, two}) {
        CHECK(at<std::uint16_t>(file, header) == (header == two));
        CHECK(at<float>(file, header + 4) == 40.0f);
        CHECK(at<float>(file, header + 16) == Approx(80.0 / 1480.0));
        CHECK(at<float>(file, header + 20) == Approx(80.0 / 1480.0));
        CHECK(at<std::uint16_t>(file, header + 26) == 900);
        // Full scale in the first bin (0.8 m, where the gain is constant) and in the last.
        CHECK(at<std::uint16_t>(file, header + 28) == std::lround(160.0 - 40.0 * std::log10(0.8)));
        CHECK(at<std::uint16_t>(file, header + 30) == std::lround(160.0 - 40.0 * std::log10(39.6)));
        CHECK(at<std::uint16_t>(file, header + 32) == 60);  // kHz of bandwidth
        // 0.05 s between pings.
        CHECK(at<float>(file, header + 54) ==
              Approx(pings > 1 ? 100.0 * std::sqrt(2.0) * 0.05 : 0.0).margin(1e-6));
        CHECK(at<std::uint32_t>(file, header + 42) == 50);
        CHECK(at<std::int16_t>(file, header + 58) == 0);
      }
      // Port from far to near, starboard from near to far; amplitudes grow with the bin.
      const double unit = at<std::uint16_t>(file, two + 64) / double(101 + count % 7);
      for (const std::size_t i : {std::size_t{0}, std::size_t{17}, std::size_t{49}}) {
        CHECK(std::abs(at<std::uint16_t>(file, one + 64 + 2 * i) -
                       unit * double(50 - i + count % 7)) < 1.5);
        CHECK(std::abs(at<std::uint16_t>(file, two + 64 + 2 * i) -
                       unit * double(101 + i + count % 7)) < 1.5);
        CHECK(at<std::uint16_t>(file, two + 64 + 2 * i) <= 32767);
      }
      packet += size;
    }
    CHECK(packet == file.size());
    CHECK(count == pings);
  }
}

TEST_CASE("the level at full scale falls by what each ping's gain is over the usual one") {
  Waterfall line = sample_line(2);
  line.pings[1].lines[0].gain = 10.0;  // port, starboard: 20 dB either way
  line.pings[1].lines[1].gain = 0.1;
  const std::vector<Recording> recording{make_recording(line, sample_levels(), sample_frame())};
  const std::vector<std::byte> xtf = encode_xtf(recording), jsf = encode_jsf(recording);
  const int near_db = static_cast<int>(std::lround(160.0 - 40.0 * std::log10(0.8)));
  const int far_db = static_cast<int>(std::lround(160.0 - 40.0 * std::log10(39.6)));
  const auto packet = at<std::uint32_t>(xtf, 1024 + 10);
  const int gain_db[2][2] = {{0, 0}, {20, -20}};
  for (const std::size_t ping : {0u, 1u})
    for (const std::size_t side : {0u, 1u}) {
      CAPTURE(ping, side);
      const std::size_t header = 1024 + ping * packet + 256 + side * (64 + 100);
      CHECK(at<std::uint16_t>(xtf, header + 28) == near_db - gain_db[ping][side]);
      CHECK(at<std::uint16_t>(xtf, header + 30) == far_db - gain_db[ping][side]);
      const std::string text = "full scale " + std::to_string(near_db - gain_db[ping][side]) +
                               ".." + std::to_string(far_db - gain_db[ping][side]) + " dB";
      const std::string whole(reinterpret_cast<const char*>(jsf.data()), jsf.size());
      CHECK(whole.find(text) != std::string::npos);
    }
}

TEST_CASE("a JSF follows its format description byte by byte") {
  for (const std::size_t pings : {std::size_t{1}, std::size_t{2}, std::size_t{1000}}) {
    CAPTURE(pings);
    const Waterfall line = sample_line(pings);
    const Recording recording = make_recording(line, sample_levels(), sample_frame());
    const std::vector<std::byte> file = encode_jsf({&recording, 1});
    std::size_t message = 0, count = 0;
    for (; message < file.size(); ++count) {
      const std::size_t ping = count / 2;
      const bool starboard = count % 2 == 1;
      REQUIRE(at<std::uint16_t>(file, message) == 0x1601);
      CHECK(at<std::uint8_t>(file, message + 2) == 0x0D);
      CHECK(at<std::uint16_t>(file, message + 4) == 80);
      CHECK(at<std::uint8_t>(file, message + 7) == 20);
      CHECK(at<std::uint8_t>(file, message + 8) == starboard);
      const auto size = at<std::int32_t>(file, message + 12);
      REQUIRE(size == 240 + 2 * 50);
      const std::size_t h = message + 16;
      const std::int64_t ms = 1709251199000 + 50 * static_cast<std::int64_t>(ping);
      CHECK(at<std::int32_t>(file, h) == ms / 1000);
      CHECK(at<std::uint32_t>(file, h + 8) == ping);
      CHECK(at<std::int16_t>(file, h + 28) == 1);
      // Position, speed, heading, attitude, altitude, depth, annotation; and the position is the
      // sonar's own.
      CHECK((at<std::uint16_t>(file, h + 30) & 0x266d) == 0x266d);
      CHECK(at<std::int16_t>(file, h + 34) == 0);
      CHECK(at<std::int32_t>(file, h + 80) ==
            Approx((10.0 + (0.1 + 0.00005 * double(ping)) / 63.994) * 600000.0).margin(1.0));
      CHECK(at<std::int32_t>(file, h + 84) ==
            Approx((55.0 + 0.2 / 111.315) * 600000.0).margin(1.0));
      CHECK(at<std::int16_t>(file, h + 88) == 2);
      CHECK(at<std::uint16_t>(file, h + 114) == 50);
      CHECK(at<std::uint32_t>(file, h + 116) == std::llround(2.0 * 0.8 / 1480.0 * 1e9));
      // 870 to 930 kHz in 10 Hz take 17 bits: the upper ones are in the word at 16.
      const int more = at<std::uint16_t>(file, h + 16);
      CHECK(at<std::uint16_t>(file, h + 126) + ((more & 0xf) << 16) == 87000);
      CHECK(at<std::uint16_t>(file, h + 128) + ((more >> 4 & 0xf) << 16) == 93000);
      CHECK((more >> 8 & 0xf) == 0);
      // A pulse of 2.345 ms and a speed of 2.75 knots: microseconds and hundredths are at 20.
      // The word at 18 has fractions of the sample interval and the course.
      CHECK(at<std::uint16_t>(file, h + 130) == 2);
      CHECK(at<std::uint16_t>(file, h + 20) == (345 << 4 | 5));
      CHECK(at<std::uint16_t>(file, h + 18) == 0);
      CHECK(at<std::uint16_t>(file, h + 140) == std::lround(1480.0 / 1.6));  // samples per second
      // Full scale in the first bin (0.8 m, where the gain is constant) and in the last.
      CHECK(text_at(file, h + 90, 24) ==
            "full scale " + std::to_string(std::lround(160.0 - 40.0 * std::log10(0.8))) + ".." +
                std::to_string(std::lround(160.0 - 40.0 * std::log10(39.6))) + " dB");
      CHECK(at<std::uint16_t>(file, h + 120) == 1);
      CHECK(at<std::int16_t>(file, h + 122) == 100);
      // The range takes 54 ms, so two pulses are in the water when a ping is sent every 50 ms.
      CHECK(at<std::int16_t>(file, h + 170) == (pings > 1 ? 2 : 1));
      CHECK(at<std::uint16_t>(file, h + 204) == 100 * (50 + 100 * starboard + ping % 7));
      CHECK(at<float>(file, h + 152) == 900e3f);
      CHECK(at<std::int16_t>(file, h + 194) * 0.1 +
                (at<std::uint16_t>(file, h + 20) & 0xf) * 0.01 ==
            Approx(std::sqrt(2.0) * 3600.0 / 1852.0).margin(0.005));
      CHECK(at<std::int32_t>(file, h + 136) == 12500);
      CHECK(at<std::int32_t>(file, h + 144) == 7250);
      CHECK(at<float>(file, h + 148) == 1480.0f);
      const bool next_day = ms >= 1709251200000;
      CHECK(at<std::int16_t>(file, h + 156) == 2024);
      CHECK(at<std::int16_t>(file, h + 158) == (next_day ? 61 : 60));
      CHECK(at<std::int16_t>(file, h + 160) == (next_day ? 0 : 23));
      CHECK(at<std::uint32_t>(file, h + 200) ==
            static_cast<std::uint32_t>(ms - (next_day ? 1709251200000 : 1709164800000)));
      CHECK(at<std::int16_t>(file, h + 168) == 0);
      CHECK(at<std::uint16_t>(file, h + 172) == 31500);
      CHECK(at<std::int16_t>(file, h + 174) == std::lround(2.0 * 32768 / 180));
      CHECK(at<std::int16_t>(file, h + 176) == std::lround(-3.0 * 32768 / 180));
      // Both sides from near to far.
      CHECK(at<std::int16_t>(file, h + 240) < at<std::int16_t>(file, h + 240 + 98));
      CHECK(at<std::int16_t>(file, h + 240) > 0);
      message += 16 + static_cast<std::size_t>(size);
    }
    CHECK(message == file.size());
    CHECK(count == 2 * pings);
  }
}

TEST_CASE("what the fields of a JSF cannot hold is refused") {
  const Recording whole = make_recording(sample_line(2), sample_levels(), sample_frame());
  Recording late = whole;
  late.pings[1].unix_ms = 2'150'000'000'000;  // in 2038
  CHECK_THROWS_WITH(encode_jsf({&late, 1}), Catch::Contains("output.start_time"));
  Recording slow = whole;
  slow.range_m = 4000.0 * static_cast<double>(slow.bins);
  CHECK_THROWS_WITH(encode_jsf({&slow, 1}), Catch::Contains("use more bins"));
}

TEST_CASE("texts that are too long for an XTF field are cut, and end with a zero") {
  Waterfall line = sample_line(1);
  line.sonar.name = std::string(80, 'n');
  const Recording recording = make_recording(line, sample_levels(), sample_frame());
  const std::vector<std::byte> file = encode_xtf({&recording, 1});
  for (const auto& [begin, width] : {std::pair{2, 8}, {10, 8}, {18, 16}, {36, 64}, {100, 64}}) {
    CAPTURE(begin);
    CHECK(at<char>(file, static_cast<std::size_t>(begin)) != 0);
    CHECK(at<char>(file, static_cast<std::size_t>(begin + width - 1)) == 0);
  }
  CHECK(text_at(file, 18, 16) == std::string(15, 'n'));
}

TEST_CASE("a recording has the sonar's position and attitude, not the vehicle's") {
  Waterfall line = sample_line(1);
  line.sonar.mounting = {.forward_m = 6.0, .starboard_m = 2.0, .down_m = 1.0};
  PingRow& ping = line.pings.front();
  ping.reported.roll_rad = ping.reported.pitch_rad = 0.0;
  ping.reported.heading_rad = 90.0 * degree;  // the bow to the east
  ping.reported.heading_rate_radps = 0.5;
  ping.pose.heading_rad =
      0.0;  // in truth to the north, where the bed is 0.6 m higher below the bow
  const auto recorded = [&] {
    return make_recording(line, sample_levels(), sample_frame()).pings.front();
  };
  NavPing there = recorded();
  CHECK(there.place.longitude_rad / degree == Approx(10.0 + 0.106 / 63.994).margin(4e-7));
  CHECK(there.place.latitude_rad / degree == Approx(55.0 + 0.198 / 111.315).margin(2e-7));
  CHECK(there.depth_m == Approx(13.5));
  CHECK(there.altitude_m == Approx(7.25 - 1.0 - 0.6));
  // Headings count from true north at the place. There the meridians have converged by the
  // difference of longitude times the sine of the latitude.
  const auto north_deg = [&] {
    return (there.place.longitude_rad / degree - 10.0) * std::sin(there.place.latitude_rad);
  };
  CHECK(there.heading_rad / degree == Approx(90.0 + north_deg()).epsilon(1e-9));
  CHECK(there.speed_mps == Approx(std::hypot(1.0 - 0.5 * 2.0, 1.0 - 0.5 * 6.0)));  // it turns

  // The array lies athwart: the vehicle's roll is the sonar's pitch.
  line.sonar.mounting = {.azimuth_rad = -90.0 * degree};
  ping.reported.roll_rad = 3.0 * degree;
  there = recorded();
  CHECK(there.heading_rad / degree == Approx(north_deg()).margin(1e-6));
  CHECK(there.pitch_rad / degree == Approx(3.0));
  CHECK(there.roll_rad / degree == Approx(0.0).margin(1e-9));
  line.sonar.mounting = {.pitch_rad = 20.0 * degree};
  ping.reported.roll_rad = 0.0;
  ping.reported.pitch_rad = 5.0 * degree;
  CHECK(recorded().pitch_rad / degree == Approx(25.0));
}

TEST_CASE("a ping that was not recorded leaves a gap in the numbers") {
  Waterfall line = sample_line(6);
  for (const std::size_t lost : {0u, 1u, 3u}) line.pings[lost].recorded = false;
  const Recording recording = make_recording(line, sample_levels(), sample_frame());
  const std::vector<std::byte> xtf = encode_xtf({&recording, 1}), jsf = encode_jsf({&recording, 1});
  const std::size_t packet = 640, message = 16 + 240 + 100;  // 256 + 2 (64 + 100), in whole 64 B
  REQUIRE(xtf.size() == 1024 + 3 * packet);
  REQUIRE(jsf.size() == 6 * message);
  std::size_t i = 0;
  for (const std::size_t number : {2u, 4u, 5u}) {
    CAPTURE(number);
    const std::size_t begin = 1024 + i * packet;
    CHECK(at<std::uint32_t>(xtf, begin + 28) == number);
    CHECK(at<std::uint16_t>(xtf, begin + 256 + 64 + 100 + 64) == 100 * (101 + number % 7));
    for (const std::size_t side : {0u, 1u}) {
      const std::size_t h = (2 * i + side) * message + 16;
      CHECK(at<std::uint32_t>(jsf, h + 8) == number);
      CHECK(at<std::uint16_t>(jsf, h + 240) == 100 * (1 + 100 * side + number % 7));
    }
    ++i;
  }

  for (PingRow& ping : line.pings) ping.recorded = false;
  const Recording nothing = make_recording(line, sample_levels(), sample_frame());
  CHECK(encode_xtf({&nothing, 1}).size() == 1024);
  CHECK(encode_jsf({&nothing, 1}).empty());
}

TEST_CASE("several sonars are in one XTF or JSF, those of one mounting in one packet") {
  std::vector<Recording> sonars;
  for (const int rank : {0, 1, 2}) {
    Waterfall line = sample_line(4, 50 + 10 * rank);
    line.pings[1].recorded = false;
    line.sonar.name = "sonar" + std::to_string(rank);
    line.sonar.frequency_hz = 100e3 * (1 + rank);
    if (rank == 1) line.sonar.mounting.down_m = 2.0;
    RecordingFrame frame = sample_frame();
    frame.frequency_rank = rank;
    sonars.push_back(make_recording(line, sample_levels(), frame));
  }
  const std::vector<std::byte> xtf = encode_xtf(sonars), jsf = encode_jsf(sonars);
  // 2 m below the vehicle, which is pitched by 2 and rolled by 3 degrees.
  const double lower_m = 12.5 + 2.0 * std::cos(2.0 * degree) * std::cos(3.0 * degree);

  CHECK(at<std::uint16_t>(xtf, 166) == 6);
  for (const std::size_t k : {0u, 1u, 2u, 3u, 4u, 5u}) {
    const std::size_t channel = 256 + 128 * k;
    CHECK(at<std::uint8_t>(xtf, channel) == k % 2 + 1);
    CHECK(at<std::uint8_t>(xtf, channel + 1) == k);
    const auto sonar = k / 2;
    CHECK(at<std::uint32_t>(xtf, channel + 8) == 50 + 10 * sonar);
    CHECK(text_at(xtf, channel + 12, 16) == sonars[sonar].name);
    CHECK(at<float>(xtf, channel + 32) == 100.0f * static_cast<float>(1 + sonar));
  }
  std::size_t packet = 1024;
  for (const std::size_t number : {0u, 2u, 3u})
    for (const std::vector<std::size_t>& group :
         {std::vector<std::size_t>{0, 2}, std::vector<std::size_t>{1}}) {
      CAPTURE(number, group);
      REQUIRE(at<std::uint16_t>(xtf, packet) == 0xFACE);
      REQUIRE(at<std::uint16_t>(xtf, packet + 4) == 2 * group.size());
      CHECK(at<std::uint32_t>(xtf, packet + 28) == number);
      CHECK(at<float>(xtf, packet + 192) == Approx(group.front() == 1 ? lower_m : 12.5));
      CHECK(at<float>(xtf, packet + 196) == (group.front() == 1 ? 5.25f : 7.25f));
      std::size_t channel = packet + 256;
      for (const std::size_t k : group)
        for (const std::size_t side : {0u, 1u}) {
          const std::size_t bins = 50 + 10 * k;
          CHECK(at<std::uint16_t>(xtf, channel) == 2 * k + side);
          CHECK(at<std::uint16_t>(xtf, channel + 26) == 100 * (1 + k));
          REQUIRE(at<std::uint32_t>(xtf, channel + 42) == bins);
          const std::size_t nearest = side == 0 ? bins - 1 : 0;
          CHECK(at<std::uint16_t>(xtf, channel + 64 + 2 * nearest) ==
                100 * (1 + 100 * side + number % 7));
          channel += 64 + 2 * bins;
        }
      packet += at<std::uint32_t>(xtf, packet + 10);
      CHECK(packet >= channel);
    }
  CHECK(packet == xtf.size());

  std::size_t message = 0;
  for (const std::size_t number : {0u, 2u, 3u})
    for (const std::size_t k : {0u, 1u, 2u})
      for (const std::size_t side : {0u, 1u}) {
        CAPTURE(number, k, side);
        const std::size_t h = message + 16;
        CHECK(int(at<std::uint8_t>(jsf, message + 7)) == 20 + static_cast<int>(k));
        CHECK(at<std::uint8_t>(jsf, message + 8) == side);
        CHECK(at<std::uint32_t>(jsf, h + 8) == number);
        CHECK(at<std::int32_t>(jsf, h + 136) == std::lround(1000.0 * (k == 1 ? lower_m : 12.5)));
        CHECK(at<float>(jsf, h + 152) == 100e3f * static_cast<float>(1 + k));
        REQUIRE(at<std::uint16_t>(jsf, h + 114) == 50 + 10 * k);
        CHECK(at<std::uint16_t>(jsf, h + 240) == 100 * (1 + 100 * side + number % 7));
        message += 16 + static_cast<std::size_t>(at<std::int32_t>(jsf, message + 12));
      }
  CHECK(message == jsf.size());

  sonars.push_back(sonars.front());
  CHECK_THROWS_AS(encode_xtf(sonars), std::invalid_argument);
  CHECK_THROWS_AS(encode_xtf({}), std::invalid_argument);
}

TEST_CASE("a JSF's subsystem ranks the frequencies of the scene's sonars") {
  RecordingFrame frame = sample_frame();
  for (const int rank : {0, 1, 2, 30}) {
    frame.frequency_rank = rank;
    const Recording recording = make_recording(sample_line(1), sample_levels(), frame);
    const auto file = encode_jsf({&recording, 1});
    CHECK(int(at<std::uint8_t>(file, 7)) == std::min(20 + rank, 39));  // 40 is not a sidescan sonar
  }
}

TEST_CASE("a sonar with one side is silent on the other, and north is 360 degrees") {
  Sonar sonar;
  sonar.sides = Sides::starboard;
  sonar.bins = 8;
  Waterfall line(sonar, 1);
  EchoLine echo;
  echo.bins.assign(8);
  echo.bins.sample.assign(8, 70u);
  echo.bins.region.assign(8, static_cast<std::uint32_t>(Region::seabed));
  line.set_row(0, std::span(&echo, 1), {});
  const Recording recording = make_recording(line, sample_levels(), sample_frame());
  for (const std::uint16_t sample : recording.side(0, Side::port)) CHECK(sample == 0);
  for (const std::uint16_t sample : recording.side(0, Side::starboard)) CHECK(sample > 0);
  CHECK(at<float>(encode_xtf({&recording, 1}), 1024 + 212) == 360.0f);
  CHECK(encode_jsf({&recording, 1}).size() == 16 + 240 + 16);
}

TEST_CASE("a track that counts from 1970 keeps its time, any other begins on the default day") {
  Waterfall line = sample_line(1);
  RecordingFrame frame = sample_frame();
  frame.start_time.clear();
  CHECK(make_recording(line, sample_levels(), frame).pings.front().unix_ms == 946684800000);
  line.pings.front().pose.t_s = 1.5e9 + 0.25;
  CHECK(make_recording(line, sample_levels(), frame).pings.front().unix_ms == 1500000000250);
}
