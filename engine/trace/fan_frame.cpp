#include <ensonify/engine/trace/fan_frame.h>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

FanFrame frame_of(const RayFan& fan) {
  FanFrame frame{};
  Eigen::Vector3d::Map(frame.origin.data()) = fan.origin;
  Eigen::Matrix3d::Map(frame.axes.data()) << fan.array_axis, fan.middle, fan.pole;
  frame.handedness = fan.array_axis.cross(fan.middle).dot(fan.pole) < 0.0 ? -1.0 : 1.0;
  return frame;
}

}  // namespace ensonify::engine
