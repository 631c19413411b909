#include <ensonify/engine/trace/refraction/ray_incidence.h>

#include <ensonify/engine/trace/refraction/horizontal.h>

namespace ensonify::engine {

// A normal is stretched by the factors by which lengths shrink: it keeps its angle to the facet.
Eigen::Vector3d RayIncidence::straightened(const Eigen::Vector3d& normal,
                                           const Eigen::Vector3d& launch) const {
  const Eigen::Vector2d outwards = horizontal(launch);
  const auto upwards_of = [&](const Eigen::Vector3d& d) {
    const double down = -d.z();
    return Eigen::Vector3d(down * outwards.x(), down * outwards.y(), d.head<2>().dot(outwards));
  };
  const Eigen::Vector3d aside(-outwards.y(), outwards.x(), 0.0);
  return (along * normal.dot(direction) * launch +
          upwards * normal.dot(upwards_of(direction)) * upwards_of(launch) +
          sideways * normal.dot(aside) * aside +
          upturn * normal.dot(direction) * Eigen::Vector3d::UnitZ())
      .normalized();
}

}  // namespace ensonify::engine
