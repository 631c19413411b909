#include <ensonify/engine/trace/refraction/ray_incidence.h>

namespace ensonify::engine {
namespace {

/// The unit vectors across a ray: upwards at its launch and at its hit, and horizontal.
struct Across {
  Across(const Eigen::Vector3d& launch, const Eigen::Vector3d& direction) {
    const Eigen::Vector2d outwards = horizontal(launch);
    const auto upwards_of = [&](const Eigen::Vector3d& d) {
      const double down = -d.z();
      return Eigen::Vector3d(down * outwards.x(), down * outwards.y(), d.head<2>().dot(outwards));
    };
    up_at_launch = upwards_of(launch);
    up_at_hit = upwards_of(direction);
    aside = {-outwards.y(), outwards.x(), 0.0};
  }
  Eigen::Vector3d up_at_launch, up_at_hit, aside;
};

}  // namespace

// A normal is stretched by the factors by which lengths shrink, so that it stays perpendicular to
// the facet.
Eigen::Vector3d RayIncidence::straightened(const Eigen::Vector3d& normal,
                                           const Eigen::Vector3d& launch) const {
  const Across across(launch, direction);
  return (along * normal.dot(direction) * launch +
          upwards * normal.dot(across.up_at_hit) * across.up_at_launch +
          sideways * normal.dot(across.aside) * across.aside +
          upturn * normal.dot(direction) * Eigen::Vector3d::UnitZ())
      .normalized();
}

// The displacement is the step times the transpose of the matrix that straightens a normal.
RayIncidence::Step RayIncidence::in_sea(const Eigen::Vector3d& step,
                                        const Eigen::Vector3d& launch) const {
  const Across across(launch, direction);
  const double on = step.dot(launch), up = step.dot(across.up_at_launch),
               aside = step.dot(across.aside);
  return {.displacement = (along * on + upturn * step.z()) * direction +
                          upwards * up * across.up_at_hit + sideways * aside * across.aside,
          .turn = (turn_along * on + turn_upwards * up) * across.up_at_hit +
                  turn_sideways * aside * across.aside};
}

}  // namespace ensonify::engine
