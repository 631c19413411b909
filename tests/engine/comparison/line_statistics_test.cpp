#include <array>
#include <cmath>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/paths.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/comparison/line_source.h>
#include <ensonify/engine/comparison/line_statistics.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/some_pings.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr std::size_t speckled_pings = 400, speckled_samples = 600;

std::size_t altitude_samples(std::size_t ping) { return 50 + ping / 20; }

/// A level bed of this amplitude under a water column of 1/50 of it, both with Rayleigh speckle;
/// K-distributed of this shape where it is given: the bed's power is multiplied by gamma numbers.
RecordedLine speckled_line(double shape = 0.0, double amplitude = 1000.0) {
  std::mt19937 random(7);
  std::exponential_distribution<double> power;
  std::gamma_distribution<double> texture(shape > 0.0 ? shape : 1.0);
  RecordedLine line{.samples = speckled_samples};
  for (std::size_t ping = 0; ping < speckled_pings; ++ping) {
    line.pings.push_back({.number = ping, .range_m = 60.0, .samples = speckled_samples});
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (std::size_t k = 0; k < speckled_samples; ++k) {
        const bool water = k < altitude_samples(ping);
        const double mean_power = amplitude * amplitude * (water ? 4e-4 : 1.0);
        const double factor = !water && shape > 0.0 ? texture(random) / shape : 1.0;
        side->push_back(static_cast<float>(std::sqrt(mean_power * factor * power(random))));
      }
  }
  return line;
}

std::map<std::string, double> numbers_of(const RecordedLine& line) {
  std::map<std::string, double> numbers;
  for (const LineStatistic& one : line_statistics(LineWithBed(line), 0, line.pings.size()))
    numbers[one.name] = one.value;
  return numbers;
}

}  // namespace

TEST_CASE("the bed of a line begins where the first return is") {
  const RecordedLine line = speckled_line();
  for (const Side side : {Side::port, Side::starboard}) {
    const std::vector<std::size_t> bed = find_bed(line, side).first_sample;
    for (std::size_t ping = 0; ping < speckled_pings; ++ping) {
      CAPTURE(ping);
      CHECK(std::abs(static_cast<double>(bed[ping]) -
                     static_cast<double>(altitude_samples(ping))) <= 3.0);
    }
  }
  // Without water in front, all is bed; without an echo, nothing.
  RecordedLine all = line;
  for (float& value : all.port) value = 500.0f;
  CHECK(find_bed(all, Side::port).first_sample[9] == 0);
  for (float& value : all.port) value = 0.0f;
  CHECK(find_bed(all, Side::port).first_sample[9] == speckled_samples);
}

TEST_CASE("statistics of a level bed with speckle are those of Rayleigh's distribution") {
  const std::map<std::string, double> found = numbers_of(speckled_line());
  // Of 128 samples about their own mean: sd / mean is 0.5227 for many, 0.3 % less for 128; medians
  // of skew (0.631) and excess kurtosis (0.245) are lower, because few samples reach the tail.
  CHECK(found.at("contrast_at_8_to_14_deg") == Approx(0.5227).epsilon(0.01));
  CHECK(found.at("contrast_at_14_to_20_deg") == Approx(0.5227).epsilon(0.01));
  CHECK(found.at("skew_at_8_to_14_deg") == Approx(0.60).margin(0.05));
  CHECK(found.at("kurtosis_at_8_to_14_deg") == Approx(0.1).margin(0.15));
  // P(amplitude > 4 means) = exp(-16 pi / 4) = 3.5e-6.
  CHECK(found.at("bright_per_10000_at_8_to_14_deg") < 1.0);
  for (const int lag : {1, 2, 4, 8})  // -1 / 128: about the block's own mean
    CHECK(found.at("range_correlation_" + std::to_string(lag)) == Approx(-1.0 / 128).margin(0.01));
  for (const int lag : {1, 2, 4})
    CHECK(found.at("track_correlation_" + std::to_string(lag)) == Approx(-1.0 / 128).margin(0.01));
  for (int low = 10; low < 60; low += 5)
    CHECK(found.at("level_at_" + std::to_string(low) + "_to_" + std::to_string(low + 5) +
                   "_deg_db") == Approx(0.0).margin(0.1));
  CHECK(found.at("level_at_50_to_60_percent_of_range_db") == Approx(0.0).margin(0.1));
  // Median over rms of Rayleigh amplitudes: sqrt(ln 2); the column is 1/50 of the bed.
  CHECK(found.at("column_over_bed") == Approx(std::sqrt(std::log(2.0)) / 50.0).epsilon(0.02));
  // Of the samples above the median, a share exp(-8 m) is over 9 times its power m. The share of
  // samples below it is beta distributed, and (1 - share)^8 has this mean.
  double bright = 0.0;
  for (std::size_t ping = 0; ping < speckled_pings; ++ping) {
    const std::size_t begin = altitude_samples(ping);
    const std::size_t column = begin - begin / 10 - 3 - begin / 3;
    const auto n = static_cast<double>(column);
    const double k = std::floor((n - 1.0) / 2.0) + 1.0;  // rank of the median
    bright += (n - k) / n *
              std::exp(std::lgamma(n - k + 9.0) + std::lgamma(n + 1.0) - std::lgamma(n + 9.0) -
                       std::lgamma(n - k + 1.0)) /
              static_cast<double>(speckled_pings);
  }
  CHECK(found.at("column_bright_per_10000") == Approx(1e4 * bright).epsilon(0.3));
  // The sd of a mean of some 540 samples.
  CHECK(found.at("ping_brightness") == Approx(0.5227 / std::sqrt(540.0)).epsilon(0.15));
  CHECK(found.at("first_return_m") == Approx(0.1 * 60.0).margin(0.2));
  CHECK(found.at("first_return_wander_m") < 0.1);
  CHECK(found.at("port_over_starboard_db") == Approx(0.0).margin(0.1));
  CHECK(found.at("silent_share") == 0.0);
}

TEST_CASE("a recording whose range was changed has the statistics of the range that it has most") {
  const auto xtf_of = [](const RecordedLine& line, double range_m, std::size_t count) {
    Recording written = tests::small_recording(line.samples);
    written.range_m = range_m;
    const NavPing first = written.pings.front();
    written.pings.clear();
    written.samples.clear();
    written.gain_db.resize(count);
    for (std::size_t row = 0; row < count; ++row) {
      NavPing& ping = written.pings.emplace_back(first);
      ping.row = ping.number = row;
      ping.unix_ms += static_cast<std::int64_t>(250 * row);
      const auto port = line.row(Side::port, row), starboard = line.row(Side::starboard, row);
      for (auto sample = port.rbegin(); sample != port.rend(); ++sample)
        written.samples.push_back(static_cast<std::uint16_t>(*sample));
      for (const float sample : starboard)
        written.samples.push_back(static_cast<std::uint16_t>(sample));
    }
    return tests::as_text(encode_xtf({&written, 1}));
  };
  const RecordedLine line = speckled_line();
  RecordedLine longer = line;
  set_samples(longer, 2 * speckled_samples);
  const tests::TemporaryFolder folder;
  const std::string most = xtf_of(line, 60.0, 200);
  tests::write_text(folder / "most.xtf", most);
  constexpr std::size_t xtf_header = 1024;
  tests::write_text(folder / "mixed.xtf", xtf_of(longer, 120.0, 60) + most.substr(xtf_header));
  const RecordedLine mixed = read_line(folder / "mixed.xtf", "");
  CHECK(mixed.warnings.back() ==
        (folder / "mixed.xtf").string() +
            ": 60 of 260 pings have another range or length than most and are left out");
  const std::map<std::string, double> expected = numbers_of(read_line(folder / "most.xtf", ""));
  for (const auto& [name, value] : numbers_of(mixed)) {
    CAPTURE(name);
    CHECK(std::isnan(value) == std::isnan(expected.at(name)));
    if (!std::isnan(value)) CHECK(value == expected.at(name));
  }
  CHECK(expected.at("first_return_m") == Approx(0.1 * 55.0).margin(0.3));
}

TEST_CASE("a weaker side and silent pings are seen") {
  RecordedLine line = speckled_line();
  for (float& value : line.port) value *= 0.1f;
  CHECK(numbers_of(line).at("port_over_starboard_db") == Approx(-20.0).margin(0.1));
  std::ranges::fill(line.starboard, 0.0f);
  const std::map<std::string, double> found = numbers_of(line);
  CHECK(std::isnan(found.at("port_over_starboard_db")));
  CHECK(found.at("silent_share") == 0.5);
}

TEST_CASE("statistics tell texture, correlation and clipping from speckle") {
  // K distribution: <I^2> / <I>^2 = 2 (1 + 1/n), and sd / mean of the amplitude is 0.703 for n
  // = 1.6 (Abraham and Lyons, IEEE JOE 27, 800, 2002).
  const std::map<std::string, double> textured = numbers_of(speckled_line(1.6));
  CHECK(textured.at("contrast_at_8_to_14_deg") == Approx(0.70).margin(0.02));
  CHECK(textured.at("bright_per_10000_at_8_to_14_deg") > 5.0);

  RecordedLine smooth = speckled_line();
  const std::vector<float> white = smooth.starboard;
  for (std::size_t i = 0; i + 1 < white.size(); ++i)
    smooth.starboard[i] = 0.5f * (white[i] + white[i + 1]);
  smooth.port.clear();
  const std::map<std::string, double> correlated = numbers_of(smooth);
  CHECK(correlated.at("range_correlation_1") == Approx(0.5).margin(0.02));
  CHECK(correlated.at("range_correlation_2") == Approx(0.0).margin(0.02));

  RecordedLine clipped = speckled_line();
  for (std::vector<float>* side : {&clipped.port, &clipped.starboard})
    for (float& value : *side) value = std::min(value, 1517.43f);  // a tenth of them: sqrt(ln 10)
  CHECK(numbers_of(clipped).at("clipped_share") == Approx(0.1).margin(0.005));
}

TEST_CASE("changes of tone along the track are those of the bed and of the speckle's blocks") {
  // 8 x 16 samples of speckle have a mean power of the relative deviation 1 / sqrt(128).
  const double speckle_db = 10.0 / std::log(10.0) / std::sqrt(128.0);
  RecordedLine line = speckled_line();
  for (const char* lag : {"8", "32", "128"})
    CHECK(numbers_of(line).at(fmt::format("tone_change_over_{}_pings_db", lag)) ==
          Approx(std::sqrt(2.0) * speckle_db).epsilon(0.05));
  // Tones of 3 dB that last 32 pings.
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0.0, 3.0);
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t begin = 0; begin < speckled_samples; begin += 16)
      for (std::size_t ping = 0; ping < speckled_pings; ping += 32) {
        const auto factor = static_cast<float>(std::pow(10.0, normal(random) / 20.0));
        for (std::size_t i = ping; i < std::min(ping + 32, speckled_pings); ++i)
          for (std::size_t k = begin; k < std::min(begin + 16, speckled_samples); ++k)
            (*side)[i * speckled_samples + k] *= factor;
      }
  const double changed_db = std::sqrt(2.0 * (9.0 + speckle_db * speckle_db));
  const auto found = numbers_of(line);
  CHECK(found.at("tone_change_over_32_pings_db") == Approx(changed_db).epsilon(0.1));
  CHECK(found.at("tone_change_over_128_pings_db") == Approx(changed_db).epsilon(0.1));
  CHECK(found.at("tone_change_over_8_pings_db") < 0.4 * changed_db);  // a quarter of them changes
}

TEST_CASE("the page of statistics has one row for each, and no others") {
  // Numbers that differ from name to name are letters on the page.
  std::set<std::string> names;
  for (const LineStatistic& one :
       line_statistics(LineWithBed(speckled_line()), 0, speckled_pings)) {
    const std::string of_ranges =
        std::regex_replace(one.name, std::regex("_at_\\d+_to_\\d+"), "_at_A_to_B");
    names.insert(std::regex_replace(of_ranges, std::regex("(_over_|_correlation_)\\d+"), "$1N"));
  }
  std::set<std::string> on_page;
  std::istringstream page(tests::read_text(tests::source_folder() / "doc/statistics.md"));
  for (std::string line; std::getline(page, line);)
    if (std::smatch row; std::regex_search(line, row, std::regex("^\\| `(\\w+)` \\|")))
      on_page.insert(row[1]);
  CHECK(on_page == names);
}

TEST_CASE("a recorder's scale changes no statistic, and a line equals itself") {
  const RecordedLine line = speckled_line(), louder = speckled_line(0.0, 4000.0);
  for (const ComparedStatistic& one : compare_lines(LineWithBed(line), LineWithBed(louder))) {
    CAPTURE(one.name);
    CHECK((std::isnan(one.a) == std::isnan(one.b)));
    if (!std::isnan(one.a)) CHECK(one.b == Approx(one.a).epsilon(1e-4).margin(1e-4));
  }
}

namespace {

/// A bed whose amplitude is the sine of the grazing angle, at an altitude that may fall from 120 to
/// 60 samples along the line.
RecordedLine lambert_line(bool falls) {
  std::mt19937 random(9);
  std::exponential_distribution<double> power;
  RecordedLine line{.samples = speckled_samples};
  for (std::size_t ping = 0; ping < speckled_pings; ++ping) {
    const double altitude =
        falls ? 120.0 - 60.0 * static_cast<double>(ping) / static_cast<double>(speckled_pings)
              : 90.0;
    line.pings.push_back({.number = ping, .range_m = 60.0, .samples = speckled_samples});
    for (std::vector<float>* side : {&line.port, &line.starboard})
      for (std::size_t k = 0; k < speckled_samples; ++k) {
        const double r = static_cast<double>(k) + 0.5,
                     rms = r < altitude ? 5.0 : 1e3 * altitude / r;
        side->push_back(static_cast<float>(rms * std::sqrt(power(random))));
      }
  }
  return line;
}

}  // namespace

TEST_CASE("the halves of a line that are compared are at equal altitude, and are all of it") {
  for (const bool falls : {true, false}) {
    CAPTURE(falls);
    const RecordedLine line = lambert_line(falls);
    const auto halves = halves_at_equal_altitude(LineWithBed(line));
    std::set<std::size_t> all;
    std::array<double, 2> mean{};
    for (const std::size_t half : {0u, 1u})
      for (const std::size_t ping : halves[half]) {
        all.insert(ping);
        mean[half] += static_cast<double>(ping) / static_cast<double>(halves[half].size());
      }
    CHECK(all.size() == speckled_pings);
    CHECK(halves[0].size() + halves[1].size() == speckled_pings);
    // By pairs of neighbours where the altitude falls; else the first and the second half.
    CHECK(mean[1] - mean[0] == Approx(falls ? 400.0 / 12.0 : 200.0).margin(1.0));
    // The level at one range, relative to the whole line's level there, follows the altitude:
    // 10 log10 of (120 / 60)^2 from end to end, and half as much between plain halves.
    for (const ComparedStatistic& one : compare_lines(LineWithBed(line), LineWithBed(line))) {
      CAPTURE(one.name);
      CHECK((std::isnan(one.a) || one.ratio() == 0.0));
      if (one.name == "level_at_80_to_90_percent_of_range_db") CHECK(one.spread < 1.0);
      if (one.name == "first_return_m") CHECK(one.spread == Approx(falls ? 3.0 : 0.0).margin(0.3));
    }
  }
}

TEST_CASE("the likeness counts ratios up to 1, and has the differences in decibels") {
  const double none = std::nan("");
  const std::vector<ComparedStatistic> statistics{
      {"a", 1.0, 4.0, 5.0, {StatisticCurve::level_over_grazing, 5, 10}},
      {"b", 1.0, -3.0, 2.0, {StatisticCurve::level_over_grazing, 10, 15}},
      {"c", none, 4.0, 5.0, {StatisticCurve::level_over_grazing, 15, 20}},
      {"d", 0.5, 1.0, 0.1, {StatisticCurve::contrast_over_grazing, 8, 14}},
      {"e", 7.0, 7.0, 0.0, {}}};
  const Likeness found = likeness(statistics);
  CHECK(found.within == 2);
  CHECK(found.known == 4);
  CHECK(found.level_over_grazing_db == Approx(std::sqrt(12.5)));
  CHECK(found.contrast_db == Approx(6.02).margin(0.01));
  CHECK(std::isnan(found.level_over_range_db));
  CHECK(found.decibels() ==
        "the level over the angle is 3.5 dB off, the contrast is 6.0 dB off (root mean square)");
}

TEST_CASE("a line too short to tell gives unknown numbers") {
  RecordedLine line{.samples = 10};
  line.pings.push_back({.samples = 10});
  line.port.assign(10, 1.0f);
  for (const LineStatistic& one : line_statistics(LineWithBed(line), 0, 1)) {
    CAPTURE(one.name);
    CHECK(std::isnan(one.value));
  }
}

TEST_CASE("a real recording has the statistics that were measured on it by hand") {
  const auto file = tests::data_file("sidescan/scotsman-iver2.xtf");
  if (!file) {
    WARN("skipped: the recording is not there");
    return;
  }
  const std::map<std::string, double> found = numbers_of(read_line(*file, ""));
  CHECK(found.at("contrast_at_8_to_14_deg") > 0.52);
  CHECK(found.at("contrast_at_8_to_14_deg") < 0.66);
  CHECK(found.at("column_over_bed_db") == Approx(-34.0).margin(2.0));
  CHECK(found.at("clipped_share") == Approx(0.024).margin(0.005));
}
