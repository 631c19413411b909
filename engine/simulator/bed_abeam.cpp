#include <ensonify/engine/simulator/bed_abeam.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace ensonify::engine {

BedAbeam look_abeam(const Pose& pose, const Sonar& sonar, double height_m, double highest_m,
                    BedHeight& bed) {
  // Calls look(sector, away_m, below_m) for places from far_m inwards; below_m is how far the bed
  // lies below the sonar.
  const auto scan = [&](const Eigen::Vector2d& starboard, double far_m, int places,
                        const auto& inwards, const auto& look) {
    for (std::size_t sector = 0; sector < sonar.sectors().size(); ++sector) {
      const double out = sonar.sectors()[sector].out;
      double away_m = far_m;
      for (int i = 0; i < places; ++i, away_m = inwards(away_m)) {
        const Eigen::Vector2d place = pose.position.head<2>() + out * away_m * starboard;
        look(sector, away_m, pose.position.z() - bed.height_m(place.x(), place.y()));
      }
    }
  };
  constexpr int half_octaves = 10, quarter_octaves = 24;
  constexpr double layout_step = 0.84;
  const auto half_octave_in = [](double away_m) { return away_m / std::numbers::sqrt2; };
  const auto quarter_octave_in = [](double away_m) { return away_m * std::exp2(-0.25); };
  const Eigen::Vector2d starboard = body_to_world(pose).col(1).head<2>();
  BedAbeam abeam{.nearest_m = height_m, .rise_rad = {}};
  if (pose.position.z() - highest_m < layout_step * height_m) {
    scan(starboard, std::min(height_m, sonar.range_m), half_octaves, half_octave_in,
         [&](std::size_t, double away_m, double below_m) {
           const double range_m = std::hypot(half_octave_in(away_m), std::max(below_m, 0.0));
           if (!std::isnan(below_m)) abeam.nearest_m = std::min(abeam.nearest_m, range_m);
         });
    if (abeam.nearest_m >= layout_step * height_m) abeam.nearest_m = height_m;
  }
  if (highest_m > pose.position.z())
    scan(starboard.normalized(), sonar.range_m, quarter_octaves, quarter_octave_in,
         [&](std::size_t sector, double away_m, double below_m) {
           double& rise_rad = abeam.rise_rad[sector];
           if (below_m < 0.0) rise_rad = std::max(rise_rad, std::atan2(-below_m, away_m));
         });
  return abeam;
}

}  // namespace ensonify::engine
