#pragma once

#include <functional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/solids.h>

namespace ensonify::engine {

/// The form of the hull of a ship or boat. y points towards the bow and is 0 amidships, z points up
/// from the keel. Sections are superellipses |x / b|^n + |(top - z) / d|^n = 1 below the gunwale.
struct HullLines {
  double length_m, beam_m, depth_m;
  double section = 4.0;                        ///< n amidships: 2 is round, 8 is a box
  double end_section = 1.5;                    ///< n at the bow
  double bow_power = 3.0, stern_power = 3.0;   ///< large: full breadth until near the ends
  double bow_width = 0.04, stern_width = 0.3;  ///< breadth at the ends / beam
  double sheer_m = 0.0;                        ///< rise of the gunwale at the bow
  double stern_rise_m = 0.0;                   ///< rise of the keel at the stern
  double rake_m = 0.0;                         ///< distance of the stem's top ahead of its foot

  // s is the share of the length: 0 at the stern and 1 at the bow.
  double half_breadth_m(double s) const;  ///< at the gunwale
  double top_m(double s) const;
  double keel_m(double s) const;
  double exponent(double s) const;
  /// The half breadth at a distance below the gunwale.
  double half_breadth_m(double s, double below_top_m) const;
  /// A point of the section, `inset_m` inside the hull. t is -1 at the port gunwale, 0 at the keel
  /// and 1 at the starboard gunwale. In a round section, equal steps of t are equal angles.
  Eigen::Vector3d point(double s, double t, double inset_m = 0.0) const;
};

/// A part of a hull's plating, or a frame of the hull.
struct HullPlating {
  double from = 0.0, to = 1.0;  ///< shares of the length
  int stations = 24;
  double inset_m = 0.0, thick_m = 0.1;
  bool from_torn = false, to_torn = false;
  /// Whether the plating at (s, t) is missing; empty: nowhere.
  std::function<bool(double, double)> missing;
};

class Draws;
void add_plating(Solids& solids, const HullLines& lines, const HullPlating& plating, Draws& draws);

}  // namespace ensonify::engine
