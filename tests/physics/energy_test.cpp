#include <numeric>

#include <Eigen/Geometry>

#include "support/beds.h"
#include "support/catch.h"
#include "support/targets.h"

#include <ensonify/engine/seafloor/make_seafloor.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A rough bed that ends well within the range.
Seafloor rough_bed(double height_at_1m_m) {
  SeafloorOptions options;
  options.extent_east_m = options.extent_north_m = 60.0;
  options.cell_m = 0.3;
  options.fractal.height_at_1m_m = height_at_1m_m;
  return make_seafloor(options, 3);
}

/// The same energy without bins: the sum of the rays' energies, by the trapezoid rule along each
/// plane.
double energy_of_rays(const RayFan& fan, const RayLayout& layout, const Beam& beam,
                      const ReceiverMotion& motion, std::span<const Hit> hits,
                      const Seafloor& bed) {
  const scatter::BackscatterTable lambert(scatter::Lambert(-27.0));
  const refine::Triangles mesh = bed.mesh;
  const std::vector<double>& e = fan.grid->elevation_rad;
  double sum = 0.0;
  for (std::size_t k = 0; k < fan.planes(); ++k)
    for (std::size_t j = 0; j < fan.elevations(); ++j) {
      const Hit& hit = hits[k * fan.elevations() + j];
      if (!hit) continue;
      const Eigen::Vector3d a = mesh.corner(hit.face, 0);
      const Eigen::Vector3d normal =
          (mesh.corner(hit.face, 1) - a).cross(mesh.corner(hit.face, 2) - a).normalized();
      const double sine = -normal.dot(fan.ray(k, j).direction);
      if (sine <= 0.0) continue;
      double step = 0.0;
      if (j > 0 && fan.grid->within_beam(k, j - 1)) step += 0.5 * (e[j] - e[j - 1]);
      if (j + 1 < e.size() && fan.grid->within_beam(k, j + 1)) step += 0.5 * (e[j + 1] - e[j]);
      sum += beam.two_way(1, layout.samples_of(k), fan.grid->cos_elevation[j],
                          fan.ray(k, j).direction, hit.t, motion) *
             lambert.sigma_over_sine(sine) / (hit.t * hit.t) * step;
    }
  return sum;
}

}  // namespace

TEST_CASE("the bins hold the energy of the rays, however rough the bed") {
  const Pose fixed{.position = {0.0, 0.0, -12.0}, .roll_rad = 0.05, .heading_rad = 1.0};
  Pose moving = fixed;
  moving.velocity_mps = {0.5, 2.0, 0.1};
  moving.roll_rate_radps = 0.05;
  moving.heading_rate_radps = 0.03;
  Sonar two_arrays;  // with near fields and a vertical pattern
  two_arrays.receive_array_length_m = 0.3;
  for (const Sonar& of : {plain_sonar(), two_arrays})
    for (const Pose& pose : {fixed, moving})
      for (const double height_at_1m_m : {0.02, 0.1, 0.4}) {
        CAPTURE(of.focused, pose.velocity_mps.norm(), height_at_1m_m);
        Sonar sonar = of;
        sonar.source_level_db = 0.0;
        const Seafloor bed = rough_bed(height_at_1m_m);
        const Medium medium{1500.0, 0.0};
        const auto layout = std::make_shared<const RayLayout>(
            make_ray_layout(sonar, 1500.0 / sonar.frequency_hz, 9.0));
        const RayFan fan = place_fan(*layout, pose, starboard_sector, 80.0);
        std::vector<Hit> hits(fan.grid->rays());
        make_intersector("embree", bed.mesh)->intersect(fan, hits);

        const std::vector<MaterialInSonar> materials = materials_of(2, scatter::Lambert(-27.0));
        const Beam beam(sonar, 1500.0 / sonar.frequency_hz);
        EchoFormer former(sonar, medium, bed, materials);
        EchoLine line;
        line.sector = 1;
        line.bins.assign(static_cast<std::size_t>(sonar.bins));
        const ReceiverMotion motion =
            receiver_motion(pose, starboard_sector, 80.0, medium.sound_speed_mps);
        FanRuns runs;
        runs.take(fan, bed.mesh, hits);
        former.form(beam, {fan, layout, motion}, {.triangles = bed.mesh, .runs = &runs}, line);
        const std::vector<float>& mean = line.bins.intensity_mean;
        const double range_cell_m = sonar.pulse.cell_m(medium.sound_speed_mps);
        const double in_bins =
            std::accumulate(mean.begin(), mean.end(), 0.0) * sonar.bin_m() / range_cell_m;
        CHECK(in_bins ==
              Approx(energy_of_rays(fan, *layout, beam, motion, hits, bed)).epsilon(1e-3));
      }
}

TEST_CASE("an echo has the same bytes on every kind of vector register, and on scalars") {
  const Seafloor bed = rough_bed(0.1);
  const Pose pose{.position = {0.0, 0.0, -12.0},
                  .roll_rad = 0.05,
                  .heading_rad = 1.0,
                  .velocity_mps = {0.5, 2.0, 0.1},
                  .heading_rate_radps = 0.03};
  const auto bytes = [&] {
    std::string all;
    for (const EchoLine& line : ping_once(Sonar{}, bed, pose, 12.0, {1500.0, 0.03}, "fan_scan"))
      BinLayers::for_each([&](std::string_view, auto layer) {
        const auto& values = line.bins.*layer;
        all.append(reinterpret_cast<const char*>(values.data()),
                   values.size() * sizeof values.front());
      });
    return all;
  };
  const std::string expected = bytes();
  on_each_target([&] { CHECK(bytes() == expected); });
}
