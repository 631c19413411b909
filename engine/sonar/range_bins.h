#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/sonar/echo.h>

namespace ensonify::engine {

/// The echo of a piece of surface that a few rays of a plane see.
struct Glint {
  double energy;          ///< without absorption and source level
  Eigen::Array4d middle;  ///< what was seen: x, y, z from the sonar, and the grazing angle
  Eigen::Array4d change;  ///< of that, from end to end
  float slant;            ///< by what share the energy's density over range changes
  float weight;           ///< the beam's there, times solid angle per radian of elevation
  std::uint16_t label;
};

/// The range bins of one side of one ping while its planes are walked: energy, and what it came from.
/// Energies are sums over [bin edges) of slant range; reset() forgets everything but the memory.
class RangeBins {
 public:
  RangeBins(double bin_m, std::size_t bins)
      : bin_m_(bin_m), per_m_(1.0 / bin_m), bins_(bins), layover_(bins), first_share_(bins) {}

  std::size_t bin_of(double range_m) const {
    return static_cast<std::size_t>(
        std::min(range_m * per_m_, static_cast<double>(bins_.size() - 1)));
  }

  void reset();
  void begin_plane();
  /// The plane goes on with a piece of surface between two ranges.
  void lay(const Glint& glint, double from_m, double until_m) {
    const std::size_t from = bin_of(from_m), until = bin_of(until_m);
    const int direction = until_m >= from_m ? 1 : -1;
    if (direction != direction_) turn(direction, from);
    if (glint.energy <= 0.0) return;  // out of the beam at that range
    if (from == until)
      add(from, glint.energy, glint.middle, glint);
    else
      lay_across(glint, from_m, until_m, from, until);
  }
  /// The surface ends: what comes next is another.
  void break_off() { direction_ = 0; }
  /// The plane sees nothing between two ranges because something with that label is in front; it would
  /// with that weight.
  void shade(double from_m, double until_m, float weight, std::uint16_t label);
  void end_plane();

  std::size_t size() const { return bins_.size(); }
  double bin_m() const { return bin_m_; }
  double energy(std::size_t bin) const { return bins_[bin].energy; }
  /// Writes everything but ranges and intensities, and counts first return and starved bins.
  void tell(const FaceLabels& labels, const Eigen::Vector3d& sonar, EchoLine& line) const;

 private:
  static constexpr std::int32_t nobody = -1, several = -2;
  struct alignas(64) Bin {                         // one cache line
    Eigen::Array4d seen = Eigen::Array4d::Zero();  // middles times energy
    double energy = 0.0;
    float lit = 0.0f, shadowed = 0.0f;  // beam weights of the planes that see it, or jump over it
    float darkest = 0.0f;               // the largest weight that shadowed it
    std::uint32_t visit = 0;            // the last of a plane's branches that came here
    std::int32_t label = nobody;        // whose energy it is, or: several
    std::uint16_t blocker = 0;          // label of the one that was darkest
    std::uint16_t shadow_plane = 0;     // the last that jumped over it
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
  static constexpr int branch_bits = 16;

  void add(std::size_t index, double energy, const Eigen::Array4d& seen, const Glint& glint) {
    Bin& bin = bins_[index];
    if (bin.visit != visit_) come_to(index, glint.weight);
    if (bin.label != glint.label) share(index, glint.label, energy);
    bin.energy += energy;
    bin.seen += energy * seen;
  }
  void lay_across(const Glint& glint, double from_m, double until_m, std::size_t from,
                  std::size_t until);
  void come_to(std::size_t index, float weight);
  void share(std::size_t index, std::uint16_t label, double energy);
  void turn(int direction, std::size_t bin) {
    ++visit_;
    direction_ = direction;
    turning_bin_ = bin;
  }
  std::uint32_t plane() const { return visit_ >> branch_bits; }

  double bin_m_, per_m_;
  std::vector<Bin> bins_;
  std::vector<std::uint8_t> layover_;
  std::vector<std::int32_t> first_share_;  // of bins with several labels
  std::vector<Share> shares_;
  std::vector<Shade> shades_;
  std::uint32_t visit_ = 0;  // plane and branch
  int direction_ = 0;
  std::size_t turning_bin_ = 0;
};

}  // namespace ensonify::engine
