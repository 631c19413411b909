#pragma once

#include <cstdint>
#include <numbers>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/glint.h>

namespace ensonify::engine {

/// An echo of an object, in addition to the echoes of rays.
struct ObjectEcho {
  double range_m;
  double spread_m;        ///< its energy lies within this of the range, to either side
  double energy;          ///< as PieceEchoes::energy
  Eigen::Vector3d place;  ///< from the sonar
  double grazing_rad;
  std::uint16_t label;
  std::uint32_t surface;   ///< FlatPart::surface
  bool piece = false;      ///< FlatPart::piece: the pieces of one surface add with their phases
  double phase_rad = 0.0;  ///< of a glint, relative to the phase of its path
};

/// The most cells of a flat part, in each direction.
inline constexpr double max_cells = 256.0;

/// The echo of a glint: it has one range, and the sound arrives at a right angle.
inline ObjectEcho glint_at(const Eigen::Vector3d& place, double range_m, double energy,
                           std::uint16_t label, std::uint32_t surface) {
  return {.range_m = range_m,
          .spread_m = 0.0,
          .energy = energy,
          .place = place,
          .grazing_rad = 0.5 * std::numbers::pi,
          .label = label,
          .surface = surface};
}

/// The glint of a flat part. energy_per_m2: the energy from 1 m^2 of cross-section.
inline ObjectEcho glint_of(const FlatPart& flat_part, const Mirror& mirror,
                           const Eigen::Vector3d& place, double range_m, double energy_per_m2,
                           std::uint16_t label) {
  ObjectEcho glint =
      glint_at(place, range_m, energy_per_m2 * mirror.cross_section_m2, label, flat_part.surface);
  glint.piece = flat_part.piece;
  glint.phase_rad = mirror.phase_rad;
  return glint;
}

}  // namespace ensonify::engine
