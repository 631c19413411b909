#include <algorithm>
#include <cmath>

#include "support/catch.h"

#include <ensonify/engine/random.h>
#include <ensonify/engine/sonar/plane_beam.h>

using namespace ensonify::engine;

TEST_CASE("the beam along a plane is the beam of every ray, interpolated") {
  for (const bool focused : {false, true}) {
    Sonar sonar;
    sonar.focused = focused;
    const double wavelength_m = 1500.0 / sonar.frequency_hz;
    const Beam beam(sonar, wavelength_m);
    const Aperture aperture = make_aperture(sonar, wavelength_m, 8.0);
    const Pose pose{.position = {0.0, 0.0, -10.0},
                    .roll_rad = 0.02,
                    .velocity_mps = {0.5, 2.0, 0.0},
                    .roll_rate_radps = 0.05,
                    .heading_rate_radps = 0.03};
    for (const Side side : {Side::port, Side::starboard}) {
      const RayFan fan = place_fan(aperture, pose, side, sonar.range_m);
      const Reception listens = reception(pose, side, sonar.range_m, 1500.0);
      PlaneBeam along;
      along.begin(beam, fan, aperture, listens, side);
      std::vector<double> draws(fan.elevations());
      double largest = 0.0, worst = 0.0;  // of all planes: the outer ones matter little
      for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
        along.begin_plane(plane);
        Stream(plane, Purpose::test).uniform(draws);
        for (std::size_t j = 0; j < fan.elevations(); ++j) {
          if (!fan.grid->within_beam(plane, j)) continue;
          // Ranges that wander slowly, with jumps.
          const double range_m = sonar.range_m * (0.3 + 0.2 * std::sin(0.01 * double(j)) +
                                                  (draws[j] > 0.98 ? 0.4 : 0.0));
          const std::size_t ray = plane * fan.elevations() + j;
          const double exact =
              beam.two_way(side, aperture.samples_of(plane), fan.grid->cos_elevation[j],
                           aperture.vertical[static_cast<std::size_t>(side)][ray],
                           fan.direction(fan.plane_direction(plane), j), range_m, listens);
          largest = std::max(largest, exact);
          worst = std::max(worst, std::abs(along.weight(j, range_m) - exact));
        }
      }
      CAPTURE(focused, largest);
      CHECK(worst <= 0.005 * largest);
    }
  }
}
