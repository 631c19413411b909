#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::scatter {

/// The rays of sound that go down from one depth without turning upwards. Finds the one of these
/// rays that reaches a point, and its travel time. These rays cannot cross: of two rays, the
/// flatter one is farther out at every depth, so a point has one ray or none. Ranges and times to
/// the edges of layers are in tables over the cotangent of the launch angle, because in water of
/// one speed the range is proportional to the cotangent. Within a layer, the closed forms of
/// SoundRay are used.
class DirectRays {
 public:
  /// The ray that reaches a point.
  struct Eigenray {
    double cotangent = 0.0;  ///< of the launch angle below the horizontal
    double time_s = 0.0;
    double path_m = 0.0;
    double range_per_cotangent_m = 0.0;  ///< at the point's depth
    double sound_speed_mps = 0.0;        ///< at the point
    double absorption_db = 0.0;          ///< along the ray, if the profile has absorption
  };

  /// For points at depths in [shallowest_m, deepest_m]. The profile must outlive this object.
  /// Throws std::invalid_argument unless both depths are finite and in order.
  DirectRays(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m);

  /// Moves the source to a depth, which must be above all points that are queried.
  void start_at(double source_depth_m);
  /// The largest cotangent in the tables. Flatter rays come within 3 degrees of the horizontal,
  /// where they would turn, or start within 1 degree of it.
  double flattest() const { return flattest_; }

  /// Finds the ray to a point at range_m and a depth below the source. way.cotangent must hold a
  /// guess; the search is faster if the guess is nearer. Returns false for a point beyond the
  /// flattest ray in the tables.
  bool find(double range_m, double depth_m, Eigenray& way) const;
  /// Follows a ray, which must not be flatter than flattest(), to a depth; returns its range there.
  double follow(double cotangent, double depth_m, Eigenray& way) const;
  /// The range of the flattest ray at a depth.
  double farthest_m(double depth_m) const;

 private:
  struct Piece {  // a part of a layer, from the source or the layer's top down
    double top_m, top_mps, gradient_per_s;
    double top_db_per_m, db_per_m2;  // of absorption
  };
  struct Node {  // at a piece's top
    double range_m, range_slope_m, time_s, time_slope_s, mean_mps, mean_db_per_s;
  };

  struct Place {
    double range_m, xi;  // xi: Snell's constant, s/m
    Eigenray way;
  };
  std::size_t piece_of(double depth_m) const;
  Place at(double w, std::size_t k, double depth_m) const;  // w: cotangent, k: number of the piece

  const SoundSpeedProfile* profile_;
  double shallowest_m_, deepest_m_;
  double source_mps_ = 0.0;
  double flattest_ = 0.0;
  std::size_t nodes_ = 0;
  std::size_t first_ = 0;      // the piece with shallowest_m; pieces above it have no nodes
  std::vector<Piece> pieces_;  // from the source down
  std::vector<Node> table_;    // [piece - first][node]
};

}  // namespace ensonify::scatter
