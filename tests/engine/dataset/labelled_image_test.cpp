#include <cmath>

#include "support/catch.h"

#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/sonar/instrument/presets.h>

using namespace ensonify::engine;

namespace {

/// A line whose pixels number their ping and bin, and a picture with the same numbers.
LabelledImage sample_view(std::size_t pings, int bins, double range_m, double spacing_m,
                          double height_m) {
  Sonar sonar;
  sonar.bins = bins;
  sonar.range_m = range_m;
  Waterfall line(sonar, pings);
  Picture picture{line.columns(), pings, 1, std::vector<std::uint8_t>(line.columns() * pings)};
  for (std::size_t ping = 0; ping < pings; ++ping) {
    line.pings[ping].pose.position = {0.0, spacing_m * double(ping), -5.0};
    line.pings[ping].altitude_m = height_m;
    for (std::size_t column = 0; column < line.columns(); ++column) {
      const std::size_t i = ping * line.columns() + column;
      line.pixels.instance[i] = static_cast<std::uint32_t>(i + 1);
      line.pixels.region[i] = static_cast<std::uint32_t>(Region::seabed);
      picture.pixels[(pings - 1 - ping) * line.columns() + column] =
          static_cast<std::uint8_t>((i + 1) % 251);
    }
  }
  return slant_view(line, {picture});
}

/// Checks that picture and labels show the same pixel of the line everywhere.
void check_alike(const LabelledImage& view) {
  const std::size_t rows = view.labels.rows(), columns = view.labels.columns();
  REQUIRE(view.pictures.front().pixels.size() == rows * columns);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column)
      REQUIRE(view.pictures.front().pixels[row * columns + column] ==
              view.labels.pixels.instance[(rows - 1 - row) * columns + column] % 251);
}

}  // namespace

TEST_CASE(
    "a ground view takes each pixel's labels and picture from the nearest ping and the bin at "
    "its slant range") {
  const double height_m = 6.0, pixel_m = 0.25;
  const LabelledImage slant = sample_view(40, 100, 20.0, 0.1, height_m);
  CHECK(slant.along_m == Approx(0.1));
  const LabelledImage ground = ground_view(slant, pixel_m);
  CHECK(ground.labels.rows() == 16);  // 3.9 m
  CHECK(ground.labels.columns() == 160);
  CHECK(ground_view(sample_view(2, 100, 21.0, 0.1, height_m), 0.07).labels.columns() == 600);
  check_alike(ground);
  for (const std::size_t row : {0u, 6u, 14u})
    for (std::size_t from_nadir = 0; from_nadir < 80; ++from_nadir) {
      const double slant_m =
          std::sqrt(height_m * height_m + std::pow((double(from_nadir) + 0.5) * pixel_m, 2));
      const auto bin = static_cast<std::size_t>(slant_m / 0.2);
      const std::size_t ping = static_cast<std::size_t>(std::lround(2.5 * double(row)));
      const auto at = [&](std::size_t column) {
        return ground.labels.pixels.instance[row * 160 + column];
      };
      CAPTURE(row, from_nadir, bin);
      CHECK(at(80 + from_nadir) == (bin < 100 ? ping * 200 + 100 + bin + 1 : 0));
      CHECK(at(79 - from_nadir) == (bin < 100 ? ping * 200 + 99 - bin + 1 : 0));
    }
}

TEST_CASE(
    "in ground range, rows of beams that overlap lie where they are, and keep their numbers") {
  Sonar sonar;
  sonar.bins = 40;
  sonar.range_m = 20.0;
  sonar.beams = 5;
  sonar.beam_spacing_m = 0.5;  // 2 m of beams at each ping, and 1 m from ping to ping
  Waterfall line(sonar, 8);
  for (std::size_t row = 0; row < line.rows(); ++row) {
    const int beam = static_cast<int>(row % 5);
    const std::size_t ping = row / 5;
    line.pings[row].pose.position = {0.0, 1.0 * double(ping) + sonar.beam_offset_m(beam), -5.0};
    line.pings[row].altitude_m = 2.0;
    std::fill_n(line.pixels.instance.begin() + static_cast<std::ptrdiff_t>(row * line.columns()),
                line.columns(), static_cast<std::uint32_t>(row + 1));
  }
  const LabelledImage slant = slant_view(line, {});
  CHECK(slant.along_m == Approx(9.0 / 39.0));
  const LabelledImage ground = ground_view(slant, 0.25);
  REQUIRE(ground.labels.rows() == 37);
  for (std::size_t row = 0; row < ground.labels.rows(); ++row) {
    const PingRow& ping = ground.labels.pings[row];
    CAPTURE(row);
    CHECK(std::abs(ping.pose.position.y() - (0.25 * double(row) - 1.0)) <= 0.25);
    CHECK(ground.labels.pixels.instance[row * ground.labels.columns() + 40] == ping.number + 1);
  }
}

TEST_CASE("a ground view does not depend on how far above its sonar the vehicle's origin is") {
  const LabelledImage at_origin = sample_view(8, 100, 20.0, 0.25, 6.0);
  LabelledImage below = sample_view(8, 100, 20.0, 0.25, 9.0);
  below.labels.sonar.mounting.down_m = 3.0;
  CHECK(ground_view(below, 0.25).labels.pixels.instance ==
        ground_view(at_origin, 0.25).labels.pixels.instance);
}

TEST_CASE("a part of a view has that part of its pictures and labels") {
  const LabelledImage view = sample_view(12, 10, 5.0, 0.5, 2.0);
  const LabelledImage piece = cut(view, {3, 2, 7, 4});
  CHECK(piece.labels.rows() == 4);
  CHECK(piece.labels.columns() == 7);
  check_alike(piece);
  // Its upper left pixel: row 2 from the top is ping 9.
  CHECK(piece.labels.pixels.instance[3 * 7] == 9 * 20 + 3 + 1);
  CHECK(piece.labels.pings.back().pose.position.y() == view.labels.pings[9].pose.position.y());
}

TEST_CASE("ground pixels longer than the range are refused, and pings over a hole have no data") {
  LabelledImage view = sample_view(4, 10, 5.0, 0.5, 2.0);
  CHECK_THROWS_WITH(ground_view(view, 6.0), Catch::Contains("longer than the range"));
  view.labels.pings[0].altitude_m = std::nan("");
  const LabelledImage ground = ground_view(view, 0.5);
  CHECK(ground.labels.pixels.region[0] == 0);
  CHECK(ground.labels.pixels.region[1 * ground.labels.columns() + 10] == 2);
}

TEST_CASE("a ground view that does not fit into the memory is refused before it takes any") {
  const LabelledImage view = sample_view(4, 100, 20.0, 0.5, 6.0);
  // 1.5 m by 40 m of pixels of 0.1 mm: 6e9.
  CHECK_THROWS_WITH(ground_view(view, 1e-4, {.bytes = 16e9}),
                    Catch::Contains("400000 x 15001 pixels") && Catch::Contains("ground_px_m"));
  CHECK_NOTHROW(ground_view(view, 0.01, {.bytes = 16e9}));
}

TEST_CASE("a ground view can be stopped at any row") {
  const LabelledImage view = sample_view(4, 100, 20.0, 0.5, 6.0);
  struct Stop {};
  int rows = 0;
  CHECK_THROWS_AS(ground_view(view, 0.1, {},
                              [&] {
                                if (++rows == 9) throw Stop();
                              }),
                  Stop);
  CHECK(rows == 9);
}

TEST_CASE("a resampled view has the labels of the nearest pixels and the means of the pictures") {
  const LabelledImage view = sample_view(6, 5, 20.0, 0.5, 6.0);  // 10 x 6 pixels
  const LabelledImage same = resampled(view, 10, 6);
  check_alike(same);
  CHECK(same.labels.pixels.instance == view.labels.pixels.instance);

  const LabelledImage smaller = resampled(view, 5, 2);
  CHECK(smaller.across_m == Approx(2.0 * view.across_m));
  CHECK(smaller.along_m == Approx(3.0 * view.along_m));
  const auto& pixels = view.pictures.front().pixels;
  for (std::size_t row = 0; row < 2; ++row)
    for (std::size_t column = 0; column < 5; ++column) {
      double sum = 0.0;
      for (std::size_t y = 0; y < 3; ++y)
        for (std::size_t x = 0; x < 2; ++x) sum += pixels[(3 * row + y) * 10 + 2 * column + x];
      CHECK(std::abs(smaller.pictures.front().pixels[row * 5 + column] - sum / 6.0) <= 0.5 + 1e-9);
      // Rows of labels count from the other end.
      CHECK(smaller.labels.pixels.instance[row * 5 + column] ==
            view.labels.pixels.instance[(3 * row + 1) * 10 + 2 * column + 1]);
    }
  CHECK(smaller.labels.pings[0].number == 1);
  CHECK(smaller.labels.pings[1].number == 4);

  const LabelledImage larger = resampled(view, 30, 12);
  for (std::size_t i = 0; i < larger.labels.pixels.instance.size(); ++i)
    REQUIRE(larger.labels.pixels.instance[i] ==
            view.labels.pixels.instance[i / 30 / 2 * 10 + i % 30 / 3]);
}

TEST_CASE("a frame has its ping's beams, and its fan the labels and levels of the nearest bins") {
  Sonar sonar = usual_sonar(SonarKind::imaging);
  sonar.beams = 31;
  sonar.bins = 100;
  sonar.range_m = 10.0;
  constexpr std::size_t beams = 31, bins = 100, pings = 3;
  Waterfall line(sonar, pings, 7);
  Picture picture{.width = bins, .height = pings * beams, .pixels = {}};
  picture.pixels.assign(bins * pings * beams, 0);
  const auto level = [](std::size_t beam, std::size_t ping) {
    return static_cast<std::uint8_t>(50 * ping + beam);  // smooth within a ping
  };
  for (std::size_t row = 0; row < pings * beams; ++row)
    for (std::size_t bin = 0; bin < bins; ++bin) {
      const std::size_t i = row * bins + bin;
      line.pixels.instance[i] = static_cast<std::uint32_t>(i + 1);
      line.pixels.region[i] = static_cast<std::uint32_t>(Region::seabed);
      picture.pixels[(pings * beams - 1 - row) * bins + bin] = level(row % beams, row / beams);
    }
  constexpr std::size_t ping = 1;
  const LabelledImage frame = frame_view(line, ping, {picture});
  CHECK(frame.name == sonar.name + "_000008");
  CHECK(frame.geometry == "beams");
  REQUIRE(frame.labels.rows() == beams);
  CHECK(frame.labels.pings.front().number == (7 + ping) * beams);
  CHECK(frame.labels.pixels.instance.front() == ping * beams * bins + 1);
  for (std::size_t beam = 0; beam < beams; ++beam)
    REQUIRE(frame.pictures.front().pixels[(beams - 1 - beam) * bins] == level(beam, ping));

  const FanPicture fan(sonar);
  const LabelledImage view = fan_view(frame, fan);
  CHECK(view.across_m == Approx(0.1));
  REQUIRE(view.labels.rows() == view.pictures.front().height);
  REQUIRE(view.labels.columns() == view.pictures.front().width);
  std::size_t inside = 0;
  for (std::size_t row = 0; row < view.labels.rows(); ++row)
    for (std::size_t column = 0; column < view.labels.columns(); ++column) {
      const std::size_t i = view.flipped(row, column);
      const double ahead_m = (double(view.labels.rows() - row) - 0.5) * 0.1,
                   starboard_m = (double(column) + 0.5 - 0.5 * double(view.labels.columns())) * 0.1;
      const double range_m = std::hypot(ahead_m, starboard_m),
                   bearing_rad = std::atan2(starboard_m, ahead_m);
      const bool in_view = std::abs(bearing_rad) <= 0.5 * sonar.field_of_view_rad && range_m < 10.0;
      const std::uint32_t instance = view.labels.pixels.instance[i];
      REQUIRE((instance != 0) == in_view);
      if (!in_view) {
        REQUIRE(view.labels.pixels.region[i] == static_cast<std::uint32_t>(Region::no_data));
        continue;
      }
      ++inside;
      const std::size_t from = instance - 1 - ping * beams * bins;
      REQUIRE(std::abs(double(from % bins) + 0.5 - range_m / 0.1) <= 0.5 + 1e-4);
      const double step_rad = sonar.bearing_rad(1) - sonar.bearing_rad(0);
      REQUIRE(std::abs(sonar.bearing_rad(int(from / bins)) - bearing_rad) <= 0.5 * step_rad + 1e-5);
      // The picture is interpolated between the same bins.
      REQUIRE(std::abs(int(view.pictures.front().pixels[row * view.labels.columns() + column]) -
                       int(level(from / bins, ping))) <= 1);
    }
  CHECK(inside > 5000);
}
