#include <numeric>

#include <Eigen/Geometry>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/scatter/decibel.h>

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

/// The same energy without bins: every ray's own, by the trapezoid rule along each plane.
double energy_of_rays(const RayFan& fan, const Aperture& aperture, std::span<const Hit> hits,
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
      sum += aperture.weight[1][k * fan.elevations() + j] * lambert.over_sine(sine) /
             (hit.t * hit.t) * step;
    }
  return sum;
}

}  // namespace

TEST_CASE("the bins hold the energy of the rays, however rough the bed") {
  for (const double height_at_1m_m : {0.02, 0.1, 0.4}) {
    CAPTURE(height_at_1m_m);
    const Seafloor bed = rough_bed(height_at_1m_m);
    Sonar sonar = plain_sonar();
    sonar.source_level_db = 0.0;
    const Medium medium{1500.0, 0.0};
    const Pose pose{.position = {0.0, 0.0, -12.0}, .roll_rad = 0.05, .heading_rad = 1.0};

    const Aperture aperture = make_aperture(sonar, 1500.0 / sonar.frequency_hz, 9.0);
    const RayFan fan = place_fan(aperture, pose, Side::starboard, 80.0);
    std::vector<Hit> hits(fan.grid->rays());
    make_intersector("embree", bed.mesh)->intersect(fan, hits);

    const std::vector<scatter::BackscatterTable> tables(
        2, scatter::BackscatterTable(scatter::Lambert(-27.0)));
    EchoFormer former(sonar, medium, bed, tables);
    EchoLine line;
    line.side = Side::starboard;
    line.bins.assign(static_cast<std::size_t>(sonar.bins));
    former.form(fan, aperture, reception(pose, line.side, 80.0, medium.sound_speed_mps), bed.mesh,
                hits, {}, line);
    const std::vector<float>& mean = line.bins.intensity_mean;
    const double range_cell_m = sonar.pulse.cell_m(medium.sound_speed_mps);
    const double in_bins =
        std::accumulate(mean.begin(), mean.end(), 0.0) * sonar.bin_m() / range_cell_m;
    CHECK(in_bins == Approx(energy_of_rays(fan, aperture, hits, bed)).epsilon(1e-3));
  }
}
