#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/aperture.h>
#include <ensonify/engine/sonar/echo.h>
#include <ensonify/engine/sonar/echo_former.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// One sonar at work on one thread: aims its fans, then listens. Its memory is kept from ping to ping.
class Pinger {
 public:
  /// The seafloor and the tables must outlive this; by_material as in EchoFormer. `sonar_number` tells a scene's sonars
  /// apart in their random numbers.
  Pinger(const Sonar& sonar, std::uint64_t sonar_number, const Medium& medium,
         const Seafloor& seafloor, std::span<const scatter::BackscatterTable> by_material);

  /// The fans of its sides, port first, at the sonar's own pose so high over the bed; good until the
  /// next call.
  std::span<const RayFan> aim(const Pose& pose, double altitude_m);

  /// Nearest hits of the aimed fan of one side; good until the next call.
  std::span<const Hit> trace(const Intersector& intersector, Side side);
  /// The expected echo of the side that was traced last, over these triangles.
  void echo(refine::Triangles triangles, Side side, EchoLine& line);
  /// Fully developed speckle over it: an independent exponential factor a bin, a stand-in for the
  /// receiver's chain.
  void speckle(std::uint64_t seed, std::uint64_t ping_number, EchoLine& line);

 private:
  double range_m_;
  double sound_speed_mps_;
  std::uint64_t sonar_number_;
  std::span<const Side> sides_;
  Apertures apertures_;
  EchoFormer former_;
  std::array<const Aperture*, 2> aims_{};
  std::array<RayFan, 2> fans_;
  std::array<Reception, 2> receptions_;
  std::vector<Hit> hits_;
  std::vector<double> factors_;
};

}  // namespace ensonify::engine
