#include <ensonify/engine/trace/fan_frame.h>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

FanFrame frame_of(const RayFan& fan) {
  FanFrame frame{};
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    frame.origin[k] = fan.origin[i];
    frame.axes[k] = fan.array_axis[i];
    frame.axes[3 + k] = fan.middle[i];
    frame.axes[6 + k] = fan.pole[i];
  }
  frame.handedness = fan.array_axis.cross(fan.middle).dot(fan.pole) < 0.0 ? -1.0 : 1.0;
  return frame;
}

}  // namespace ensonify::engine
