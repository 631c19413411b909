#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/echo_kernel.h>

namespace ensonify::engine {

/// The range bins of one side of one ping while its planes are walked: energy, and what it came
/// from. Energies are sums over [bin edges) of slant range; reset() forgets everything but the
/// memory.
class RangeBins {
 public:
  RangeBins(double bin_m, std::size_t bins);

  void reset();
  void begin_plane();
  /// The pieces of the plane, with their labels; `broken` as lay_pieces has it.
  void lay(const PieceKernelArgs& plane, std::span<const std::uint16_t> labels,
           std::span<const std::uint8_t> broken);
  /// The plane sees nothing between two ranges because something with that label is in front; it
  /// would with that weight.
  void shade(double from_m, double until_m, float weight, std::uint16_t label);
  void end_plane();

  std::size_t size() const { return bins_.size(); }
  double bin_m() const { return bin_m_; }
  double energy(std::size_t bin) const { return bins_[bin].energy; }
  /// Writes everything but ranges and intensities, and counts first return and starved bins.
  void tell(const FaceLabels& labels, const Eigen::Vector3d& sonar, EchoLine& line) const;

 private:
  struct Share {  // of another label than the first in a bin's energy; a list a bin
    double energy;
    std::int32_t next;
    std::uint16_t label;
  };
  struct Shade {
    std::size_t first, last;  // bins [first, last)
    float weight;
    std::uint16_t label;
  };
  std::size_t bin_of(double range_m) const {
    return static_cast<std::size_t>(
        std::clamp(range_m / bin_m_, 0.0, static_cast<double>(bins_.size() - 1)));
  }
  void share_out();
  std::uint16_t strongest(std::size_t bin, double& energy) const;

  double bin_m_;
  CacheLines<EchoBin> bins_;
  std::vector<std::uint8_t> layover_;
  std::vector<OtherShare> others_;  // not yet in the lists
  std::vector<std::int32_t> first_share_;
  std::vector<Share> shares_;
  std::vector<Shade> shades_;
  EchoBins to_;
};

}  // namespace ensonify::engine
