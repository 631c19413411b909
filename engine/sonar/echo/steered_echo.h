#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/echo/fan_planes.h>
#include <ensonify/engine/sonar/echo/media_in_sonar.h>
#include <ensonify/engine/sonar/echo/steady_field.h>
#include <ensonify/engine/sonar/echo/steered_beams.h>
#include <ensonify/engine/sonar/echo/steered_kernel.h>
#include <ensonify/engine/sonar/instrument/pulse.h>

namespace ensonify::engine {

/// The expected echo of steered beams, and the truth about each of their bins, from what the planes
/// of a fan receive.
///
/// A beam's energy is the sum over the planes, each times the power that the beam receives from
/// the direction in which the plane sees the bin; then the pulse spreads it over range. All
/// elevations of a beam fold into one bin. The label, place and grazing angle of a bin are those of
/// the plane that adds most; `fraction` is the share of the energy of all planes with that label.
/// A glint is a point: its field times the beam's. Glints of one object that the array could tell
/// apart, but that lie at one range, have been joined at one place.
class SteeredEcho {
 public:
  SteeredEcho(const Sonar& sonar, const Medium& medium, const SteeredBeams& beams,
              std::size_t bins);

  /// Fills the lines of all beams, in their order; `intensity` is left at the expectation.
  void form(FanPlanes& planes, std::span<EchoLine> lines);

 private:
  BeamBins sums_of(std::size_t beam, std::size_t from);
  void add_planes(const FanPlanes& planes);
  void add_glints(const FanPlanes& planes, std::size_t beam, EchoLine& line);
  void spread(std::size_t beam);
  void write_truth(const FanPlanes& planes, std::size_t beam, EchoLine& line) const;

  const SteeredBeams& beams_;
  double bin_m_;
  std::size_t bins_;
  PulseKernel pulse_;
  SteadyField steady_;
  SteeredBeams::Scratch scratch_;
  /// By beam and bin; as in BeamBins.
  std::vector<float> energy_, lit_, shadowed_, of_label_, most_, most_shadowed_;
  std::vector<std::uint32_t> label_, plane_, shadowing_plane_;
  std::vector<double> padded_, spread_;  // of one beam, before and after the pulse
};

}  // namespace ensonify::engine
