#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::engine;
using ensonify::scatter::to_db;

namespace {
const LineArray half_metre_array{.length_m = 0.5, .wavelength_m = 0.00375};
}

TEST_CASE("a line array's one-way beam is 0.8859 lambda/L wide, its two-way beam 0.6378") {
  const double unit = half_metre_array.wavelength_m / half_metre_array.length_m;
  CHECK(to_db(half_metre_array.power(0.5 * 0.8859 * unit)) == Approx(-3.0103).margin(0.002));
  CHECK(2.0 * to_db(half_metre_array.power(0.5 * 0.6378 * unit)) == Approx(-3.0103).margin(0.002));
}

TEST_CASE("a line array's first null is at lambda/L and its first side lobe at -13.26 dB") {
  CHECK(half_metre_array.power(std::sin(half_metre_array.null_rad(1))) < 1e-20);
  double highest = 0.0;
  for (double x = 1.05; x < 1.95; x += 1e-3)
    highest = std::max(highest, half_metre_array.power(x * half_metre_array.wavelength_m /
                                                       half_metre_array.length_m));
  CHECK(to_db(highest) == Approx(-13.26).margin(0.01));
}

TEST_CASE("the two-way beam's integral is its equivalent width, 2/3 lambda/L") {
  double integral = 0.0;
  const double step = 1e-6;
  for (double psi = 0.5 * step; psi < 40.0 * half_metre_array.null_rad(1); psi += step)
    integral += 2.0 * std::pow(half_metre_array.power(std::sin(psi)), 2) * step;
  CHECK(
      integral ==
      Approx(2.0 / 3.0 * half_metre_array.wavelength_m / half_metre_array.length_m).epsilon(1e-3));
}

TEST_CASE("a ray layout's weights sum over planes to the beam's width at every elevation") {
  for (const double receive_m : {0.0, 0.25, 0.8})
    for (const int side_lobes : {0, 3}) {
      CAPTURE(receive_m, side_lobes);
      Sonar sonar;
      sonar.vertical.beamwidth_rad = 0.0;
      sonar.focused = true;
      sonar.receive_array_length_m = receive_m;
      sonar.side_lobes = side_lobes;
      const RayLayout layout = make_ray_layout(sonar, 0.00375, 7.5);
      const Beam beam(sonar, 0.00375);
      const ReceiverMotion fixed = receiver_motion({}, port_sector, 80.0, 1500.0);
      const std::size_t elevations = layout.grid->elevation_rad.size();
      // The integral of sinc^2(a s) sinc^2(b s) is the overlap of two triangles, (1 - a / 3
      // b) / b for b >= a.
      const double b = std::max(sonar.array_length_m, sonar.receive_length_m());
      const double a = std::min(sonar.array_length_m, sonar.receive_length_m());
      const double width_rad = 0.00375 / b * (1.0 - a / (3.0 * b));
      // The part beyond the first null, where the fan ends: 0.01 dB if both arrays are the same.
      const double beyond_db = side_lobes > 0 ? 0.01 : receive_m == 0.0 ? 0.015 : 0.25;
      for (std::size_t j = 0; j < elevations; ++j) {
        double sum = 0.0;
        for (std::size_t k = 0; k < layout.grid->planes.size(); ++k)
          if (layout.grid->within_beam(k, j))
            sum += beam.two_way(0, layout.samples_of(k), layout.grid->cos_elevation[j],
                                -fixed.abeam, 50.0, fixed);
        REQUIRE(std::abs(to_db(sum / width_rad)) < beyond_db);
      }
    }
}

TEST_CASE("in the near field too, a plane's samples sum to the beam's integral at every range") {
  Sonar sonar;
  sonar.vertical.beamwidth_rad = 0.0;
  for (const double height_m : {3.0, 8.0, 30.0}) {
    const RayLayout layout = make_ray_layout(sonar, 0.00375, sonar.range_m / height_m);
    const Beam beam(sonar, 0.00375);
    const LineArray its_array{sonar.array_length_m, 0.00375};
    const ReceiverMotion fixed = receiver_motion({}, port_sector, 80.0, 1500.0);
    CHECK(layout.grid->planes.size() <= 14);
    for (const double range_m : {1.0, 1.1, 1.5, 2.3, 4.0, 9.0}) {
      const double r = range_m * height_m;
      double width_rad = 0.0;
      const double step = 2e-5;
      for (double s = 0.5 * step; s < 0.25; s += step)
        width_rad += 2.0 * step * std::pow(its_array.power(s, r), 2);
      double sum = 0.0;
      for (std::size_t k = 0; k < layout.grid->planes.size(); ++k)
        if (std::abs(layout.grid->planes[k].sin_azimuth) <= layout.grid->sin_truncation)
          sum += beam.two_way(0, layout.samples_of(k), 1.0, fixed.down, r, fixed);
      CAPTURE(height_m, r);
      CHECK(to_db(sum / width_rad) == Approx(0.0).margin(0.05));
    }
  }
}

TEST_CASE(
    "a receiver that has moved and turned weights the echo by the direction in its own frame") {
  Sonar sonar;
  sonar.focused = true;
  Pose pose{.position = {1, 2, -3}, .roll_rad = 0.02, .pitch_rad = -0.1, .heading_rad = 0.7};
  pose.velocity_mps = {1.5, 2.0, -0.3};
  pose.roll_rate_radps = 0.2;
  pose.pitch_rate_radps = -0.08;
  pose.heading_rate_radps = 0.1;
  const double wavelength_m = 0.00375, sound_speed_mps = 1500.0;
  const LineArray its_array{sonar.array_length_m, wavelength_m};
  const Beam beam(sonar, wavelength_m);
  const std::array<BeamSample, 1> sample{{{0.0021f, 1.0f}}};
  for (const Sector& sector : sidescan_sectors) {
    const ReceiverMotion motion = receiver_motion(pose, sector, 80.0, sound_speed_mps);
    CHECK_FALSE(motion.steady);
    const Eigen::Matrix3d body = body_to_world(pose);
    const double sign = sector.number == 0 ? -1.0 : 1.0;
    const Eigen::Vector3d direction =
        (0.0021 * body.col(0) + sign * body.col(1) * 0.8 + body.col(2) * 0.6).normalized();
    for (const double r : {9.0, 40.0, 79.0}) {
      const Pose then = pose.after(2.0 * r / sound_speed_mps);
      const Eigen::Vector3d way = (pose.position + r * direction - then.position).normalized();
      const Eigen::Matrix3d its_body = body_to_world(then);
      const double received_power = sonar.vertical.power(
          std::atan2(way.dot(its_body.col(2)), sign * way.dot(its_body.col(1))), sector);
      const double sent_power = sonar.vertical.power(std::atan2(0.6, 0.8), sector);
      const double expected = its_array.power(direction.dot(body.col(0))) *
                              its_array.power(way.dot(its_body.col(0))) * sent_power *
                              received_power;
      CAPTURE(r, sector.name);
      CHECK(beam.two_way(sector.number, sample, 1.0, direction, r, motion) ==
            Approx(expected).epsilon(0.01));
    }
  }
  CHECK(receiver_motion(Pose{}, port_sector, 80.0, sound_speed_mps).steady);
}

TEST_CASE(
    "the vertical pattern peaks at its tilt, is 3 dB down at half its width, and has a floor") {
  const VerticalPattern pattern;
  for (const Sector& sector : sidescan_sectors) {
    const auto level_db = [&](double depression_rad) {
      return to_db(pattern.power(depression_rad, sector));
    };
    CHECK(level_db(pattern.tilt_rad) == Approx(0.0).margin(1e-9));
    for (const double sign : {-1.0, 1.0})
      CHECK(level_db(pattern.tilt_rad + sign * 0.5 * pattern.beamwidth_rad) ==
            Approx(-3.0103).margin(0.01));
    CHECK(level_db(pattern.tilt_rad + std::numbers::pi) == Approx(-20.0));
    for (double d = -3.0; d < 3.0; d += 0.01) CHECK(level_db(d) >= -20.0 - 1e-9);
  }
}

TEST_CASE(
    "a measured vertical pattern is linear in dB between its levels and constant beyond them") {
  VerticalPattern pattern;
  pattern.measured = {std::vector<VerticalLevel>{{-0.5, -12.0}, {0.5, -2.0}, {1.0, -7.0}},
                      std::vector<VerticalLevel>{{0.0, 0.0}, {1.5, -30.0}}};
  const auto port_db = [&](double d) { return to_db(pattern.power(d, port_sector)); };
  const auto starboard_db = [&](double d) { return to_db(pattern.power(d, starboard_sector)); };
  CHECK(port_db(-0.5) == Approx(-12.0));
  CHECK(port_db(0.25) == Approx(-4.5));
  CHECK(port_db(0.75) == Approx(-4.5));
  CHECK(port_db(-1.2) == Approx(-12.0));
  CHECK(port_db(2.0) == Approx(-7.0));
  CHECK(starboard_db(0.75) == Approx(-15.0));
  CHECK(starboard_db(1.5) == Approx(-30.0));  // no floor unless one is given
  pattern.floor_db = -25.0;
  CHECK(starboard_db(1.5) == Approx(-25.0));
  pattern.port_mount_rad = 0.1;  // turns the whole pattern down
  CHECK(port_db(0.35) == Approx(-4.5));
  CHECK(starboard_db(0.75) == Approx(-15.0));
}

TEST_CASE("a floor below fills nulls from the axis to the element's back, and no others") {
  VerticalPattern with;
  with.beamwidth_rad = 40.0 * degree;
  with.tilt_rad = 15.0 * degree;
  with.floor_db = -60.0;
  VerticalPattern without = with;
  with.floor_below_db = -15.0;
  const auto db = [](const VerticalPattern& pattern, double depression_deg) {
    return to_db(pattern.power(depression_deg * degree, port_sector));
  };
  CHECK(db(without, 65.5) < -40.0);  // the null of sinc^2
  CHECK(db(with, 65.5) == Approx(-15.0));
  with.floor_below_db = -12.0;  // above the side lobe that lies past straight down
  for (const double depression_deg : {85.0, 91.0, 104.0}) {
    CAPTURE(depression_deg);
    CHECK(db(with, depression_deg) == Approx(-12.0));
  }
  for (const double depression_deg : {-90.0, -40.0, -36.0, 0.0, 15.0, 30.0, 106.0, 120.0})
    CHECK(db(with, depression_deg) == db(without, depression_deg));
  // An element that looks up fills them to straight down.
  with.tilt_rad = without.tilt_rad = -10.0 * degree;
  CHECK(db(with, 89.0) == Approx(-12.0));
  CHECK(db(with, 91.0) == db(without, 91.0));
}

TEST_CASE("what lies beyond the fan adds less than 0.1 dB over a bed turned by up to 10 degrees") {
  struct Pattern {
    double beamwidth_deg, tilt_deg;
    std::optional<double> floor_db, floor_below_db;
  };
  for (const auto& [beamwidth_deg, tilt_deg, floor_db, floor_below_db] :
       {Pattern{50.0, 20.0, {}, {}}, Pattern{40.0, 10.0, -30.0, -13.0},
        Pattern{60.0, 30.0, -15.0, {}}, Pattern{110.0, 20.0, -40.0, {}}}) {
    Sonar sonar;
    sonar.vertical.beamwidth_rad = beamwidth_deg * degree;
    sonar.vertical.tilt_rad = tilt_deg * degree;
    sonar.vertical.floor_db = floor_db;
    sonar.vertical.floor_below_db = floor_below_db;
    const double end_rad = sonar.sector_end_rad();
    CAPTURE(beamwidth_deg, tilt_deg, end_rad / degree);
    CHECK(end_rad >= 100.0 * degree);
    CHECK(end_rad < 135.0 * degree);
    for (const Sector& sector : sidescan_sectors)
      for (double turned_deg = -10.0; turned_deg <= 10.0; turned_deg += 1.0)
        for (double off_deg = 0.1; off_deg < 60.0; off_deg += 0.1) {
          const double far_rad = (90.0 + turned_deg + off_deg) * degree;
          if (far_rad < end_rad) continue;
          const double here = sonar.vertical.power(2.0 * (90.0 + turned_deg) * degree - far_rad,
                                                   sector),
                       there = sonar.vertical.power(far_rad, sector);
          CAPTURE(turned_deg, off_deg);
          REQUIRE(to_db(1.0 + there * there / (here * here)) < 0.1);
        }
  }
  // Without a vertical pattern it ends at the most; it is not so wide that planes get too far
  // apart.
  Sonar sonar;
  sonar.vertical.beamwidth_rad = 0.0;
  CHECK(sonar.sector_end_rad() == Approx(135.0 * degree));
  sonar.sector_low_rad = -30.0 * degree;
  CHECK(sonar.sector_end_rad() == Approx(115.0 * degree));
  sonar.sector_low_rad = -80.0 * degree;
  CHECK(sonar.sector_end_rad() == Approx(90.0 * degree));
  sonar.sector_high_rad = 60.0 * degree;
  CHECK(sonar.sector_end_rad() == 60.0 * degree);
}

TEST_CASE(
    "a ripple keeps the pattern at its maxima and has its minima at the requested depressions") {
  VerticalPattern even, pattern;
  even.beamwidth_rad = pattern.beamwidth_rad = 0.0;
  pattern.ripple_db = 8.0;
  pattern.ripple_dark_rad = 0.5;
  pattern.ripple_period_rad = 0.4;
  pattern.starboard_mount_rad = 0.05;
  for (int i = -2; i <= 2; ++i) {
    CHECK(to_db(pattern.power(0.5 + 0.4 * i, port_sector)) == Approx(-8.0));
    CHECK(to_db(pattern.power(0.7 + 0.4 * i, port_sector)) == Approx(0.0).margin(1e-9));
    CHECK(to_db(pattern.power(0.6 + 0.4 * i, port_sector)) == Approx(-4.0));
    CHECK(to_db(pattern.power(0.55 + 0.4 * i, starboard_sector)) == Approx(-8.0));
  }
}

TEST_CASE("the table of a vertical pattern over direction agrees with the pattern") {
  VerticalPattern pattern;
  pattern.ripple_db = 6.0;
  const VerticalTable table(pattern, port_sector);
  for (double d = -3.1; d < 3.1; d += 0.0137)
    CHECK(to_db(table.power(3.0 * std::cos(d), 3.0 * std::sin(d))) ==
          Approx(to_db(pattern.power(d, port_sector))).margin(0.01));
}

TEST_CASE("an unfocused array's beam changes from the array's length nearby to sinc^2 far away") {
  const double unit = half_metre_array.wavelength_m / half_metre_array.length_m;
  for (double x = 0.0; x < 3.0; x += 0.1)
    CHECK(half_metre_array.power(x * unit, 1e6) ==
          Approx(half_metre_array.power(x * unit)).margin(1e-6));
  // The radiated power is the same at all ranges: the integral over sin(psi) is lambda / L
  // (Parseval).
  for (const double range_m : {2.0, 5.0, 20.0, 100.0}) {
    double sum = 0.0;
    const double step = 0.02 * unit;
    for (double s = 0.5 * step; s < 150.0 * unit; s += step)
      sum += 2.0 * step * half_metre_array.power(s, range_m);
    CHECK(sum == Approx(unit).epsilon(2e-3));
  }
  // On the axis, Fresnel's integrals: |C(w) + i S(w)|^2 / w^2 with w = L / sqrt(2 lambda r), and
  // C(1) = 0.7798934, S(1) = 0.4382591 (Abramowitz and Stegun, table 7.7).
  const double range_m =
      half_metre_array.length_m * half_metre_array.length_m / (2.0 * half_metre_array.wavelength_m);
  CHECK(half_metre_array.power(0.0, range_m) ==
        Approx(0.7798934 * 0.7798934 + 0.4382591 * 0.4382591).epsilon(1e-5));
  // Abeam of the end of a long array the intensity is a quarter of that at its middle.
  const double near_m = 0.02 * range_m;
  CHECK(half_metre_array.power(0.5 * half_metre_array.length_m / near_m, near_m) *
            half_metre_array.length_m * half_metre_array.length_m /
            (half_metre_array.wavelength_m * near_m) ==
        Approx(0.25).epsilon(0.1));
}

TEST_CASE(
    "the square of the arrays' field is the two-way beam: near, shaded, in zones, on the move") {
  Pose moving;
  moving.velocity_mps = {3.0, 0.5, 0.0};
  moving.heading_rate_radps = 0.05;
  Sonar near, focused, shaded, zones, several;
  focused.focused = true;
  shaded.receive_shading = ShadingKind::hann;
  shaded.receive_array_length_m = 0.8;
  zones.focus_zones_m = {12.0, 50.0};
  several.beams = 5;
  several.array_length_m = 0.06;
  several.receive_array_length_m = 0.7;
  several.focused = true;
  for (Sonar sonar : {near, focused, shaded, zones, several})
    for (const Pose& pose : {Pose{}, moving}) {
      sonar.vertical.beamwidth_rad = 0.0;
      const Beam beam(sonar, 0.00375, sonar.beam_offset_m(sonar.beams - 1));
      const ReceiverMotion motion = receiver_motion(pose, starboard_sector, 75.0, 1500.0);
      const Eigen::Matrix3d body = body_to_world(pose);
      for (const double range_m : {10.0, 20.0, 60.0}) {
        const Eigen::Vector3d abeam = body.col(1);
        const ArrayField field = beam.field_near(abeam, range_m, motion);
        const double middle = 0.5 * (field.low + field.high), half = 0.5 * (field.high - field.low);
        REQUIRE(half > 0.0);
        for (double share = -1.2; share < 1.2; share += 0.0371) {
          const double sine = middle + share * half;
          const std::array<BeamSample, 1> sample{{{static_cast<float>(sine), 1.0f}}};
          CAPTURE(sonar.beams, motion.steady, range_m, share);
          const double power = beam.two_way(1, sample, 1.0, abeam, range_m, motion);
          if (std::abs(share) > 1.001) {
            CHECK(power == 0.0);
          } else if (std::abs(share) < 0.999) {
            CHECK(std::norm(field.at(sine)) == Approx(power).margin(0.006));
          }
        }
      }
    }
}

TEST_CASE("the array's table agrees with the array's pattern, near and far") {
  const ArrayTable table(1);
  for (const double nearness : {0.0, 0.01, 0.3, 1.0, 2.7, 4.9, 9.3}) {
    const double range_m = 0.5 * half_metre_array.length_m * half_metre_array.length_m /
                           (half_metre_array.wavelength_m * std::max(nearness, 1e-9));
    const ArrayTable::Row row = table.row(nearness);
    for (double x = 0.0; x < nearness + 2.0; x += 0.0731) {
      CAPTURE(nearness, x);
      const double exact = half_metre_array.power(
          x * half_metre_array.wavelength_m / half_metre_array.length_m, range_m);
      CHECK(row.scale * table.value(row, static_cast<float>(x)) * (1.0 + 2.0 * nearness) ==
            Approx(exact * (1.0 + 2.0 * nearness)).margin(nearness < 5.0 ? 0.003 : 0.02));
      CHECK(table.value(row, -1.0f) == table.value(row, 1.0f));
    }
  }
}

TEST_CASE(
    "a sector with its own element has the pattern about its axis, and a fan between its ends") {
  const Sector down{"down", 1.0, 2, Element{90.0 * degree, 60.0 * degree, 120.0 * degree}};
  Sonar sonar;
  sonar.vertical.ripple_db = 1.0;
  sonar.vertical.measured = {{{{0.3, -3.0}}, {{0.3, -3.0}}}};  // of the two sides
  VerticalPattern of_formula = sonar.vertical;
  of_formula.measured = {};
  for (const double off_deg : {-80.0, -25.0, 0.0, 10.0, 60.0})
    CHECK(sonar.vertical.power((90.0 + off_deg) * degree, down) ==
          Approx(of_formula.power(sonar.vertical.tilt_rad + off_deg * degree, starboard_sector)));
  const RayLayout layout = make_ray_layout(sonar, 0.00375, 4.0, down.element);
  const std::vector<double>& elevation_rad = layout.grid->elevation_rad;
  CHECK(layout.grid->middle_depression_rad == Approx(90.0 * degree));
  CHECK(elevation_rad.front() == Approx(-30.0 * degree).margin(1e-3));
  CHECK(elevation_rad.back() == Approx(30.0 * degree).margin(1e-3));
}
