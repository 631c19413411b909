#pragma once

#include <cstddef>
#include <memory>

#include <ensonify/engine/sonar/echo/ray_layout.h>

namespace ensonify::engine {

/// A line of each ping: what one receive beam receives of one sector.
struct LinePlan {
  std::size_t sector = 0;  ///< index in Sonar::sectors()
  int beam = 0;            ///< from the rear, see Sonar::beams
  std::size_t fan = 0;     ///< index of the sonar's fan from whose rays the line is formed
};

/// Where a fan of a sonar looks at a ping.
struct FanAim {
  RayFan fan;
  std::shared_ptr<const RayLayout> layout;
  ReceiverMotion motion;
  double altitude_m = 0.0;  ///< over the bed straight below
};

}  // namespace ensonify::engine
