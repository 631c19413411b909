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
/// A glint is a point: a beam receives its field times the beam's field in the direction of the
/// glint. Glints of one object at one range have been joined at one place, also where the array
/// could tell them apart.
class SteeredEcho {
 public:
  SteeredEcho(const Sonar& sonar, const Medium& medium, const SteeredBeams& beams,
              std::size_t bins);

  /// Fills the lines of all beams, in their order, and planes.received. The layer `intensity` gets
  /// the expected values.
  void form(FanPlanes& planes, std::span<EchoLine> lines);

 private:
  /// The layers of one line that a beam has from its planes.
  struct TruthRow {
    float *x_m, *y_m, *z_m, *grazing_rad;
    std::uint32_t *sediment, *class_id, *instance, *layover, *region, *shadow_instance;

    void copy(const TruthRow& from, std::size_t bin) const {
      x_m[bin] = from.x_m[bin];
      y_m[bin] = from.y_m[bin];
      z_m[bin] = from.z_m[bin];
      grazing_rad[bin] = from.grazing_rad[bin];
      sediment[bin] = from.sediment[bin];
      class_id[bin] = from.class_id[bin];
      instance[bin] = from.instance[bin];
      layover[bin] = from.layover[bin];
      region[bin] = from.region[bin];
    }
    void clear(std::size_t bin) const {
      x_m[bin] = y_m[bin] = z_m[bin] = grazing_rad[bin] = 0.0f;
      sediment[bin] = class_id[bin] = instance[bin] = layover[bin] = region[bin] = 0;
    }
  };
  static TruthRow truth_row(BinLayers& bins);
  BeamBins sums_of(FanPlanes& planes, std::size_t beam);
  void add_planes(FanPlanes& planes);
  void add_glints(const FanPlanes& planes, std::size_t beam, EchoLine& line);
  void spread(const float* energy);
  void write_truth(const FanPlanes& planes, std::size_t beam, EchoLine& line) const;

  const SteeredBeams& beams_;
  double bin_m_;
  std::size_t bins_;
  PulseKernel pulse_;
  SteadyField steady_;
  SteeredBeams::Scratch scratch_;
  /// By beam and bin; as in BeamBins.
  std::vector<float> lit_, shadowed_, of_label_, most_;
  std::vector<std::uint32_t> plane_, shadowing_plane_;
  std::vector<TruthRow> plane_rows_;
  std::vector<float> powers_;            // of one block and beam, see receive_planes()
  std::vector<double> padded_, spread_;  // of one beam, before and after the pulse
};

}  // namespace ensonify::engine
