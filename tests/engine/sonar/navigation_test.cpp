#include <ensonify/engine/sonar/vehicle/navigation.h>

#include <cmath>
#include <span>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

std::vector<Pose> straight(std::size_t pings) {
  std::vector<Pose> poses(pings);
  for (std::size_t i = 0; i < pings; ++i) {
    poses[i].t_s = 0.1 * static_cast<double>(i);
    poses[i].position = {2.0 * poses[i].t_s, 1.0 / 3.0, -8.0};
    poses[i].velocity_mps = {2.0, 0.0, 0.0};
    poses[i].heading_rad = 1.5;
  }
  return poses;
}

std::vector<Pose> reported_poses(const NavigationOptions& options, std::uint64_t seed,
                                 std::span<const Pose> poses) {
  std::vector<Pose> reported;
  for (std::size_t i = 0; i < poses.size(); ++i)
    reported.push_back(reported_pose(options, seed, poses, i));
  return reported;
}

}  // namespace

TEST_CASE("a perfect navigation reports the true poses, to the bit") {
  const std::vector<Pose> poses = straight(20), reported = reported_poses({}, 1, poses);
  REQUIRE(reported.size() == poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    CHECK(reported[i].position == poses[i].position);
    CHECK(reported[i].heading_rad == poses[i].heading_rad);
  }
}

TEST_CASE("messages are late, rounded, and repeated until the next") {
  const std::vector<Pose> poses = straight(50);
  const std::vector<Pose> late = reported_poses({.delay_s = 0.25}, 1, poses);
  for (std::size_t i = 0; i < poses.size(); ++i)
    CHECK(late[i].position.x() == Approx(2.0 * (poses[i].t_s - 0.25)).margin(1e-12));
  const std::vector<Pose> slow = reported_poses({.update_interval_s = 0.4}, 1, poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    CHECK(slow[i].position.x() <= poses[i].position.x() + 1e-9);
    CHECK(slow[i].position.x() > poses[i].position.x() - 0.8 - 1e-9);
  }
  CHECK(slow[5].position == slow[6].position);
  CHECK(slow[5].t_s != slow[6].t_s);
  const std::vector<Pose> rounded =
      reported_poses({.position = {.step = 0.5}, .heading = {.step = 0.4}}, 1, poses);
  for (const Pose& pose : rounded) {
    CHECK(std::remainder(pose.position.x(), 0.5) == 0.0);
    CHECK(pose.heading_rad == Approx(1.6));
    CHECK(pose.position.z() == -8.0);
  }
}

TEST_CASE("noise has its rms, and a bias is constant in a run and differs from seed to seed") {
  const std::vector<Pose> poses = straight(20000);
  const std::vector<Pose> noisy = reported_poses({.position = {.rms = 3.0}}, 0, poses);
  double squares = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    squares += (noisy[i].position - poses[i].position).head<2>().squaredNorm();
  CHECK(std::sqrt(0.5 * squares / 20000.0) == Approx(3.0).epsilon(0.02));
  double biases = 0.0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const std::vector<Pose> off =
        reported_poses({.heading = {.bias_rms = 0.1}}, seed, std::span(poses).first(2));
    CHECK(off[0].heading_rad == off[1].heading_rad);
    biases += std::pow(off[0].heading_rad - 1.5, 2);
  }
  CHECK(std::sqrt(biases / 2000.0) == Approx(0.1).epsilon(0.05));
}
