#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "support/beds.h"
#include "support/body.h"
#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/object_body.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/seafloor/objects/shapes.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

// The echo of a body alone in the water, and sums over its surface to compare it with.

namespace ensonify::tests {

using namespace engine;

/// The sonar of these tests: its beam is wider than the bodies.
inline Sonar wide_sonar(double range_m, double frequency_hz = 400e3) {
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
inline EchoLine echo_of(const Body& body, const Sonar& sonar, double range_m) {
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
  const auto material_of = [](const scatter::Solid& rough) -> MaterialInSonar {
    return {scatter::BackscatterTable(scatter::SolidTarget(rough))};
  };
  MaterialInSonar own = material_of(body.rough);
  own.smooth_specular = body.smooth_specular;
  own.wall = body.mirror;
  const std::vector<MaterialInSonar> materials{
      own, own, material_of({.diffuse_db = -100.0, .specular = 0.0})};
  PingTracer pinger(sonar, {}, alone, materials, {}, nullptr, {.fixed = &objects});
  const auto tracer = make_intersector("embree", alone.mesh);
  return echo_line(pinger, {.sector = 1}, {.position = {-range_m, 0.0, -20.0}}, 10.0,
                   {tracer.get(), alone.mesh}, sonar.bins);
}

inline double target_strength_db(const EchoLine& line, const Sonar& sonar) {
  const double cell_m = sonar.pulse.cell_m(Medium{}.sound_speed_mps);
  const double begins_m = sonar.pulse.kind == PulseKind::cw ? 0.5 * cell_m : 0.0;  // before a bin
  double energy = 0.0;
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i)
    energy +=
        double(line.bins.intensity_mean[i]) * std::pow(double(line.bins.range_m[i]) - begins_m, 4);
  return scatter::to_db(energy * sonar.bin_m() / cell_m);
}

/// Makes the pulse longer than bodies of a metre are deep, short against the range: their parts
/// then interfere all the time, as in a sum of one frequency.
inline void lengthen_pulse(Sonar& sonar, double range_m) {
  sonar.pulse.bandwidth_hz = 0.5 * 1500.0 / (range_m / 80.0);
}

inline constexpr scatter::Solid nothing{.diffuse_db = -100.0, .specular = 0.0};

/// The two-way field of a sonar's array at a place, divided by the field of a point source: a sum
/// over the array, which is along y. A focused array adds its elements in phase on its axis at all
/// ranges.
inline std::complex<double> two_way_field(const Sonar& sonar, const Eigen::Vector3d& place) {
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
inline double cylinder_db(double radius_m, double length_m, double side_m, double wavelength_m,
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

/// Adds a triangle in the plane x = 0 that faces -x.
inline void add_upright(refine::TriangleMesh& mesh, const std::array<Eigen::Vector2d, 3>& corners) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Eigen::Vector2d& corner : corners)
    mesh.positions.emplace_back(0.0f, static_cast<float>(corner.x()),
                                static_cast<float>(corner.y()));
  mesh.faces.push_back({first, first + 2, first + 1});
}

/// An upright plate that faces -x. It consists of those of 4 x 4 square cells for which is_there
/// is true.
template <class IsThere>
inline refine::TriangleMesh upright_cells(double length_m, const IsThere& is_there) {
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
inline double kirchhoff_db(const Body& body, const Sonar& sonar, double range_m) {
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

}  // namespace ensonify::tests
