#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::scatter {

/// The rays of sound that go down from one depth without turning: which of them comes to a point,
/// and when. They cannot cross: of two, the flatter one is farther out at every depth, so that a
/// point has one or none. Ranges and times to the layers' edges are tabulated over the launch
/// angle's cotangent, of which the range in water of one speed is a multiple; within a layer they
/// are SoundRay's closed forms.
class DirectRays {
 public:
  /// How a ray comes to a point.
  struct Eigenray {
    double cotangent = 0.0;  ///< of its launch angle below the horizontal
    double time_s = 0.0;
    double path_m = 0.0;
    double range_per_cotangent_m = 0.0;  ///< at that depth
    double sound_speed_mps = 1500.0;     ///< there
    double absorption_db = 0.0;          ///< along it, where the profile has absorption
  };

  /// To depths from one to another. The profile must outlive this. Throws std::invalid_argument
  /// unless they are finite and in order.
  DirectRays(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m);

  /// From now on from that depth, which must be above all that is asked for.
  void start_at(double source_depth_m);
  /// The largest cotangent that is known: rays beyond it are within 3 degrees of turning, or within
  /// 1 of level.
  double flattest() const { return flattest_; }

  /// The way to a range and a depth below the source; its cotangent is a guess before, the nearer
  /// the quicker. False for a point that no known ray reaches, beyond the flattest.
  bool find(double range_m, double depth_m, Eigenray& way) const;
  /// Its own way to a depth, and how far out it is there, of a ray that is not beyond the flattest.
  double follow(double cotangent, double depth_m, Eigenray& way) const;
  /// Where the flattest ray comes to a depth.
  double farthest_m(double depth_m) const;

 private:
  struct Piece {  // of a layer, from the source or its top to the next
    double top_m, top_mps, gradient_per_s;
    double top_db_per_m, db_per_m2;  // of absorption
  };
  struct Node {  // at a piece's top
    double range_m, range_slope_m, time_s, time_slope_s, mean_mps, mean_db_per_s;
  };

  struct Place {
    double range_m, range_slope_m, time_s, path_m, xi, mps, absorption_db;
  };
  std::size_t piece_of(double depth_m) const;
  Place at(double cotangent, std::size_t piece, double depth_m) const;

  const SoundSpeedProfile* profile_;
  double shallowest_m_, deepest_m_;
  double source_mps_ = 0.0;
  double flattest_ = 0.0;
  std::size_t nodes_ = 0;
  std::size_t first_ = 0;      // piece of the shallowest depth: those above have no nodes
  std::vector<Piece> pieces_;  // from the source down
  std::vector<Node> table_;    // [piece - first][node]
};

}  // namespace ensonify::scatter
