#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/fan_planes.h>
#include <ensonify/engine/sonar/echo/steered_beams.h>
#include <ensonify/engine/sonar/reception/scatterers.h>

namespace ensonify::engine {

/// The speckle of steered beams: every plane of the fan sums its own scatterers of the ground, with
/// the plane's energy as their variance; a beam sums the planes, each times the field that the beam
/// receives from there. So beams that overlap receive the same scatterers, and their correlation is
/// that of their patterns on the ground (van Cittert and Zernike). Scatterers are fixed to the
/// ground, so that frames from places near to each other are alike (Scatterers). Where two planes
/// lie on either side of an angle at which the direction of cells changes, they still share none.
class SteeredSpeckle {
 public:
  /// The parameters are those of Scatterers and SteeredBeams.
  SteeredSpeckle(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                 double reference_heading_rad,
                 const std::vector<scatter::GroundTexture>& by_material,
                 const std::function<void()>& stop_check = {});

  /// One thread's working memory, and the fields.
  struct Scratch {
    std::vector<float> re, im;    ///< by look, beam and bin, before the pulse; each beam padded
    std::vector<float> variance;  ///< of these fields, by beam and bin, padded likewise
    std::vector<float> plane_re, plane_im;  // by look, plane and bin
    std::vector<float> power;               // of one plane
    Scatterers::Scratch cells;
    SteeredBeams::Scratch ranges;
  };
  /// Sums the fields of all beams for a number of looks. reach: bins by which each beam is padded
  /// at both ends.
  void sum(const FanPlanes& planes, int looks, std::size_t reach, Scratch& scratch) const;
  /// Where a beam's values begin in Scratch, its padding included; look 0 for the variance.
  std::size_t begin_of(std::size_t beam, int look, std::size_t reach) const {
    return (static_cast<std::size_t>(look) * beams_.size() + beam) * (room_ + 2 * reach);
  }

 private:
  void gather(const FanPlanes& planes, int looks, Scratch& scratch) const;
  SteeredBeams beams_;
  Scatterers scatterers_;
  std::size_t bins_, room_;
};

}  // namespace ensonify::engine
