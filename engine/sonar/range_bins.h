#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/sonar/echo.h>
#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// What one ray of a fan saw of a surface's front.
struct Sight {
  std::uint32_t index = Hit::none;  ///< of the face; none: nothing, or a back
  std::size_t elevation = 0;        ///< the ray's, by number
  std::size_t bin = 0;              ///< RangeBins::bin_of(range_m)
  double range_m = 0.0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< at launch, unit
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();  ///< unit; of a bent ray's, as pictured (Arrival)
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< local metres
  double density = 0.0;  ///< energy per radian of elevation, without absorption and source level
  double grazing_rad = 0.0;
  double longest_edge_m = -1.0;  ///< of the face; negative: nobody asked yet
  float weight = 0.0f;           ///< the beam's there, times solid angle per radian of elevation
  std::uint16_t label = 0;       ///< of the face

  explicit operator bool() const { return index != Hit::none; }
  /// Slant range at which another direction meets this sight's facet plane; infinite if it never does.
  double plane_range_m(const Eigen::Vector3d& other) const;
};

/// The range bins of one side of one ping while its planes are walked: energy, and what it came from.
/// Energies are sums over [bin edges) of slant range; reset() forgets everything but the memory.
class RangeBins {
 public:
  RangeBins(double bin_m, std::size_t bins) : bin_m_(bin_m), bins_(bins) {}

  std::size_t bin_of(double range_m) const {
    return static_cast<std::size_t>(
        std::min(range_m / bin_m_, static_cast<double>(bins_.size() - 1)));
  }

  void reset();
  void begin_plane();
  /// Energy of the surface between two neighbouring sights, step_rad apart in elevation.
  void spread(const Sight& from, const Sight& to, double step_rad) {
    turn(to.range_m >= from.range_m ? 1 : -1, from.bin);
    if (from.density <= 0.0 && to.density <= 0.0) return;  // out of the beam at that range
    if (from.bin != to.bin) return spread_far(from, to, step_rad);
    add(from.bin, 0.5 * (from.density + to.density) * step_rad, to, 0.5 * (from.place + to.place),
        0.5 * (from.grazing_rad + to.grazing_rad));
  }
  /// Energy of a sight alone, for its half of a step to a neighbour that saw something else.
  void settle(const Sight& sight, double step_rad);
  /// The plane sees nothing between the sight and the range, because the sight is in front; it would
  /// with that weight.
  void shade(const Sight& blocker, double to_range_m, float weight);
  void end_plane();

  std::size_t size() const { return bins_.size(); }
  double bin_m() const { return bin_m_; }
  double energy(std::size_t bin) const { return bins_[bin].energy; }
  /// Writes everything but ranges and intensities, and counts first return and starved bins.
  void tell(const FaceLabels& labels, EchoLine& line) const;

 private:
  struct Bin {
    double energy = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // times energy
    double grazing = 0.0;                             // times energy
    double seen = 0.0, shadowed = 0.0;                // beam weights of the planes that …
    double darkest = 0.0;                             // the largest weight that shadowed it
    std::uint16_t blocker = 0;                        // and that one's label
    bool layover = false;
    std::uint32_t plane = 0, branch = 0, shadow_plane = 0;  // the last that came here
    std::int32_t first_share = -1;
  };
  struct Share {  // of a label in a bin's energy; a list a bin
    double energy;
    std::int32_t next;
    std::uint16_t label;
  };
  struct Shade {
    std::size_t first, last;  // bins [first, last)
    float weight;
    std::uint16_t label;
  };
  /// What came to one bin from one label without a break: most steps stay in the last one's.
  struct Heap {
    std::size_t bin = 0;
    std::uint32_t branch = 0;  // 0: nothing yet
    std::uint16_t label = 0;
    double energy = 0.0, grazing = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  void add(std::size_t index, double energy, const Sight& sight, const Eigen::Vector3d& place,
           double grazing_rad) {
    if (index != heap_.bin || branch_ != heap_.branch || sight.label != heap_.label)
      begin_heap(index, sight);
    heap_.energy += energy;
    heap_.place += energy * place;
    heap_.grazing += energy * grazing_rad;
  }
  void spread_far(const Sight& from, const Sight& to, double step_rad);
  void begin_heap(std::size_t index, const Sight& sight);
  void end_heap();
  void turn(int direction, std::size_t bin);

  double bin_m_;
  std::vector<Bin> bins_;
  Heap heap_;
  std::vector<Share> shares_;
  std::vector<Shade> shades_;
  std::uint32_t plane_ = 0;
  std::uint32_t branch_ = 0;
  int direction_ = 0;
  std::size_t turning_bin_ = 0;
};

}  // namespace ensonify::engine
