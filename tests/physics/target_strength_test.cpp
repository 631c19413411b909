// The echo of a solid against its closed form.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/objects/object_body.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/engine/seafloor/objects/solids.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/echo/plane_spacing.h>
#include <ensonify/engine/units.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// The sonar of these tests: its beam is wider than the bodies.
Sonar wide_sonar(double range_m, double frequency_hz = 400e3) {
  Sonar sonar = plain_sonar();
  sonar.frequency_hz = frequency_hz;
  sonar.array_length_m = 12e3 / frequency_hz;
  sonar.range_m = range_m;
  sonar.bins = static_cast<int>(20.0 * range_m);
  sonar.source_level_db = 0.0;
  sonar.sector_low_rad = -0.08;
  sonar.sector_high_rad = 0.08;
  return sonar;
}

/// An upright rectangle before a body, from one corner to the other: across the line of sight to
/// the body's middle, towards the north and upwards.
struct Hider {
  double before_m;
  Eigen::Vector2d low, high;
  bool hides(const Eigen::Vector3d& place, double range_m) const {
    const Eigen::Vector2d meets = place.tail<2>() * (range_m - before_m) / place.x();
    return (meets.array() > low.array()).all() && (meets.array() < high.array()).all();
  }
};

struct Body {
  refine::TriangleMesh mesh;
  scatter::Solid rough;
  double smooth_specular = 0.0;
  double heading_rad = 0.0;
  double north_m = 0.0;
  WallMirror mirror = {};
  std::optional<Hider> hider = {};  // which scatters nothing
};

/// The expected echo of a body alone in the water, at a range from its middle.
EchoLine echo_of(const Body& body, const Sonar& sonar, double range_m) {
  Seafloor alone;
  alone.mesh = body.mesh;
  const float c = static_cast<float>(std::cos(body.heading_rad)),
              s = static_cast<float>(std::sin(body.heading_rad));
  for (Eigen::Vector3f& p : alone.mesh.positions)
    p = {c * p.x() - s * p.y(), s * p.x() + c * p.y() + static_cast<float>(body.north_m),
         p.z() - 20.0f};
  alone.bed_faces = 0;
  alone.labels = {{1, 1, 1, !refine::encloses_volume(body.mesh)}};
  const std::vector<ObjectSurface> objects{ObjectSurface(alone.mesh, 0)};
  if (body.hider) {
    alone.face_label.resize(alone.mesh.faces.size(), 0);
    const auto first = static_cast<std::uint32_t>(alone.mesh.positions.size());
    const Hider& hider = *body.hider;
    for (const double north_m : {hider.low.x(), hider.high.x()})
      for (const double up_m : {hider.low.y(), hider.high.y()})
        alone.mesh.positions.emplace_back(static_cast<float>(-hider.before_m),
                                          static_cast<float>(north_m),
                                          static_cast<float>(up_m - 20.0));
    alone.mesh.faces.push_back({first, first + 1, first + 3});
    alone.mesh.faces.push_back({first, first + 3, first + 2});
    alone.labels.push_back({2, 1, 2, true});
    alone.face_label.resize(alone.mesh.faces.size(), 1);
  }
  const std::vector<scatter::BackscatterTable> tables{
      scatter::BackscatterTable(scatter::SolidTarget(body.rough)),
      scatter::BackscatterTable(scatter::SolidTarget(body.rough)),
      scatter::BackscatterTable(scatter::SolidTarget({.diffuse_db = -100.0, .specular = 0.0}))};
  const std::vector<double> smooth(2, body.smooth_specular);
  const std::vector<WallMirror> mirrors(2, body.mirror);
  ObjectSurfaces surfaces{&objects, nullptr, smooth};
  surfaces.mirrors = mirrors;
  PingTracer pinger(sonar, {}, alone, tables, {}, nullptr, surfaces);
  const BeamAim aim = pinger.aim({.position = {-range_m, 0.0, -20.0}}, 10.0);
  EchoLine line;
  line.side = Side::starboard;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  const auto tracer = make_intersector("embree", alone.mesh);
  REQUIRE(pinger.trace(aim, {tracer.get(), alone.mesh}, line.side));
  pinger.echo(aim, line.side, line);
  return line;
}

double target_strength_db(const EchoLine& line, const Sonar& sonar) {
  double energy = 0.0;
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i)
    energy += double(line.bins.intensity_mean[i]) * std::pow(double(line.bins.range_m[i]), 4);
  return scatter::to_db(energy * sonar.bin_m() / sonar.pulse.cell_m(Medium{}.sound_speed_mps));
}

/// The target strength of a body whose whole specular part is that of a rough surface.
double target_strength_db(const refine::TriangleMesh& mesh, const scatter::Solid& solid,
                          double range_m, double heading_rad) {
  Sonar sonar = wide_sonar(20.0);
  sonar.planes = solid.lobe_width_rad < degree ? 1024 : 512;  // as close as the lobe needs
  return target_strength_db(echo_of({mesh, solid, 0.0, heading_rad}, sonar, range_m), sonar);
}

refine::TriangleMesh body(const char* shape, const ShapeSize& size) {
  return make_body(shape_named(shape), size, RandomStream(1, Purpose::test)).mesh;
}

constexpr scatter::Solid nothing{.diffuse_db = -100.0, .specular = 0.0};

/// The two-way field of a sonar's array at a place, over that of a point source: a sum over the
/// array, which is along y. A focused array adds its elements in phase on its axis at all ranges.
std::complex<double> two_way_field(const Sonar& sonar, const Eigen::Vector3d& place) {
  const double k = 2.0 * std::numbers::pi * sonar.frequency_hz / 1500.0, r = place.norm();
  if (sonar.focused) {
    const double x = 0.5 * k * sonar.array_length_m * place.y() / r;
    return std::abs(x) < 1e-9 ? 1.0 : std::pow(std::sin(x) / x, 2.0);
  }
  constexpr int elements = 48;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < elements; ++i) {
    const double along_m = sonar.array_length_m * ((i + 0.5) / elements - 0.5);
    sum +=
        std::polar(1.0 / elements, k * ((place - along_m * Eigen::Vector3d::UnitY()).norm() - r));
  }
  return sum * sum;
}

/// The echo of a smooth cylinder seen across its axis from one point, by a sum over its length:
/// a / (2 lambda) |integral of exp(2 i k (sqrt(r^2 + z^2) - r)) dz|^2 r / (r + a), with the range r
/// of its side. It shares nothing with the program's Fresnel integrals. beam: of a sonar that
/// passes the cylinder's middle at off_m.
double cylinder_db(double radius_m, double length_m, double side_m, double wavelength_m,
                   const Sonar* beam = nullptr, double off_m = 0.0) {
  const int steps = beam ? 20000 : 200000;
  const double step_m = length_m / steps;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double z = off_m + (i + 0.5) * step_m - 0.5 * length_m;
    sum += std::polar(step_m,
                      4.0 * std::numbers::pi / wavelength_m * (std::hypot(side_m, z) - side_m)) *
           (beam ? two_way_field(*beam, {side_m, z, 0.0}) : 1.0);
  }
  return scatter::to_db(radius_m * std::norm(sum) / (2.0 * wavelength_m) * side_m /
                        (side_m + radius_m));
}

/// Two plates that meet at the edge x = y = 0, which is `height_m` high, and open towards -x. One
/// reaches `one_m` from the edge, 45 degrees to port of -x, the other `other_m`, at an angle that
/// is excess_rad over a right one.
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
/// both ways round, over that of a flat plate. It shares nothing with the program.
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

/// Adds a triangle in the plane x = 0 that faces -x.
void add_upright(refine::TriangleMesh& mesh, const std::array<Eigen::Vector2d, 3>& corners) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Eigen::Vector2d& corner : corners)
    mesh.positions.emplace_back(0.0f, static_cast<float>(corner.x()),
                                static_cast<float>(corner.y()));
  mesh.faces.push_back({first, first + 2, first + 1});
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

/// An upright plate that faces -x, of those of 4 x 4 square cells that are there.
template <class IsThere>
refine::TriangleMesh upright_cells(double length_m, const IsThere& is_there) {
  refine::TriangleMesh mesh;
  const auto at = [&](int i, int k) {
    return (length_m * Eigen::Vector2d(0.25 * i - 0.5, 0.25 * k - 0.5)).eval();
  };
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k)
      if (is_there(i, k)) {
        add_upright(mesh, {at(i, k), at(i + 1, k), at(i + 1, k + 1)});
        add_upright(mesh, {at(i, k), at(i + 1, k + 1), at(i, k + 1)});
      }
  return mesh;
}

/// |integral of exp(2 i k R) r^2 / R^2 over a flat body|^2 / lambda^2, as a sum over places of its
/// faces, with the two-way beam; the body as echo_of() has it, `r` its middle's range.
double kirchhoff_db(const Body& body, const Sonar& sonar, double range_m) {
  const double wavelength_m = 1500.0 / sonar.frequency_hz;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(body.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d middle(range_m, body.north_m, 0.0);
  std::complex<double> sum = 0.0;
  for (const refine::Face& face : body.mesh.faces) {
    const auto corner = [&](std::size_t i) {
      return (turn * body.mesh.positions[face[i]].cast<double>() + middle).eval();
    };
    const Eigen::Vector3d a = corner(0), one = corner(1) - a, other = corner(2) - a;
    constexpr int steps = 24;
    const double area_m2 = 0.5 * one.cross(other).norm() / (steps * steps);
    const auto add = [&](double u, double v) {
      const Eigen::Vector3d place = a + u / steps * one + v / steps * other;
      if (body.hider && body.hider->hides(place, range_m)) return;
      const double r = place.norm();
      sum += two_way_field(sonar, place) *
             std::polar(area_m2 * std::pow(range_m / r, 2.0),
                        4.0 * std::numbers::pi / wavelength_m * (r - range_m));
    };
    for (int i = 0; i < steps; ++i)
      for (int k = 0; i + k < steps; ++k) {
        add(i + 1.0 / 3.0, k + 1.0 / 3.0);
        if (i + k + 1 < steps) add(i + 2.0 / 3.0, k + 2.0 / 3.0);
      }
  }
  return scatter::to_db(std::norm(sum / wavelength_m));
}

}  // namespace

TEST_CASE("a sphere has the target strength a^2 / 4, however narrow its lobe, from every side") {
  constexpr double radius_m = 0.5, range_m = 10.0;
  for (const double lobe_deg : {10.0, 5.0, 3.0, 1.0, 0.5}) {
    const scatter::Solid solid{
        .diffuse_db = -120.0, .specular = 0.5, .lobe_width_rad = lobe_deg * degree};
    ObjectOptions ball{.shape = "sphere", .material = "mirror"};
    Material mirror{.name = "mirror", .model = "solid", .like = "steel"};
    mirror.lobe_width_rad = solid.lobe_width_rad;
    const refine::TriangleMesh mesh = mesh_of(ball, 1, {&mirror, 1});
    // At a short range the nearest point is nearer than the middle, and the sphere is relatively
    // flatter there.
    const double expected_db = scatter::to_db(
        solid.specular * std::pow(radius_m / 2.0 * (range_m - radius_m) / range_m, 2.0));
    for (const double heading_deg : {0.0, 11.0, 37.0}) {
      CAPTURE(lobe_deg, heading_deg, mesh.faces.size());
      CHECK(target_strength_db(mesh, solid, range_m, heading_deg * degree) ==
            Approx(expected_db).margin(0.5));
    }
    // Facets that are not refined for the lobe: 8 degrees.
    const refine::TriangleMesh usual = mesh_of(ball, 1);
    if (lobe_deg <= 1.0)
      CHECK(std::abs(target_strength_db(usual, solid, range_m, 0.0) - expected_db) > 3.0);
  }
}

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
  // 1000 m), which says the same as the sum over the length.
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
                     angle_rad = k * 360 / spokes * degree;
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
          const Sonar sonar = wide_sonar(range_m + 2.0, frequency_hz);
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

TEST_CASE("a plate that another thing hides in part glints as Kirchhoff's integral over the rest") {
  constexpr double before_m = 1.0;
  refine::TriangleMesh plate = upright_cells(1.0, [](int, int) { return true; });
  for (Eigen::Vector3f& place : plate.positions) place.z() *= 0.6f;
  for (const auto& [array_m, planes] : {std::pair{0.5, 0}, {0.03, 512}})
    for (const double range_m : {10.0, 40.0})
      for (const double turned_deg : {0.0, 0.3})
        for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
          for (const bool from_below : {true, false}) {
            Sonar sonar = wide_sonar(range_m + 2.0);
            sonar.array_length_m = array_m;
            if (planes > 0) sonar.planes = planes;
            Body body{plate, nothing, 1.0, turned_deg * degree};
            // As seen from the sonar, the hidden share lies to the south or below, and the hider
            // reaches well beyond the plate.
            const double seen = (range_m - before_m) / range_m;
            const Eigen::Vector2d half(0.5, 0.3), edge = seen * (2.0 * share - 1.0) * half;
            body.hider = Hider{before_m, {-2.0, -2.0}, {2.0, 2.0}};
            if (share < 1.0)
              (from_below ? body.hider->high.y() : body.hider->high.x()) =
                  from_below ? edge.y() : edge.x();
            const double mirror_m2 = 0.25 * range_m * range_m;
            const double got =
                scatter::from_db(target_strength_db(echo_of(body, sonar, range_m), sonar));
            CAPTURE(array_m, range_m, turned_deg, share, from_below);
            if (share == 1.0) {
              CHECK(got < 1e-7);  // the faint diffuse echoes alone
              continue;
            }
            const double expected = scatter::from_db(kirchhoff_db(body, sonar, range_m));
            CHECK(got == Approx(expected).epsilon(0.25).margin(0.02 * mirror_m2));
          }
}

TEST_CASE("a plate that is wholly hidden does not glint, wherever the sonar passes it") {
  refine::TriangleMesh plate = upright_cells(0.3, [](int, int) { return true; });
  for (const auto& [frequency_hz, array_m, range_m] :
       {std::tuple{100e3, 0.2, 40.0}, {400e3, 0.5, 10.0}, {900e3, 0.2, 20.0}})
    for (int i = -60; i <= 60; ++i) {
      Sonar sonar = wide_sonar(range_m + 2.0, frequency_hz);
      sonar.array_length_m = array_m;
      const double north_m = 0.025 * i;
      Body body{plate, nothing, 1.0, 0.0, north_m};
      body.hider = Hider{1.0, {north_m - 0.8, -0.6}, {north_m + 0.8, 0.6}};
      CAPTURE(frequency_hz, array_m, range_m, north_m);
      CHECK(target_strength_db(echo_of(body, sonar, range_m), sonar) < -60.0);
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
  // 2 a^2 b^2 / lambda^2 from the middle, and that of a corner whose mirror is narrower.
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
  // Its edge along the track is the origin; the walls are the far one, the near one and the ends.
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
      // A near wall in front of the far one hides its glint, although rays pass below both.
      const auto upright_db = [&](std::initializer_list<int> sides) {
        const auto mesh = box(2.0, 1.0, 1.0, 1.0, 0.0, sides, inside_out);
        return std::max(strength_db(mesh, narrow, north_m), -10.0);
      };
      CHECK(upright_db({1, 2}) == Approx(upright_db({2})).margin(0.1));
    }
  }
}

TEST_CASE("the upright sides of an object that the sonar sees are its walls, by its material") {
  ShapeSize size;
  size.length_m = 2.0;
  size.width_m = 1.0;
  size.shape_height_m = 0.8;
  const auto walls = [&](double turned_rad, const WallMirror& mirror) {
    Sonar sonar = wide_sonar(30.0);
    sonar.planes = 512;
    return echo_of({body("box", size), nothing, 0.0, turned_rad, 0.0, mirror}, sonar, 20.0).walls;
  };
  CHECK(walls(0.0, {}).empty());
  // From abeam one side faces the sonar, 0.5 m before the middle; turned by 30 degrees two do.
  for (const double turned_deg : {0.0, 30.0}) {
    const std::vector<WallFacet> seen = walls(turned_deg * degree, {.smooth = 0.8});
    CAPTURE(turned_deg);
    REQUIRE(seen.size() == (turned_deg == 0.0 ? 1 : 2));
    for (const WallFacet& wall : seen) {
      CHECK(wall.normal.dot(wall.middle) < 0.0);
      CHECK(wall.height_m == Approx(0.8).epsilon(1e-3));
      CHECK(wall.reflected == Approx(0.8).epsilon(1e-6));
      CHECK(wall.slope == Approx(0.0).margin(1e-6));
    }
    CHECK(std::ranges::count_if(seen, [&](const WallFacet& wall) {
            return std::abs(wall.length_m - 2.0) < 1e-3 &&
                   std::abs(wall.normal.x() + std::cos(turned_deg * degree)) < 1e-3;
          }) == 1);
  }
  // A rough material has a part that is smooth and a part that its slopes spread.
  const std::vector<WallFacet> rough = walls(0.0, {.smooth = 0.1, .rough = 0.4, .slope = 0.2});
  REQUIRE(rough.size() == 2);
  CHECK((rough[0].reflected == Approx(0.1) && rough[0].slope == Approx(0.0).margin(1e-6)));
  CHECK((rough[1].reflected == Approx(0.4) && rough[1].slope == Approx(0.2)));
  // A side that leans too far is none: only the half of a lying cylinder's facets whose normals are
  // within 30 degrees of the level.
  size.diameter_m = 0.8;
  for (const WallFacet& wall :
       echo_of({body("cylinder", size), nothing, 0.0, 0.0, 0.0, {.smooth = 1.0}}, wide_sonar(30.0),
               20.0)
           .walls)
    CHECK(std::abs(wall.normal.z()) < 0.5);
}

TEST_CASE(
    "in a ping a wall adds its corner if it faces the sonar, by its material, and none if not") {
  const auto corner_db = [](const char* material, double heading_deg,
                            std::optional<double> loss_db = {}) {
    Scene scene;
    scene.texture = false;
    scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
    scene.seafloor.cell_m = 2.0;
    scene.seafloor.depth_m = 20.0;
    scene.seafloor.fractal.height_at_1m_m = 0.0;
    scene.speckle = false;
    scene.sonars[0].range_m = 40.0;
    scene.sonars[0].bins = 800;
    scene.sonars[0].receiver.noise = false;
    scene.arrivals.double_bounce = true;
    scene.arrivals.wall_loss_db = loss_db;
    ObjectOptions box{.shape = "box", .material = material};
    box.east_m = 20.0;
    box.size.length_m = 4.0;
    box.size.width_m = 1.0;
    box.size.shape_height_m = 1.5;
    box.heading_rad = heading_deg * degree;
    scene.objects = {box};
    Simulator simulator(scene);
    const EchoLine& line = simulator.ping({.position = {0.0, 0.0, -10.0}})[1];
    double added = 0.0;
    for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
      added += double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    return scatter::to_db(std::max(added, 1e-9));
  };
  const double facing_db = corner_db("steel", 0.0);
  CHECK(corner_db("steel", 0.0, 6.0) - corner_db("steel", 0.0, 0.0) == Approx(-6.0).margin(0.05));
  CHECK(facing_db < corner_db("steel", 0.0, 0.0));
  // The bed close to its foot is in both beams, however it is turned.
  CHECK(corner_db("steel", 5.0) < facing_db - 3.0);
  CHECK(corner_db("steel", 10.0) < facing_db - 6.0);
  CHECK(corner_db("steel", 20.0) < facing_db - 12.0);
  CHECK(corner_db("steel", 60.0) < facing_db - 40.0);
  // Rust and growth spread what a wall reflects over 15 degrees.
  CHECK(corner_db("fouled steel", 0.0) < facing_db - 4.0);
  CHECK(corner_db("fouled steel", 5.0) > corner_db("fouled steel", 0.0) - 3.0);
}

TEST_CASE(
    "a closed mesh echoes as the shape of the same form, inside out too, past both its ends") {
  const TemporaryFolder folder;
  Scene scene;
  scene.texture = scene.speckle = false;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
  scene.seafloor.cell_m = 2.0;
  scene.seafloor.depth_m = 20.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.sonars[0].range_m = 40.0;
  scene.sonars[0].bins = 800;
  const auto with = [&](ObjectOptions object) {
    object.east_m = 15.0;
    scene.objects = {object};
    return Simulator(scene);
  };
  for (const auto& [material, length_m, width_m] :
       {std::tuple("steel", 4.0, 1.0), {"fouled steel", 4.0, 1.0}, {"stone", 0.2, 0.3}}) {
    ObjectOptions shape{.shape = "box", .material = material};
    shape.size.length_m = length_m;
    shape.size.width_m = width_m;
    shape.size.shape_height_m = width_m;
    refine::TriangleMesh mesh = body("box", shape.size);
    refine::write_ply(folder / "box.ply", mesh);
    for (refine::Face& face : mesh.faces) std::swap(face[1], face[2]);
    refine::write_ply(folder / "turned.ply", mesh);
    Simulator of_shape = with(shape);
    for (const char* file : {"box.ply", "turned.ply"}) {
      Simulator of_mesh = with({.mesh = {file, folder / file}, .material = material});
      for (const double end : {-1.0, 0.0, 1.0})
        for (int i = -4; i <= 4; ++i) {
          const double north_m = end * 0.5 * length_m + 0.05 * i;
          CAPTURE(material, file, north_m);
          const Pose pose{.position = {0.0, north_m, -12.0}};
          const EchoLine& expected = of_shape.ping_numbered(pose, 0)[1];
          const EchoLine& line = of_mesh.ping_numbered(pose, 0)[1];
          double worst_db = 0.0;
          for (std::size_t bin = 0; bin < line.bins.intensity_mean.size(); ++bin) {
            const auto level_db = [&](const EchoLine& of) {
              return scatter::to_db(std::max(double(of.bins.intensity_mean[bin]), 1.0));
            };
            worst_db = std::max(worst_db, std::abs(level_db(line) - level_db(expected)));
          }
          CHECK(worst_db < 0.05);
        }
    }
  }
}

TEST_CASE("a small object's energy does not depend on where the planes lie, and never vanishes") {
  for (const char* material : {"steel", "stone"})
    for (const double diameter_m : {0.3, 0.05}) {
      ShapeSize size;
      size.diameter_m = diameter_m;
      const refine::TriangleMesh mesh = body("sphere", size);
      const auto level_db = [&](int planes, double north_m) {
        Sonar sonar = plain_sonar();
        sonar.planes = planes;
        sonar.sector_low_rad = -0.08;
        sonar.sector_high_rad = 0.08;
        const scatter::Solid solid = scatter::solid_named(material);
        const EchoLine line =
            echo_of({mesh, solid.rough(), solid.smooth_specular(), 0.0, north_m}, sonar, 60.0);
        return target_strength_db(line, sonar);
      };
      CAPTURE(material, diameter_m);
      const double expected_db = level_db(8, 0.0);
      for (const int planes : {2, 4, 6, 12, 16, 24})
        if (planes < 16 || diameter_m < 0.1)
          CHECK(level_db(planes, 0.0) == Approx(expected_db).margin(planes > 8 ? 0.3 : 0.05));
      // Over the distance of two planes, 11 cm, against the beam's own pattern.
      double sum = 0.0, squares = 0.0;
      constexpr int places = 24;
      for (int i = 0; i < places; ++i) {
        const double north_m = 0.11 * (i - 0.5 * places) / places;
        const double sine = north_m / 60.0 * 0.5 / (1500.0 / 400e3) * std::numbers::pi;
        const double sinc = std::abs(sine) < 1e-6 ? 1.0 : std::sin(sine) / sine;
        const double off_db = level_db(8, north_m) - 40.0 * std::log10(sinc) - expected_db;
        sum += off_db;
        squares += off_db * off_db;
      }
      CHECK(std::sqrt(squares / places) < 0.1);
      CHECK(std::abs(sum / places) < 0.1);
    }
}

// There the rays are even in angle, and farther apart than the planes.
TEST_CASE(
    "a small object level with the sonar has its energy however many planes and rays there are") {
  ShapeSize size;
  size.diameter_m = 0.2;
  const refine::TriangleMesh mesh = body("sphere", size);
  const scatter::Solid solid = scatter::solid_named("stone");
  for (const double range_m : {30.0, 60.0})
    for (const double lift_rad : {0.0, 0.0011, 0.0021, 0.0035}) {
      const auto level_db = [&](int planes, int elevations, bool narrow) {
        Sonar sonar = plain_sonar();
        sonar.planes = planes;
        sonar.elevations = elevations;
        if (narrow) sonar.sector_low_rad = -0.08, sonar.sector_high_rad = 0.08;
        sonar.sector_low_rad += lift_rad;  // moves the rays, not the ball
        return target_strength_db(echo_of({mesh, solid}, sonar, range_m), sonar);
      };
      const double expected_db = level_db(64, 8192, true);
      CAPTURE(range_m, lift_rad);
      for (const int planes : {8, 16, 32, 48})
        for (const int elevations : {512, 1024, 2048}) {
          CAPTURE(planes, elevations);
          CHECK(level_db(planes, elevations, false) == Approx(expected_db).margin(0.3));
        }
    }
}

// Many planes meet them, of a fan of 1024; a usual one's pass beside them.
TEST_CASE(
    "an object that is long across the track and thin along it has its energy in every ping") {
  Sonar sonar = plain_sonar();
  sonar.sector_low_rad = -0.08;
  sonar.sector_high_rad = 0.08;
  const scatter::Solid stone = scatter::solid_named("stone");
  const auto level_db = [&](const refine::TriangleMesh& mesh, int planes, double north_m,
                            double heading_rad) {
    sonar.planes = planes;
    return target_strength_db(echo_of({mesh, stone, 0.0, heading_rad, north_m}, sonar, 60.0),
                              sonar);
  };
  ShapeSize thin;
  thin.length_m = 0.06;
  thin.width_m = 3.0;
  thin.shape_height_m = 0.15;
  const refine::TriangleMesh bar = body("box", thin);
  for (const double north_m : {-0.055, -0.02, 0.0, 0.03}) {
    CAPTURE(north_m);
    const double expected_db = level_db(bar, 1024, north_m, 0.0);
    for (const int planes : {4, 8, 32})
      CHECK(level_db(bar, planes, north_m, 0.0) == Approx(expected_db).margin(0.3));
  }
  // A ladder seen end on: the nearer rungs hide the farther ones, also rungs that are less far
  // apart than a small object is long.
  const refine::TriangleMesh ladder = body("ladder", {});
  CHECK(level_db(ladder, 8, 0.0, 90.0 * degree) < level_db(ladder, 1024, 0.0, 90.0 * degree) + 2.5);
}

TEST_CASE("a lone steel sphere does not fade: over 60 seeds its echo is steady, a stone's is not") {
  const auto spread = [](const char* material) {
    Scene scene;
    scene.texture = false;
    scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
    scene.seafloor.cell_m = 2.0;
    scene.seafloor.depth_m = 60.0;
    scene.seafloor.fractal.height_at_1m_m = 0.0;
    scene.sonars[0].range_m = 40.0;
    scene.sonars[0].bins = 1600;
    scene.sonars[0].receiver.noise = false;
    ObjectOptions ball{.shape = "sphere", .material = material};
    ball.east_m = 30.0;
    ball.height_m = 40.0;
    ball.size.diameter_m = 0.3;
    scene.objects = {ball};
    std::vector<double> energies;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      scene.seed = seed;
      Simulator simulator(scene);
      const EchoLine& line = simulator.ping({.position = {0.0, 0.0, -19.5}})[1];
      const auto brightest = std::ranges::max_element(line.bins.intensity_mean);
      const auto bin = static_cast<std::size_t>(brightest - line.bins.intensity_mean.begin());
      CHECK(line.bins.instance[bin] == 1);
      energies.push_back(double(line.bins.intensity[bin] / *brightest));
    }
    const double mean = std::accumulate(energies.begin(), energies.end(), 0.0) / 60.0;
    double squares = 0.0;
    for (const double energy : energies) squares += std::pow(energy / mean - 1.0, 2.0);
    CHECK(mean == Approx(1.0).margin(0.3));
    return std::sqrt(squares / 60.0);
  };
  CHECK(spread("steel") < 0.15);
  CHECK(spread("stone") > 0.6);
}

TEST_CASE(
    "one warning names all features that are shorter than the distance of planes, with the remedy") {
  Seafloor seafloor = level_bed(20.0, 100.0);
  seafloor.classes = {"none", "seabed", "mine", "boulder"};
  Sonar sonar;
  sonar.planes = 8;
  std::vector<Pose> line;
  for (int i = 0; i < 5000; ++i) line.push_back({.position = {0.0, 0.01 * i - 25.0, -10.0}});
  const auto told = [&] { return coarse_planes_warning({&sonar, 1}, 1500.0, seafloor, line); };
  CHECK_FALSE(told());
  const auto add = [&](double east_m, Eigen::Vector3d size_m) {
    seafloor.features.push_back(
        {.layer = "boulders.1", .middle_m = {east_m, 0.0, -20.0}, .size_m = size_m});
    seafloor.features.back().label = {
        .class_id = 3, .instance = static_cast<std::uint16_t>(seafloor.features.size())};
  };
  // lambda / 4 L per metre of range: 9.4 cm at 50 m, near the sector's middle.
  const double depression_rad = std::asin(10.0 / std::hypot(10.0, 49.0));
  const double off_rad = depression_rad - 0.5 * (sonar.sector_low_rad + sonar.sector_high_rad);
  const double apart_m =
      1500.0 / 400e3 / 4.0 / sonar.array_length_m * std::hypot(10.0, 49.0) * std::cos(off_rad);
  add(49.0, {0.01, 1.02 * apart_m, 0.1});  // narrow across the track, and long enough along it
  CHECK_FALSE(told());
  add(90.0, {0.01, 0.01, 0.01});  // out of range
  CHECK_FALSE(told());
  add(49.0, {1.0, 0.98 * apart_m, 0.1});
  REQUIRE(told());
  INFO(*told());
  CHECK(told()->starts_with("boulders.1 (instance 3, boulder) is 0.0"));
  CHECK(told()->find("range of 50 m") != std::string::npos);
  CHECK(told()->ends_with("set sonar.sidescan.planes = 10"));
  // Thousands of features still give one warning.
  for (int i = 0; i < 3000; ++i)
    seafloor.features.push_back({.layer = "boulders.0",
                                 .middle_m = {40.0, 0.01 * i, -20.0},
                                 .size_m = {0.02, 0.02, 0.02},
                                 .label = {.class_id = 3, .instance = 9}});
  CHECK(told()->starts_with("boulders.0 (instance 9, boulder) is 0.02 m long"));
  CHECK(told()->find("(3000 more are too short as well)") != std::string::npos);
  CHECK(told()->size() < 300);
  sonar.planes = 64;
  sonar.range_m = 45.0;
  CHECK_FALSE(told());
}
