#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace ensonify::engine {

/// An echo of an object, apart from those of the rays.
struct ObjectEcho {
  double range_m;
  double spread_m;        ///< its energy lies within this of the range, to either side
  double energy;          ///< as PieceEchoes::energy
  Eigen::Vector3d place;  ///< from the sonar
  double grazing_rad;
  std::uint16_t label;
  std::uint32_t surface;   ///< FlatPart::surface
  bool piece = false;      ///< FlatPart::piece; those of one surface add with their phases
  double phase_rad = 0.0;  ///< of a glint, against that of the path
};

}  // namespace ensonify::engine
