#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/simd/cache_lines.h>
#include <ensonify/engine/sonar/echo/bin_kernel.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/object_echo.h>

namespace ensonify::engine {

/// Slant ranges at which a plane of a fan sees nothing because something nearer is in front.
struct Shadow {
  double from_m, until_m;
  float beam_weight;    ///< PieceEchoes::beam_weight that what lies there would have
  std::uint16_t label;  ///< of what casts the shadow
  std::size_t ray = 0;  ///< the last ray of the plane that meets the thing in front
};

/// Makes the bins without data before the bed's first return water: objects may return before the
/// bed does. Returns how many bins that are.
int fill_with_water(std::span<std::uint32_t> regions);

/// The range bins of one sector of one ping, filled plane by plane: energy, what it came from, and
/// what is in shadow. Bin i sums over slant ranges [i, i + 1) * bin_m. For each plane:
/// begin_plane(), lay(), then shade() for each shadow.
class RangeBins {
 public:
  RangeBins(double bin_m, std::size_t bins);

  /// Empties all bins; keeps the memory. abeam: horizontal direction into the sector; what lies on
  /// the other side of the sonar is past nadir. 0: nothing is past nadir.
  void reset(const Eigen::Vector3d& abeam = Eigen::Vector3d::Zero());
  void begin_plane();
  /// Lays the pieces of the plane.
  void lay(PiecesToLay pieces);
  /// Marks the bins that lie wholly between the ends of a shadow, except bins in which the plane
  /// sees something, and bins that another shadow of the plane has marked.
  void shade(const Shadow& shadow);
  /// Adds an echo that does not come from a plane.
  void add(const ObjectEcho& echo);

  std::size_t size() const { return bins_.size(); }
  double bin_m() const { return bin_m_; }
  double energy(std::size_t bin) const { return bins_[bin].energy; }
  /// The sums of the beam weights of the planes that see the bin, and that see it in shadow.
  float lit(std::size_t bin) const { return bins_[bin].lit; }
  float shadowed(std::size_t bin) const { return bins_[bin].shadowed; }
  /// The energy-weighted place of what the bin saw, from the sonar; 0 if it saw nothing.
  Eigen::Vector3d place(std::size_t bin) const {
    const EchoBin& at = bins_[bin];
    return at.energy > 0.0 ? Eigen::Vector3d(at.seen[0], at.seen[1], at.seen[2]) / at.energy
                           : Eigen::Vector3d::Zero().eval();
  }
  /// Writes all layers of a line except ranges and intensities, its first return and its number of
  /// starved bins. `sonar` is the fan's origin. The place and the grazing angle of a bin belong to
  /// the sector's side, or to the other side of nadir if that has most of the energy. The mean over
  /// both sides would be a place between them, at another range.
  void write(const FaceLabels& labels, const Eigen::Vector3d& sonar, EchoLine& line);

 private:
  /// The energy in a bin with a label other than the bin's first. Each bin has a list of these.
  struct Share {
    double energy;
    std::int32_t next;  // in shares_; -1: the last
    std::uint16_t label;
  };
  std::size_t bin_of(double range_m) const {
    return static_cast<std::size_t>(
        std::clamp(range_m / bin_m_, 0.0, static_cast<double>(bins_.size() - 1)));
  }
  void sort_shares();
  void choose_places();
  void add_share(std::size_t bin, std::uint16_t label, double energy);
  std::uint16_t strongest_label(std::size_t bin, double& energy) const;

  double bin_m_;
  CacheLines<EchoBin> bins_;
  CacheLines<PastNadir> past_;
  Eigen::Vector3d abeam_ = Eigen::Vector3d::Zero();
  std::vector<std::uint8_t> layover_;
  std::vector<OtherShare> others_;         // from lay_pieces(), not yet in the lists
  std::vector<std::int32_t> first_share_;  // by bin, in shares_; -1: none
  std::vector<Share> shares_;
  EchoBins to_;
};

}  // namespace ensonify::engine
