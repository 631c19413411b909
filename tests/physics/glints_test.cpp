// Glints of solids against closed forms and sums over their surfaces.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/objects/solids.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// Two plates that meet at the edge x = y = 0, which is `height_m` high, and open towards -x. One
/// reaches `one_m` from the edge, 45 degrees to port of -x, the other plate reaches `other_m`. The
/// angle between the plates is a right angle plus excess_rad.
refine::TriangleMesh folded_plate(double one_m, double other_m, double height_m,
                                  double excess_rad = 0.0) {
  const auto corner = [&](double bearing_rad, double out_m, double up) {
    return Eigen::Vector3d(-out_m * std::cos(bearing_rad), out_m * std::sin(bearing_rad),
                           (up - 0.5) * height_m)
        .cast<float>()
        .eval();
  };
  const double half_rad = 45.0 * degree + 0.5 * excess_rad;
  refine::TriangleMesh mesh;
  mesh.positions = {corner(0.0, 0.0, 0.0),           corner(0.0, 0.0, 1.0),
                    corner(half_rad, one_m, 0.0),    corner(half_rad, one_m, 1.0),
                    corner(-half_rad, other_m, 0.0), corner(-half_rad, other_m, 1.0)};
  mesh.faces = {{0, 1, 3}, {0, 3, 2}, {0, 4, 5}, {0, 5, 1}};
  return mesh;
}

/// I of ObjectEchoes for the echo that such plates return by way of both, in the plane across the
/// edge: Kirchhoff's integral from the sonar to one plate, from there to the other, and back,
/// in both orders, divided by the integral of a flat plate. It shares no code with the program.
double double_bounce_m2(double one_m, double other_m, double turned_rad, double excess_rad,
                        double range_m, double wavelength_m) {
  using Complex = std::complex<double>;
  using Place = Eigen::Vector2d;
  const double k = 2.0 * std::numbers::pi / wavelength_m;
  struct Plate {
    Place begin, way, normal;
    double length_m;
  };
  const auto field = [&](const Place& from, const Place& to) {  // H0(k r)
    const double r = (to - from).norm();
    return std::polar(std::sqrt(2.0 / (std::numbers::pi * k * r)), k * r - 0.25 * std::numbers::pi);
  };
  const auto reflected = [&](const Place& from, const Plate& plate, const Place& to) {
    const Place off = to - from;  // the sound that leaves a rigid plate's place with unit pressure
    return field(from, to) * Complex(0.5 * k * off.dot(plate.normal) / off.norm());
  };
  const auto places = [&](const Plate& plate) {
    const auto count = static_cast<std::size_t>(12.0 * plate.length_m / wavelength_m);
    std::vector<Place> all(count);
    for (std::size_t i = 0; i < count; ++i)
      all[i] = plate.begin + (double(i) + 0.5) * plate.length_m / double(count) * plate.way;
    return all;
  };
  const auto echo = [&](const Place& sonar, std::span<const Plate> plates) {
    std::vector<Place> before{sonar};
    std::vector<Complex> pressure{1.0};
    const Plate* from = nullptr;
    double step_m = 1.0;
    const auto arriving = [&](const Place& at) {
      Complex sum = 0.0;
      for (std::size_t i = 0; i < before.size(); ++i)
        sum += pressure[i] * (from ? step_m * reflected(before[i], *from, at) : field(sonar, at));
      return sum;
    };
    for (const Plate& plate : plates) {
      std::vector<Place> now = places(plate);
      std::vector<Complex> there;
      for (const Place& at : now) there.push_back(arriving(at));
      step_m = plate.length_m / double(now.size());
      before = std::move(now);
      pressure = std::move(there);
      from = &plate;
    }
    return arriving(sonar);
  };
  const double angle_rad = 45.0 * degree + 0.5 * excess_rad - turned_rad;
  const Place sonar = range_m * Place(std::cos(angle_rad), std::sin(angle_rad));
  const double s = std::sin(excess_rad), c = std::cos(excess_rad);
  const Plate one{{0, 0}, {1, 0}, {0, 1}, one_m}, other{{0, 0}, {-s, c}, {c, s}, other_m};
  const double flat_m = 0.2 * std::sqrt(wavelength_m * range_m);
  const Plate flat{{-0.5 * flat_m, 0.0}, {1, 0}, {0, 1}, flat_m};
  const Complex both = echo(sonar, std::array{one, other}) + echo(sonar, std::array{other, one});
  const Complex single = echo({0.0, range_m}, std::array{flat});
  return std::norm(both / single) * flat_m * flat_m;
}

/// An upright ring that faces -x.
refine::TriangleMesh upright_ring(double inner_m, double outer_m) {
  constexpr int sides = 64;
  refine::TriangleMesh mesh;
  const auto at = [&](double radius_m, int side) {
    const double angle_rad = 2.0 * std::numbers::pi * (side % sides) / sides;
    return Eigen::Vector2d(radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad));
  };
  for (int i = 0; i < sides; ++i) {
    add_upright(mesh, {at(inner_m, i), at(outer_m, i), at(outer_m, i + 1)});
    add_upright(mesh, {at(inner_m, i), at(outer_m, i + 1), at(inner_m, i + 1)});
  }
  return mesh;
}

}  // namespace

TEST_CASE("a smooth sphere has a^2 / 4 at every frequency, from every side, by coarse facets") {
  ShapeSize size;
  size.diameter_m = 1.0;
  for (const double frequency_hz : {100e3, 400e3, 900e3})
    for (const double facet_deg : {7.5, 2.0})
      for (const double heading_deg : {0.0, 11.0, 37.0}) {
        size.facet_rad = facet_deg * degree;
        const Sonar sonar = wide_sonar(20.0, frequency_hz);
        const Body ball{body("sphere", size), nothing, 1.0, heading_deg * degree};
        CAPTURE(frequency_hz, facet_deg, heading_deg);
        CHECK(target_strength_db(echo_of(ball, sonar, 10.0), sonar) ==
              Approx(scatter::to_db(std::pow(0.25 * 9.5 / 10.0, 2.0))).margin(0.3));
      }
}

TEST_CASE("a smooth sphere has a^2 / 4 also in a beam that is narrower than its facets") {
  // 3 cm at the front of the sphere, whose facets are of 13 and of 65 cm.
  for (const auto& [radius_m, range_m] : {std::pair{1.0, 10.0}, {10.0, 20.0}}) {
    Solids ball;
    ball.ball(Eigen::Vector3d::Zero(), radius_m, radius_m == 1.0 ? 3 : 4);
    Sonar sonar = wide_sonar(range_m + 3.0, 900e3);
    sonar.array_length_m = 0.03 * range_m;
    for (int i = 0; i < 24; ++i) {
      const double heading_deg = 2.9 * i;
      CAPTURE(radius_m, heading_deg);
      CHECK(target_strength_db(
                echo_of({ball.mesh, nothing, 1.0, heading_deg * degree}, sonar, range_m + radius_m),
                sonar) ==
            Approx(scatter::to_db(std::pow(0.5 * radius_m * range_m / (radius_m + range_m), 2.0)))
                .margin(0.2));
    }
  }
}

TEST_CASE("a smooth cylinder glints as its Fresnel zones say: a r / 4 near, a L^2 / 2 lambda far") {
  ShapeSize size;
  size.diameter_m = 0.53;
  size.length_m = 2.0;
  for (const double frequency_hz : {100e3, 400e3, 900e3})
    for (const double range_m : {10.0, 50.0, 200.0, 1000.0}) {
      const double wavelength_m = 1500.0 / frequency_hz;
      Sonar sonar = wide_sonar(range_m + 2.0, frequency_hz);
      sonar.bins = 2000;
      sonar.array_length_m = 6e3 / frequency_hz;  // its beam is wide against the Fresnel zone
      const Body cylinder{body("cylinder", size), nothing, 1.0};
      CAPTURE(frequency_hz, range_m);
      CHECK(target_strength_db(echo_of(cylinder, sonar, range_m), sonar) ==
            Approx(cylinder_db(0.265, 2.0, range_m - 0.265, wavelength_m)).margin(0.3));
    }
  // The limits, and a quadrature over the whole illuminated side (2 x 0.53 m, 400 kHz, at 50 and
  // 1000 m), which agrees with the sum over the length.
  CHECK(cylinder_db(0.265, 0.1, 50.0, 0.00375) ==
        Approx(scatter::to_db(0.265 * 0.01 / (2.0 * 0.00375))).margin(0.1));
  CHECK(cylinder_db(0.265, 30.0, 50.0, 0.00375) ==
        Approx(scatter::to_db(0.265 * 50.0 / 4.0)).margin(0.3));
  CHECK(cylinder_db(0.265, 2.0, 49.735, 0.00375) == Approx(5.96).margin(0.1));
  CHECK(cylinder_db(0.265, 2.0, 999.735, 0.00375) == Approx(20.40).margin(0.1));
}

TEST_CASE("a long smooth pipe glints wherever the sonar passes it, and does not end dark") {
  // Near, a r / 4 of the waves that a sonar sends: only the Fresnel zone abeam counts. At an end
  // half of that zone is left, a quarter of the energy.
  ShapeSize size;
  size.diameter_m = 0.3;
  size.length_m = 200.0;
  const refine::TriangleMesh pipe = body("cylinder", size);
  constexpr double range_m = 30.0, side_m = range_m - 0.15;
  const Sonar sonar = wide_sonar(range_m + 2.0);
  const double whole_db = scatter::to_db(0.15 * side_m / 4.0 * side_m / range_m);
  for (const double north_m : {-99.0, -60.0, -3.7, 0.0, 25.0, 80.0, 99.0, 100.0, 110.0}) {
    const double expected_db = std::abs(north_m) < 100.0 ? whole_db : whole_db - 6.0;
    const double measured_db =
        target_strength_db(echo_of({pipe, nothing, 1.0, 0.0, north_m}, sonar, range_m), sonar);
    CAPTURE(north_m);
    if (north_m > 100.0)
      CHECK(measured_db < whole_db - 20.0);
    else
      CHECK(measured_db == Approx(expected_db).margin(0.5));
  }
}

TEST_CASE("far away a cylinder's glint is sinc^2(k L sin e), a plate's is A^2 / lambda^2") {
  ShapeSize size;
  size.diameter_m = 0.2;
  size.length_m = 0.25;
  size.width_m = 0.02;
  size.shape_height_m = 0.2;
  constexpr double range_m = 100.0, wavelength_m = 1500.0 / 400e3;
  Sonar sonar = wide_sonar(range_m + 2.0);
  sonar.bins = 2000;
  const auto at = [&](const char* shape, double turned_rad) {
    return target_strength_db(
        echo_of({body(shape, size), nothing, 1.0, turned_rad}, sonar, range_m), sonar);
  };
  const double level_db = scatter::to_db(0.1 * 0.0625 / (2.0 * wavelength_m));
  CHECK(at("cylinder", 0.0) == Approx(level_db).margin(0.3));
  for (const double share : {0.5, 0.9}) {  // of the -3 dB width, 0.443 lambda / L
    const double turned_rad = 0.5 * share * 0.443 * wavelength_m / size.length_m.value();
    const double x = 2.0 * std::numbers::pi / wavelength_m * 0.25 * std::sin(turned_rad);
    CHECK(at("cylinder", turned_rad) - at("cylinder", 0.0) ==
          Approx(20.0 * std::log10(std::sin(x) / x)).margin(0.2));
  }
  CHECK(at("box", 0.0) ==
        Approx(scatter::to_db(std::pow(0.25 * 0.2 / wavelength_m, 2.0))).margin(0.3));
}

TEST_CASE("the round end of a cylinder glints as Kirchhoff's integral over its disc has it") {
  constexpr double range_m = 20.0, wavelength_m = 1500.0 / 400e3, length_m = 0.4;
  const Sonar sonar = wide_sonar(range_m + 2.0);
  // |integral of exp(2 i k d) / d^2 over the disc|^2 r^4 / lambda^2, with the distance d.
  const auto end_db = [&](double radius_m, double turned_rad) {
    constexpr int rings = 400, spokes = 360;
    const double c = std::cos(turned_rad), s = std::sin(turned_rad);
    std::complex<double> sum = 0.0;
    for (int i = 0; i < rings; ++i)
      for (int k = 0; k < spokes; ++k) {
        const double from_axis_m = radius_m * (i + 0.5) / rings,
                     angle_rad = k * 360.0 / spokes * degree;
        const double across_m = from_axis_m * std::cos(angle_rad);
        const double d =
            std::hypot(range_m - 0.5 * length_m * c + across_m * s,
                       0.5 * length_m * s + across_m * c, from_axis_m * std::sin(angle_rad));
        sum += from_axis_m / (d * d) *
               std::polar(1.0, 4.0 * std::numbers::pi / wavelength_m * (d - range_m));
      }
    const double ring_m2 = radius_m / rings * 2.0 * std::numbers::pi / spokes;
    return scatter::to_db(
        std::norm(ring_m2 * std::pow(range_m - 0.5 * length_m, 2) / wavelength_m * sum));
  };
  // The end has as many corners as the cylinder has sides, which moves the side lobes a little.
  for (const double radius_m : {0.03, 0.1, 0.25, 0.5}) {
    ShapeSize size;
    size.diameter_m = 2.0 * radius_m;
    size.length_m = length_m;
    const refine::TriangleMesh cylinder = body("cylinder", size);
    for (const double turned_deg : {0.0, 0.3, 0.6, 1.0}) {
      const double turned_rad = turned_deg * degree;
      CAPTURE(radius_m, turned_deg);
      CHECK(target_strength_db(
                echo_of({cylinder, nothing, 1.0, 90.0 * degree + turned_rad}, sonar, range_m),
                sonar) == Approx(end_db(radius_m, turned_rad)).margin(0.6));
    }
  }
}

TEST_CASE("a ring, a plate with a window and an angled one glint as Kirchhoff's integral has it") {
  const refine::TriangleMesh ring = upright_ring(0.4, 0.6);
  const refine::TriangleMesh window =
      upright_cells(1.0, [](int i, int k) { return i % 3 == 0 || k % 3 == 0; });
  const refine::TriangleMesh angled =
      upright_cells(1.0, [](int i, int k) { return i == 0 || k == 0; });
  for (const refine::TriangleMesh* mesh : {&ring, &window, &angled})
    for (const auto& [frequency_hz, range_m] :
         {std::pair{100e3, 10.0}, {100e3, 40.0}, {100e3, 200.0}, {400e3, 40.0}, {400e3, 200.0}})
      for (const double turned_deg : {0.0, 0.3})
        for (const double north_m : {0.0, 0.25, -0.45}) {
          Sonar sonar = wide_sonar(range_m + 4.0, frequency_hz);
          lengthen_pulse(sonar, range_m);
          const Body body{*mesh, nothing, 1.0, turned_deg * degree, north_m};
          const double expected_db = kirchhoff_db(body, sonar, range_m);
          const double got_db = target_strength_db(echo_of(body, sonar, range_m), sonar);
          CAPTURE(mesh->faces.size(), frequency_hz, range_m, turned_deg, north_m, expected_db,
                  got_db);
          const double mirror_m2 = 0.25 * range_m * range_m;
          CHECK(scatter::from_db(got_db) ==
                Approx(scatter::from_db(expected_db)).epsilon(0.2).margin(0.01 * mirror_m2));
        }
}

TEST_CASE(
    "a plate in a beam narrower than the Fresnel zone glints as Kirchhoff's integral has it") {
  const refine::TriangleMesh ring = upright_ring(0.4, 0.6);
  const refine::TriangleMesh window =
      upright_cells(1.0, [](int i, int k) { return i % 3 == 0 || k % 3 == 0; });
  refine::TriangleMesh plate = upright_cells(1.0, [](int, int) { return true; });
  for (Eigen::Vector3f& place : plate.positions) place.z() *= 0.6f;
  refine::TriangleMesh leaning = plate, round;
  for (Eigen::Vector3f& place : leaning.positions)
    place = Eigen::AngleAxisf(0.5f, Eigen::Vector3f::UnitX()) * place;
  for (int i = 0; i < 64; ++i) {
    const auto rim = [](int side) {
      const double angle_rad = 2.0 * std::numbers::pi * side / 64.0;
      return Eigen::Vector2d(0.5 * std::cos(angle_rad), 0.3 * std::sin(angle_rad));
    };
    add_upright(round, {Eigen::Vector2d::Zero(), rim(i), rim(i + 1)});
  }
  struct Case {
    const refine::TriangleMesh* mesh;
    double frequency_hz, array_m, range_m;
    bool focused;
  };
  for (const Case& of : {Case{&plate, 400e3, 0.5, 20.0, true},
                         {&plate, 900e3, 0.5, 20.0, true},
                         {&plate, 400e3, 0.5, 60.0, true},
                         {&leaning, 400e3, 1.0, 8.0, true},
                         {&leaning, 100e3, 0.5, 8.0, true},
                         {&round, 400e3, 0.5, 20.0, true},
                         {&plate, 400e3, 0.5, 20.0, false},
                         {&leaning, 400e3, 0.5, 8.0, false},
                         {&window, 400e3, 0.5, 60.0, true},
                         {&ring, 400e3, 0.5, 60.0, false}}) {
    Sonar sonar = wide_sonar(of.range_m + 2.0, of.frequency_hz);
    sonar.array_length_m = of.array_m;
    sonar.focused = of.focused;
    lengthen_pulse(sonar, of.range_m);
    struct Level {
      double turned_deg, north_m, expected, got;
    };
    std::vector<Level> levels;
    double brightest = 0.0;
    for (const double turned_deg : {0.0, 0.3, 0.9})
      for (const double north_m : {0.0, 0.25, -0.47}) {
        const Body body{*of.mesh, nothing, 1.0, turned_deg * degree, north_m};
        levels.push_back(
            {turned_deg, north_m, scatter::from_db(kirchhoff_db(body, sonar, of.range_m)),
             scatter::from_db(target_strength_db(echo_of(body, sonar, of.range_m), sonar))});
        brightest = std::max(brightest, levels.back().expected);
      }
    for (const Level& level : levels) {
      CAPTURE(of.frequency_hz, of.array_m, of.range_m, of.focused, level.turned_deg, level.north_m);
      CHECK(level.got == Approx(level.expected).epsilon(0.1).margin(0.002 * brightest));
    }
  }
}

TEST_CASE("a cylinder in a beam narrower than the Fresnel zone glints as the sum over its length") {
  ShapeSize size;
  size.diameter_m = 0.4;
  size.length_m = 2.0;
  const refine::TriangleMesh cylinder = body("cylinder", size);
  for (const bool focused : {true, false})
    for (const double frequency_hz : {100e3, 400e3})
      for (const double north_m : {0.0, 0.7, 1.0}) {
        Sonar sonar = wide_sonar(22.0, frequency_hz);
        sonar.array_length_m = 0.8;
        sonar.focused = focused;
        CAPTURE(focused, frequency_hz, north_m);
        CHECK(target_strength_db(echo_of({cylinder, nothing, 1.0, 0.0, north_m}, sonar, 20.0),
                                 sonar) ==
              Approx(cylinder_db(0.2, 2.0, 19.8, 1500.0 / frequency_hz, &sonar, north_m))
                  .margin(0.3));
      }
}

TEST_CASE("two plates in a right angle glint by way of both, as Kirchhoff's integral has it") {
  constexpr double range_m = 20.0, wavelength_m = 1500.0 / 100e3, height_m = 0.1;
  const Sonar sonar = wide_sonar(range_m + 2.0, 100e3);
  const auto strength_db = [&](double one_m, double other_m, double turned_deg, double excess_deg) {
    return target_strength_db(echo_of({folded_plate(one_m, other_m, height_m, excess_deg * degree),
                                       nothing, 1.0, turned_deg * degree},
                                      sonar, range_m),
                              sonar);
  };
  // The echo of a square corner, seen from the middle direction, is 2 a^2 b^2 / lambda^2. From
  // other directions, and for angles not quite 90 degrees, the mirror is narrower
  // (double_bounce_m2()).
  CHECK(
      strength_db(height_m, height_m, 0.0, 0.0) ==
      Approx(scatter::to_db(2.0 * std::pow(height_m * height_m / wavelength_m, 2.0))).margin(0.3));
  for (const auto& [one_m, other_m] : {std::pair{0.3, 0.3}, {0.3, 0.2}, {0.5, 0.4}})
    for (const double turned_deg : {-25.0, -15.0, 0.0, 10.0, 20.0})
      for (const double excess_deg : {0.0, 0.2, 0.5}) {
        const double across_m2 = double_bounce_m2(one_m, other_m, turned_deg * degree,
                                                  excess_deg * degree, range_m, wavelength_m);
        CAPTURE(one_m, other_m, turned_deg, excess_deg);
        CHECK(
            strength_db(one_m, other_m, turned_deg, excess_deg) ==
            Approx(scatter::to_db(across_m2 * std::pow(height_m / wavelength_m, 2.0))).margin(0.5));
      }
  // From outside the angle, or along the edge at a slant, nothing of it comes back.
  CHECK(strength_db(0.3, 0.3, 100.0, 0.0) < -40.0);
  refine::TriangleMesh triangles = folded_plate(0.3, 0.3, 0.3);
  triangles.faces = {{0, 1, 2}, {0, 4, 1}};
  for (const double turned_deg : {100.0, 150.0, 180.0, 210.0})
    CHECK(target_strength_db(
              echo_of({triangles, nothing, 1.0, turned_deg * degree}, sonar, range_m), sonar) <
          -40.0);
  // An angle that is not a right one sends the sound past the sonar.
  CHECK(strength_db(0.3, 0.3, 0.0, 2.0) < strength_db(0.3, 0.3, 0.0, 0.0) - 10.0);
}

TEST_CASE(
    "an open box shows its inner corner as two plates alone do, and a hidden one not at all") {
  // The edge between the bottom and the far wall lies along the track, at the origin. `sides` has
  // numbers: 0 is the bottom, 1 the far wall, 2 the near wall, 3 and 4 the ends.
  const auto box = [](double length_m, double width_m, double near_m, double far_m,
                      double depression_rad, std::initializer_list<int> sides, bool inside_out) {
    const auto w = static_cast<float>(width_m), h = static_cast<float>(0.5 * length_m);
    const std::array<std::pair<float, float>, 4> around{{{-w, static_cast<float>(near_m)},
                                                         {-w, 0.0f},
                                                         {0.0f, 0.0f},
                                                         {0.0f, static_cast<float>(far_m)}}};
    constexpr std::array<std::array<std::uint32_t, 4>, 5> corners{
        {{1, 2, 6, 5}, {2, 3, 7, 6}, {0, 1, 5, 4}, {0, 3, 2, 1}, {4, 5, 6, 7}}};
    refine::TriangleMesh mesh;
    for (const float y : {-h, h})
      for (const auto& [x, z] : around) mesh.positions.emplace_back(x, y, z);
    for (const int side : sides) {
      const auto [a, b, c, d] = corners[static_cast<std::size_t>(side)];
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({a, c, d});
    }
    if (inside_out)
      for (refine::Face& face : mesh.faces) std::swap(face[1], face[2]);
    const Eigen::AngleAxisf tilt(static_cast<float>(-depression_rad), Eigen::Vector3f::UnitY());
    for (Eigen::Vector3f& p : mesh.positions) p = tilt * p;
    return mesh;
  };
  const auto strength_db = [](const refine::TriangleMesh& mesh, const Sonar& sonar,
                              double north_m) {
    return target_strength_db(echo_of({mesh, nothing, 1.0, 0.0, north_m}, sonar, 20.0), sonar);
  };
  Sonar narrow = wide_sonar(22.0);
  narrow.array_length_m = 0.5;
  for (const bool inside_out : {false, true}) {
    CAPTURE(inside_out);
    const auto low_box_db = [&](std::initializer_list<int> sides) {
      return strength_db(box(0.3, 0.6, 0.15, 0.5, 45.0 * degree, sides, inside_out),
                         wide_sonar(22.0, 100e3), 0.0);
    };
    CHECK(low_box_db({0, 1}) > 0.0);
    CHECK(low_box_db({0, 1, 2, 3, 4}) == Approx(low_box_db({0, 1})).margin(0.3));
    // The near wall of a deep box hides its bottom, also next to the ends of the edge.
    const auto deep_box = [&](std::initializer_list<int> sides) {
      return box(2.0, 1.0, 1.0, 1.0, 28.0 * degree, sides, inside_out);
    };
    for (int i = -24; i <= 24; ++i) {
      const double north_m = 0.05 * i;
      CAPTURE(north_m);
      const double db = strength_db(deep_box({0, 1, 2, 3, 4}), narrow, north_m);
      const double without_bottom_db = strength_db(deep_box({1, 2, 3, 4}), narrow, north_m);
      CHECK(std::max(db, -60.0) == Approx(std::max(without_bottom_db, -60.0)).margin(0.1));
      // The near wall hides the glint of the far wall behind it, although rays pass below both
      // walls.
      const auto upright_db = [&](std::initializer_list<int> sides) {
        const auto mesh = box(2.0, 1.0, 1.0, 1.0, 0.0, sides, inside_out);
        return std::max(strength_db(mesh, narrow, north_m), -10.0);
      };
      CHECK(upright_db({1, 2}) == Approx(upright_db({2})).margin(0.1));
    }
  }
}
