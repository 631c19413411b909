// Laws of a picture's normalisations and mappings, for any gain.

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/sonar/reception/recorder.h>

using namespace ensonify::engine;

namespace {

constexpr std::size_t bins = 400, columns = 2 * bins;

/// A bed whose level after a gain of 30 lg r is a function of ping, column and depression. The
/// sonar climbs from 8 m to 16 m above it; at shorter ranges there is water.
template <class Level>
Waterfall bed_of_levels(std::size_t pings, Level&& level) {
  Sonar sonar;
  sonar.bins = bins;
  sonar.range_m = 80.0;
  Waterfall waterfall(sonar, pings);
  for (std::size_t ping = 0; ping < pings; ++ping) {
    const double height_m = 8.0 + 8.0 * static_cast<double>(ping) / static_cast<double>(pings);
    std::array<EchoLine, 2> sides;
    for (const Sector& sector : sidescan_sectors) {
      EchoLine& line = sides[sector.number];
      line.sector = sector.number;
      line.bins.assign(bins);
      for (std::size_t i = 0; i < bins; ++i) {
        const double r = (static_cast<double>(i) + 0.5) * sonar.bin_m();
        if (r <= height_m) continue;
        const std::size_t column = sector.number == 0 ? bins - 1 - i : bins + i;
        line.bins.region[i] = static_cast<std::uint32_t>(Region::seabed);
        line.bins.intensity[i] = static_cast<float>(
            1e9 * level(ping, column, std::asin(height_m / r)) * std::pow(r, -3.0));
      }
    }
    PingRow record;
    record.altitude_m = height_m;
    waterfall.set_row(ping, sides, record);
  }
  return waterfall;
}

double flat(std::size_t, std::size_t, double) { return 1.0; }

Display levelling_intensity() {
  Display display;
  display.of = DisplayedLayer::intensity;
  display.spreading = 30.0;
  display.absorption = false;
  return display;
}

/// Brightness of pixels in 16 bits; ping and column count as in the waterfall.
struct Bright {
  Picture picture;
  int at(std::size_t ping, std::size_t column) const {
    const std::size_t i = 2 * ((picture.height - 1 - ping) * picture.width + column);
    return picture.pixels[i] << 8 | picture.pixels[i + 1];
  }
};
/// The picture for a scene whose level bed has the level 1 everywhere.
Picture shown(const Waterfall& waterfall, const Display& display, int bits = 8,
              const Recorder* recorder = nullptr, const NeighbourRows* neighbours = nullptr) {
  Calibration calibration{.recorder = recorder};
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t bin = column < bins ? bins - 1 - column : column - bins;
    const double r = (static_cast<double>(bin) + 0.5) * waterfall.sonar.bin_m();
    calibration.level_bed.push_back(r > 8.0 ? 1e9 * std::pow(r, -3.0) : 0.0);
  }
  return render(waterfall, display, calibration, bits, neighbours);
}
Bright render16(const Waterfall& waterfall, const Display& display) {
  return {shown(waterfall, display, 16)};
}

/// Smallest and largest brightness of the bed, off nadir.
std::pair<int, int> extremes(const Bright& picture) {
  std::pair<int, int> all{65535, 0};
  for (std::size_t ping = 0; ping < picture.picture.height; ++ping)
    for (std::size_t column = 0; column < columns; ++column) {
      // Skips ground ranges up to 18 m, and those beyond the last slant range.
      if ((column > bins - 90 && column < bins + 90) || column < 10 || column >= columns - 10)
        continue;
      all.first = std::min(all.first, picture.at(ping, column));
      all.second = std::max(all.second, picture.at(ping, column));
    }
  return all;
}

/// Checks that a normalisation does not change a bed without a pattern.
void leaves_alone(const Display& display, const Waterfall& plain) {
  const Bright with = render16(plain, display), without = render16(plain, levelling_intensity());
  const std::size_t ping = plain.rows() / 2;
  for (std::size_t column = 0; column < columns; column += 7)
    CHECK(std::abs(with.at(ping, column) - without.at(ping, column)) <= 16);
}

double pattern(std::size_t, std::size_t column, double depression) {
  return (column < bins ? 1.0 : 0.3) * (0.2 + std::pow(std::sin(9.0 * depression), 2));
}
double stripes(std::size_t, std::size_t column, double) {
  return 0.5 + static_cast<double>(column * 7919 % 101) / 100.0;
}

}  // namespace

TEST_CASE("a flat bed stays flat under every normalisation and mapping") {
  const Waterfall waterfall = bed_of_levels(12, flat);
  Display smoothed = levelling_intensity();
  smoothed.smoothing_px = 1.5;
  const auto [least, greatest] = extremes(render16(waterfall, smoothed));
  CHECK(greatest - least <= 16);
  for (const bool slant : {false, true})
    for (const bool beam : {false, true})
      for (const bool field : {false, true})
        for (const Mapping mapping : {Mapping::gamma, Mapping::logarithmic}) {
          Display display = levelling_intensity();
          display.slant_range_correction = slant;
          display.beam_normalisation = beam;
          display.flat_field = field;
          display.mapping = mapping;
          const auto [darkest, brightest] = extremes(render16(waterfall, display));
          CAPTURE(slant, beam, field, static_cast<int>(mapping));
          CHECK(brightest - darkest <= 16);  // of 65535, from rounding of floats
          CHECK(darkest > 10000);
        }
}

TEST_CASE("a gain of 20, 30, 40 or 50 dB per factor of ten in range changes a bed by just that") {
  const Waterfall waterfall = bed_of_levels(1, flat);
  for (const double spreading : {20.0, 30.0, 40.0, 50.0}) {
    Display display = levelling_intensity();
    display.spreading = spreading;
    display.mapping = Mapping::logarithmic;
    display.range_db = 60.0;
    display.gain_db = -10.0;
    const Bright picture = render16(waterfall, display);
    const double near_m = 100.5 * 0.2, far_m = 350.5 * 0.2;
    const double step_db = (picture.at(0, bins + 350) - picture.at(0, bins + 100)) / 65535.0 * 60.0;
    CAPTURE(spreading);
    CHECK(step_db == Approx((spreading - 30.0) * std::log10(far_m / near_m)).margin(0.01));
  }
}

TEST_CASE("beam normalisation removes a pattern over depression, and is idempotent") {
  const Waterfall patterned = bed_of_levels(40, pattern);
  Display display = levelling_intensity();
  const auto [dark, bright] = extremes(render16(patterned, display));
  CHECK(bright > 2 * dark);
  display.beam_normalisation = true;
  const auto [darkest, brightest] = extremes(render16(patterned, display));
  CHECK(brightest < 1.1 * darkest);  // a pattern within half a degree remains
  leaves_alone(display, bed_of_levels(40, flat));
}

TEST_CASE("flat-fielding removes a pattern over columns, and is idempotent") {
  const Waterfall striped = bed_of_levels(10, stripes);
  Display display = levelling_intensity();
  const auto [dark, bright] = extremes(render16(striped, display));
  CHECK(bright > 1.4 * dark);
  display.flat_field = true;
  const auto [darkest, brightest] = extremes(render16(striped, display));
  CHECK(brightest - darkest <= 16);
  leaves_alone(display, bed_of_levels(10, flat));
}

TEST_CASE("a normalisation is that of the bed: glints and objects change only their own pixels") {
  for (const bool beam : {false, true}) {
    const Waterfall plain = bed_of_levels(10, beam ? pattern : stripes);
    Waterfall spoilt = plain;
    for (std::size_t ping = 0; ping < 7; ++ping)
      for (std::size_t column = bins + 150; column < bins + 170; ++column) {
        spoilt.pixels.region[ping * columns + column] = static_cast<std::uint32_t>(Region::object);
        spoilt.pixels.intensity[ping * columns + column] *= 100.0f;
      }
    // A glint whose bin has a label of the bed.
    spoilt.pixels.intensity[3 * columns + bins - 200] *= 1e7f;
    Display display = levelling_intensity();
    (beam ? display.beam_normalisation : display.flat_field) = true;
    const Bright without = render16(plain, display), with = render16(spoilt, display);
    int changed = 0;
    for (std::size_t ping = 0; ping < 10; ++ping)
      for (std::size_t column = 0; column < columns; ++column)
        // Medians of other bins differ by what the pattern changes within half a degree.
        changed += std::abs(with.at(ping, column) - without.at(ping, column)) >
                   without.at(ping, column) / 10;
    CAPTURE(beam);
    CHECK(changed == 7 * 20 + 1);
  }
}

TEST_CASE("a normalisation leaves the water as it is") {
  Waterfall waterfall = bed_of_levels(40, pattern);
  std::vector<std::size_t> water;
  for (std::size_t i = 0; i < waterfall.pixels.region.size(); ++i)
    if (waterfall.pixels.intensity[i] == 0.0f) {
      waterfall.pixels.region[i] = static_cast<std::uint32_t>(Region::water_column);
      const std::size_t column = i % columns;
      const double r = (column < bins ? bins - 1.0 - column : column - 1.0 * bins) + 0.5;
      waterfall.pixels.intensity[i] = static_cast<float>(1e6 * std::pow(0.2 * r, -3.0));
      water.push_back(i);
    }
  REQUIRE(water.size() > 1000);
  const Bright plain = render16(waterfall, levelling_intensity());
  for (const bool beam : {false, true}) {
    Display display = levelling_intensity();
    (beam ? display.beam_normalisation : display.flat_field) = true;
    const Bright normalised = render16(waterfall, display);
    int changed = 0;
    for (const std::size_t i : water)
      changed += normalised.at(i / columns, i % columns) != plain.at(i / columns, i % columns);
    CAPTURE(beam);
    CHECK(changed == 0);
  }
}

TEST_CASE("every mapping shows the median of the bed at its medium brightness, normalised or not") {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> exponential;
  const Waterfall waterfall = bed_of_levels(
      60, [&](std::size_t, std::size_t, double) { return exponential(random) / std::log(2.0); });
  for (const Mapping mapping : {Mapping::gamma, Mapping::logarithmic, Mapping::equalised})
    for (const int normalisation : {0, 1, 2}) {
      Display display = levelling_intensity();
      display.mapping = mapping;
      display.beam_normalisation = normalisation == 1;
      display.flat_field = normalisation == 2;
      const Bright picture = render16(waterfall, display);
      std::vector<int> lit;
      for (std::size_t i = 0; i < waterfall.pixels.region.size(); ++i)
        if (waterfall.pixels.region[i] == static_cast<std::uint32_t>(Region::seabed))
          lit.push_back(picture.at(i / columns, i % columns));
      std::ranges::nth_element(lit, lit.begin() + std::ssize(lit) / 2);
      CAPTURE(static_cast<int>(mapping), normalisation);
      const double medium =
          mapping == Mapping::gamma ? std::pow(mid_amplitude, display.gamma) : 0.5;
      CHECK(lit[lit.size() / 2] / 65535.0 == Approx(medium).margin(0.025));
    }
}

TEST_CASE("a smoothed point is a Gaussian of that width, with the brightness of the point") {
  constexpr std::size_t ping = 20, column = bins + 200;
  const auto point = [](std::size_t its_ping, std::size_t its_column, double) {
    return its_ping == ping && its_column == column ? 4.0 : 1.0;
  };
  const Waterfall with = bed_of_levels(40, point), without = bed_of_levels(40, flat);
  struct Widths {
    double sigma_px, track_px;
  };
  for (const auto [sigma_px, track_px] :
       {Widths{0.6, 0.0}, Widths{1.0, 0.0}, Widths{2.5, 0.0}, Widths{0.6, 0.8}, Widths{0.0, 1.0}}) {
    Display display = levelling_intensity();
    const double height =
        render16(with, display).at(ping, column) - render16(without, display).at(ping, column);
    display.smoothing_px = sigma_px;
    display.track_smoothing_px = track_px;
    const Bright smoothed = render16(with, display), bed_only = render16(without, display);
    double sum = 0.0, along = 0.0, across = 0.0;
    for (std::size_t i = ping - 10; i <= ping + 10; ++i)
      for (std::size_t k = column - 10; k <= column + 10; ++k) {
        const double here = smoothed.at(i, k) - bed_only.at(i, k);
        sum += here;
        along += here * std::pow(static_cast<double>(i) - ping, 2);
        across += here * std::pow(static_cast<double>(k) - column, 2);
      }
    CAPTURE(sigma_px, track_px);
    CHECK(sum == Approx(height).epsilon(0.01));
    // Three standard deviations have 97 % of a Gaussian's variance.
    CHECK(along / sum == Approx(sigma_px * sigma_px + track_px * track_px).epsilon(0.05));
    CHECK(across / sum == Approx(sigma_px * sigma_px).epsilon(0.05).margin(1e-3));
  }
}

TEST_CASE("a smoothed picture does not wrap around, and its border keeps its brightness") {
  const auto half = [](std::size_t, std::size_t column, double) {
    return column < bins ? 1.0 : 4.0;
  };
  Display display = levelling_intensity();
  display.smoothing_px = 2.0;
  const Waterfall waterfall = bed_of_levels(8, half);
  const Bright smoothed = render16(waterfall, display);
  display.smoothing_px = 0.0;
  const Bright sharp = render16(waterfall, display);
  for (std::size_t ping = 0; ping < 8; ++ping)
    for (const std::size_t column : {std::size_t{0}, std::size_t{2}, columns - 3, columns - 1})
      CHECK(std::abs(smoothed.at(ping, column) - sharp.at(ping, column)) <= 16);
}

namespace {

/// Some rows of a waterfall.
Waterfall rows_of(const Waterfall& waterfall, std::size_t first, std::size_t end) {
  Waterfall some(waterfall.sonar, 0);
  some.pings.assign(waterfall.pings.begin() + static_cast<std::ptrdiff_t>(first),
                    waterfall.pings.begin() + static_cast<std::ptrdiff_t>(end));
  BinLayers::for_each([&](std::string_view, auto layer) {
    const auto begin = (waterfall.pixels.*layer).begin();
    (some.pixels.*layer)
        .assign(begin + static_cast<std::ptrdiff_t>(first * columns),
                begin + static_cast<std::ptrdiff_t>(end * columns));
  });
  return some;
}

}  // namespace

TEST_CASE("rows with their neighbours have the pixels that they have in the whole picture") {
  std::mt19937_64 random(3);
  std::exponential_distribution<double> speckle;
  const Waterfall whole =
      bed_of_levels(40, [&](std::size_t, std::size_t, double) { return speckle(random); });
  struct Rows {
    std::size_t first, end;
  };
  for (const double sigma_px : {0.5, 1.5, 4.0})
    for (const bool over_ground : {false, true})
      for (const int bits : {8, 16})
        for (const auto [first, end] : {Rows{0, 10}, Rows{10, 13}, Rows{13, 40}}) {
          Display display = levelling_intensity();
          display.smoothing_px = sigma_px;
          display.track_smoothing_px = 0.5;
          display.slant_range_correction = over_ground;
          const std::size_t reach = smoothed_rows(display);
          const NeighbourRows neighbours{rows_of(whole, first - std::min(first, reach), first),
                                         rows_of(whole, end, std::min(end + reach, whole.rows()))};
          const Picture all = shown(whole, display, bits),
                        some =
                            shown(rows_of(whole, first, end), display, bits, nullptr, &neighbours);
          CAPTURE(sigma_px, over_ground, bits, first, end);
          CHECK(some.height == end - first);
          CHECK(some.pixels.size() == some.height * columns * static_cast<std::size_t>(bits / 8));
          const std::size_t bytes_above = (40 - end) * columns * static_cast<std::size_t>(bits / 8);
          CHECK(std::ranges::equal(some.pixels,
                                   std::span(all.pixels).subspan(bytes_above, some.pixels.size())));
        }
}

TEST_CASE("neighbours have the normalisation of the rows that they adjoin") {
  // The neighbours are four times as strong, so that their own normalisation would hide them.
  const Waterfall whole = bed_of_levels(40, [](std::size_t row, std::size_t column, double r) {
    return (row < 15 || row >= 25 ? 4.0 : 1.0) * stripes(row, column, r);
  });
  Display display = levelling_intensity();
  display.flat_field = true;
  display.track_smoothing_px = 2.0;
  const NeighbourRows neighbours{rows_of(whole, 0, 15), rows_of(whole, 25, 40)};
  const Bright picture{shown(rows_of(whole, 15, 25), display, 16, nullptr, &neighbours)};
  for (std::size_t column = bins + 100; column < columns; ++column) {
    CHECK(picture.at(0, column) > picture.at(5, column) + 100);
    CHECK(picture.at(9, column) > picture.at(5, column) + 100);
  }
}

TEST_CASE(
    "slant-range correction shows points at their ground range for every height, and no water "
    "remains") {
  const double over_m = 40.0;
  const auto mark = [&](std::size_t ping, std::size_t column, double) {
    const double height_m = 8.0 + 8.0 * static_cast<double>(ping) / 30.0;
    const auto bin = static_cast<std::size_t>(std::hypot(over_m, height_m) / 0.2);
    return column == bins + bin || column == bins - 1 - bin ? 100.0 : 1.0;
  };
  const Waterfall marked = bed_of_levels(30, mark);
  Display display = levelling_intensity();
  display.slant_range_correction = true;
  const Bright picture = render16(marked, display);
  for (std::size_t ping = 0; ping < 30; ++ping) {
    std::vector<double> starboard, port;
    for (std::size_t column = 0; column < columns; ++column)
      if (picture.at(ping, column) > 1.5 * picture.at(ping, bins + 250))
        (column < bins ? port : starboard)
            .push_back((column < bins ? double(bins - column) : double(column - bins)) * 0.2);
    REQUIRE_FALSE(port.empty());
    REQUIRE_FALSE(starboard.empty());
    CHECK(port.front() == Approx(over_m).margin(0.5));
    CHECK(starboard.front() == Approx(over_m).margin(0.5));
    CHECK(picture.at(ping, bins + 20) > 0);  // 4 m from nadir
  }
  display.slant_range_correction = false;
  CHECK(render16(marked, display).at(3, bins + 20) == 0);
}

TEST_CASE(
    "with speed correction a column is as wide as rows are apart, and shows its mean amplitude") {
  // Bins of 0.2 m, to 80 m; some are far above white.
  const Waterfall waterfall =
      bed_of_levels(5, [](std::size_t ping, std::size_t column, double depression) {
        return (column % 17 == 0 ? 300.0 : 1.0) * stripes(ping, column, depression);
      });
  constexpr double darker_db = 40.0;  // then all are below white
  Calibration calibration;
  for (std::size_t column = 0; column < columns; ++column)
    calibration.level_bed.push_back(1e9 * std::pow(0.2 * double(column % bins + 1), -3.0));
  for (const bool ground : {false, true})
    for (const double spacing_m : {0.5, 0.32, 0.2, 0.05, 0.0}) {
      Display display = levelling_intensity();
      display.gamma = 1.0;  // brightness is amplitude
      const auto bright = [&](bool corrected, double row_spacing_m) -> Bright {
        display.speed_correction = corrected;
        calibration.row_spacing_m = row_spacing_m;
        return {render(waterfall, display, calibration, 16)};
      };
      display.gain_db = -darker_db;
      const Bright by_bin = bright(false, 0.0);
      display.gain_db = 0.0;
      display.slant_range_correction = ground;
      const Bright picture = bright(true, spacing_m);
      CAPTURE(ground, spacing_m);
      if (spacing_m <= 0.2) {  // not narrower than bins; unknown
        CHECK(picture.picture.pixels == bright(false, 0.0).picture.pixels);
        continue;
      }
      const auto side = static_cast<std::size_t>(80.0 / spacing_m);
      REQUIRE(picture.picture.width == 2 * side);
      // Second implementation: the mean over very many places in the column's slant ranges.
      for (const std::size_t ping : {0, 4})
        for (std::size_t column = 0; column < side; column += 13) {
          const double height_m = ground ? 8.0 + 8.0 * double(ping) / 5.0 : 0.0;
          const double near_m = std::hypot(double(column) * spacing_m, height_m),
                       far_m = std::hypot(double(column + 1) * spacing_m, height_m);
          constexpr int places = 20000;
          double sum = 0.0;
          int inside = 0;
          for (int i = 0; i < places; ++i) {
            const double r = near_m + (far_m - near_m) * (i + 0.5) / places;
            if (r >= 80.0) break;
            ++inside;
            sum += by_bin.at(ping, bins + static_cast<std::size_t>(r / 0.2));
          }
          const double mean = inside > 0 ? std::pow(10.0, darker_db / 20.0) * sum / inside : 0.0;
          CHECK(picture.at(ping, side + column) == Approx(std::min(mean, 65535.0)).margin(60.0));
          CAPTURE(column);
        }
    }
}

TEST_CASE("a column of several samples shows their peak or the one in its middle") {
  const Waterfall waterfall = bed_of_levels(5, stripes);
  Calibration calibration;
  for (std::size_t column = 0; column < columns; ++column)
    calibration.level_bed.push_back(1e9 * std::pow(0.2 * double(column % bins + 1), -3.0));
  const auto bright = [&](ColumnValue value, bool corrected) -> Bright {
    Display display = levelling_intensity();
    display.gain_db = -20.0;
    display.speed_correction = corrected;
    display.column_value = value;
    return {render(waterfall, display, calibration, 16)};
  };
  calibration.row_spacing_m = 1.0;  // columns of five samples
  const Bright samples = bright(ColumnValue::mean, false), peak = bright(ColumnValue::peak, true),
               middle = bright(ColumnValue::middle, true);
  REQUIRE(peak.picture.width == columns / 5);
  for (const std::size_t ping : {0, 4})
    for (std::size_t column = 0; column < columns / 5; ++column) {
      int greatest = 0;
      for (std::size_t i = 0; i < 5; ++i)
        greatest = std::max(greatest, samples.at(ping, 5 * column + i));
      CHECK(peak.at(ping, column) == greatest);
      CHECK(middle.at(ping, column) == samples.at(ping, 5 * column + 2));
    }
  // Columns of two and a half samples: a sample counts where its middle is.
  calibration.row_spacing_m = 0.5;
  const Bright halves = bright(ColumnValue::peak, true);
  for (std::size_t column = 0; column < bins / 5; ++column) {
    const std::size_t first = bins + 5 * column, picture_first = 2 * (bins / 5 + column);
    const auto greatest = [&](std::size_t from, std::size_t until) {
      int value = 0;
      for (std::size_t i = from; i < until; ++i) value = std::max(value, samples.at(0, first + i));
      return value;
    };
    CHECK(halves.at(0, picture_first) == greatest(0, 2));
    CHECK(halves.at(0, picture_first + 1) == greatest(2, 5));
  }
}

TEST_CASE("a picture does not depend on how far above its sonar the vehicle's origin is") {
  const Waterfall at_origin = bed_of_levels(16, pattern);
  Waterfall below = at_origin;
  below.sonar.mounting.down_m = 3.0;
  for (PingRow& ping : below.pings) ping.altitude_m += 3.0;
  for (const bool over_ground : {false, true}) {
    Display display = levelling_intensity();
    display.slant_range_correction = over_ground;
    display.beam_normalisation = !over_ground;
    CHECK(shown(below, display).pixels == shown(at_origin, display).pixels);
  }
}

TEST_CASE(
    "a higher level is never darker in any mapping and palette, and on paper never brighter") {
  const auto ramp = [](std::size_t, std::size_t column, double) {
    return std::pow(10.0, -4.0 + 8.0 * static_cast<double>(column) / columns);
  };
  const Waterfall waterfall = bed_of_levels(1, ramp);
  for (const Mapping mapping : {Mapping::gamma, Mapping::logarithmic, Mapping::equalised})
    for (const Palette palette :
         {Palette::grey, Palette::copper, Palette::bronze, Palette::paper}) {
      Display display = levelling_intensity();
      display.mapping = mapping;
      display.palette = palette;
      const Picture picture = shown(waterfall, display);
      const auto channels = static_cast<std::size_t>(picture.channels);
      CHECK(channels == (palette == Palette::grey || palette == Palette::paper ? 1 : 3));
      int steps = 0;
      const auto luminance = [&](std::size_t column) {
        int sum = 0;
        for (std::size_t k = 0; k < channels; ++k) sum += picture.pixels[column * channels + k];
        return palette == Palette::paper ? -sum : sum;
      };
      const auto is_bed = [&](std::size_t column) {
        return waterfall.pixels.region[column] == static_cast<std::uint32_t>(Region::seabed);
      };
      for (std::size_t column = 1; column < columns; ++column) {
        if (!is_bed(column) || !is_bed(column - 1)) continue;
        REQUIRE(luminance(column) >= luminance(column - 1));
        steps += luminance(column) > luminance(column - 1);
      }
      CAPTURE(static_cast<int>(mapping), static_cast<int>(palette));
      CHECK(steps > 30);
    }
}

TEST_CASE(
    "a logarithmic mapping has equal steps for equal decibels, an equalised one equal numbers of "
    "pixels") {
  const auto ramp = [](std::size_t, std::size_t column, double) {
    return std::pow(10.0, -1.0 + 2.0 * static_cast<double>(column) / columns);  // 20 dB
  };
  const Waterfall waterfall = bed_of_levels(1, ramp);
  Display display = levelling_intensity();
  display.mapping = Mapping::logarithmic;
  display.range_db = 50.0;
  display.gain_db = -10.0;
  const Bright logarithmic = render16(waterfall, display);
  for (const std::size_t column : {20, 120, 220, 500, 600, 700})
    CHECK((logarithmic.at(0, column + 80) - logarithmic.at(0, column)) / 65535.0 * 50.0 ==
          Approx(80 * 20.0 / columns).margin(0.01));

  display.mapping = Mapping::equalised;
  const Picture equalised = shown(waterfall, display);
  std::array<int, 4> quarters{};
  int all = 0;
  for (std::size_t column = 0; column < columns; ++column)
    if (waterfall.pixels.region[column] == static_cast<std::uint32_t>(Region::seabed)) {
      ++quarters[equalised.pixels[column] / 64u];
      ++all;
    }
  for (const int quarter : quarters) CHECK(quarter == Approx(all / 4.0).margin(5.0));
}

TEST_CASE("a picture of 16 bits rounds to that of 8 bits and has finer steps") {
  const auto ramp = [](std::size_t, std::size_t column, double) {
    return 0.5 + static_cast<double>(column) / columns;
  };
  const Waterfall waterfall = bed_of_levels(3, ramp);
  const Display display = levelling_intensity();
  const Picture coarse = shown(waterfall, display);
  const Bright fine = render16(waterfall, display);
  CHECK(fine.picture.bits == 16);
  CHECK(fine.picture.pixels.size() == 2 * coarse.pixels.size());
  std::set<int> steps;
  for (std::size_t column = 0; column < columns; ++column) {
    const double here = fine.at(2, column) / 257.0;
    REQUIRE(std::abs(here - coarse.pixels[column]) <= 0.51);
    steps.insert(fine.at(2, column));
  }
  CHECK(steps.size() > 400);
}

TEST_CASE("a picture of samples undoes the recorder's gain, for each gain law") {
  const auto ramp = [](std::size_t, std::size_t column, double) {
    return 0.5 + static_cast<double>(column) / columns;
  };
  Waterfall waterfall = bed_of_levels(2, ramp);
  Display display = levelling_intensity();
  const Bright of_intensity = render16(waterfall, display);
  display.of = DisplayedLayer::sample;
  for (const double spreading : {0.0, 20.0, 40.0}) {
    const double far_gain_db = spreading * std::log10(80.0);
    const Recorder recorder({.spreading = spreading, .gain_db = -75.0 - far_gain_db, .bits = 24},
                            waterfall.sonar.bin_m(), static_cast<int>(bins), 0.0, 0.0);
    for (std::size_t i = 0; i < waterfall.pixels.sample.size(); ++i) {
      const std::size_t column = i % columns,
                        bin = column < bins ? bins - 1 - column : column - bins;
      waterfall.pixels.sample[i] =
          recorder.sample(recorder.gain(bin) * std::sqrt(waterfall.pixels.intensity[i]));
    }
    const Bright of_samples{shown(waterfall, display, 16, &recorder)};
    for (std::size_t column = 0; column < columns; ++column)
      REQUIRE(std::abs(of_samples.at(1, column) - of_intensity.at(1, column)) <= 100);
  }
}
