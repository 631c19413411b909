#include <cmath>
#include <numbers>
#include <utility>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/forward_lobe.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>
#include <ensonify/scatter/small_slope.h>

using namespace ensonify::scatter;
using std::numbers::pi;

TEST_CASE("sound that comes straight down and goes straight back up is backscatter") {
  for (const char* name : {"medium sand", "coarse silt", "rock"}) {
    const Sediment s = sediment_named(name);
    const double k = wavenumber_per_cm(100e3, 1500.0);
    CHECK(forward_lobe(s, k, 90.0 * degree, 90.0 * degree) ==
          Approx(kirchhoff(s, k, 90.0 * degree)).epsilon(1e-9));
  }
}

TEST_CASE("the forward lobe is Kirchhoff's integral over q = k_out - k_in, the same both ways") {
  // sigma = |R|^2 |q|^4 / (8 pi q_h^2 q_z^2) times the integral of J0(u) exp(-p u^(2 a)) u du, with
  // p = q_z^2 Ch2 / 2 q_h^(-2 a): for backscatter that is the integral of kirchhoff_test.cpp.
  for (const char* name : {"coarse sand", "medium sand", "very fine sand", "clay"})
    for (const double frequency_hz : {100e3, 400e3}) {
      const Sediment s = sediment_named(name);
      const double k = wavenumber_per_cm(frequency_hz, 1500.0), a = s.alpha();
      const double Ch2 = kirchhoff_shape(s, k).Ch2;
      const ReliefIntegral integral(a);
      for (const double in_deg : {10.0, 20.0, 30.0})
        for (const auto& [more_deg, turned_deg] :
             {std::pair{0.5, 0.0}, {2.0, 0.0}, {8.0, 0.0}, {2.0, 4.0}, {0.5, 10.0}}) {
          const double in = in_deg * degree, out = in + more_deg * degree;
          const double turned = turned_deg * degree;
          const double q_h = k * std::hypot(std::cos(in) - std::cos(out) * std::cos(turned),
                                            std::cos(out) * std::sin(turned));
          const double q_z = k * (std::sin(in) + std::sin(out));
          const double q = std::hypot(q_h, q_z);
          const double R2 = std::norm(reflection_coefficient(s, std::asin(q / (2.0 * k))));
          const double exact = R2 * std::pow(q, 4.0) / (8.0 * pi * std::pow(q_h * q_z, 2.0)) *
                               integral(0.5 * q_z * q_z * Ch2 * std::pow(q_h, -2.0 * a));
          CAPTURE(name, frequency_hz, in_deg, more_deg, turned_deg);
          CHECK(to_db(forward_lobe(s, k, in, out, turned)) == Approx(to_db(exact)).margin(1.0));
          CHECK(forward_lobe(s, k, out, in, turned) ==
                Approx(forward_lobe(s, k, in, out, turned)).epsilon(1e-12));
        }
    }
}
