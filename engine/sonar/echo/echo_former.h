#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/fan_planes.h>
#include <ensonify/engine/sonar/echo/object_echoes.h>
#include <ensonify/engine/sonar/echo/steady_field.h>

namespace ensonify::engine {

/// Turns what the rays of a fan hit into the expected echo of one sector of one ping, and into the
/// truth about each of its range bins.
///
/// engine/sonar/README.md, "The expected echo", has the energy of a ray. For a bent ray J is its
/// spreading_m2, and the grazing angle is taken where it arrives.
///
/// Within a plane of the fan this energy is a density over elevation. A run of neighbouring rays on
/// one face becomes one piece or a few. A piece has the density at its middle over the elevations
/// halfway to the neighbouring rays, and its energy lies in the bins between the ranges of its
/// ends. Where one surface continues from piece to piece, these ends meet halfway; where the
/// surface breaks off, each piece keeps half a step at its end (SurfaceWalk). The echo of a place
/// at the range r that closes at the speed v comes back when the sonar is 2 r v / c nearer, which
/// shifts it in range by r v / c. The echo of a sweep is nearer still (Pulse::closing_shift_s). Its
/// energy, truth and shadows are at the shifted range. The bins are then convolved with the pulse's
/// energy response. The truth is not convolved: a bin has the truth of the places at its range.
/// With a CW pulse, the energy of a bin also comes from places that are up to c T / 2 nearer.
///
/// Objects have further echoes: see ObjectEchoes. A glint is steady, and the length of its path
/// gives its phase. Glints interfere while their pulses overlap (SteadyField).
class EchoFormer {
 public:
  /// The seafloor, the tables and the labels of moving bodies (see FaceLabels) must outlive this;
  /// materials[i] belongs to sediment i of a Label.
  EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const MaterialInSonar> materials, const std::vector<Label>* moving = nullptr,
             const ObjectSurfaces& surfaces = {});

  /// Fills a line, whose sector is set, with what one of the sonar's beams receives of a fan. The
  /// layer `intensity` gets the expected values. (The t of bent rays' hits is the range that their
  /// travel time stands for.)
  void form(const Beam& beam, const FanAim& aim, const FanHits& hits, EchoLine& line);
  /// The number of range bins that echoes are formed in, those beyond the sonar's included.
  std::size_t bins() const { return bins_.size(); }
  /// Fills what each plane of a fan receives of it through one element, for beams that are steered.
  void form_planes(const Beam& element, const FanAim& aim, const FanHits& hits, FanPlanes& planes);

 private:
  void begin(const SectorView& view, EchoLine& line);
  void add_plane(const FanHits& hits, std::size_t plane, EchoLine& line);
  void cut_runs(const FanRuns& runs, std::size_t plane);
  void cut_hits(std::span<const Hit> hits, IncidenceSource& incidences, std::size_t plane);
  void compute(std::size_t plane, EchoLine& line);
  void absorb_over_depth();
  void correct_bent_rays();
  void leave_out_small_objects();
  void move_aside();
  void lay(std::size_t plane);
  double nearer_m(double range_m, double drift) const;
  double absorbed_beyond_bin(double drift) const;
  ObjectEcho shifted(ObjectEcho echo) const;
  void lay_shifted(std::size_t plane);
  void add_glints(EchoLine& line);
  void finish(EchoLine& line);
  void sort_facets();
  void find_arrivals(std::size_t plane);
  void add_arrival(double from_m, double until_m, double energy, double sine);
  void take_plane(std::size_t plane, bool bent, FanPlanes& planes);
  void take_glints(FanPlanes& planes);

  FaceLabels labels_;
  std::span<const MaterialInSonar> materials_;
  std::vector<float> strengths_;              // the values of all materials' tables, in a row
  std::vector<std::int32_t> strengths_from_;  // by material: where its values begin
  double absorption_db_per_m_;                // contained in gain_
  const scatter::SoundSpeedProfile* profile_;
  double wavelength_m_;
  RangeBins bins_;
  SurfaceWalk walk_;
  ObjectEchoes objects_;
  std::vector<double> gain_;  // per bin, of its energy: source level and absorption
  PulseKernel pulse_;
  SteadyField glints_;
  double closing_shift_m_;      // Pulse::closing_shift_s() as a range
  std::vector<double> energy_;  // per bin, with gain; and room for the pulse at both ends
  std::vector<double> sums_;    // per bin of the line, after the pulse

  // The sector whose echo is formed:
  SectorView view_{};
  // Of the plane that is formed:
  PieceTable pieces_;
  CacheLines<std::uint32_t> max_rays_;  // per run: how many may form one piece
  /// How the middle ray of a piece meets its face.
  struct Arrival {
    RayIncidence incidence;
    Eigen::Vector3d launch, normal;  // unit; the normal of the side that it meets
    double grazing_sine;
  };
  std::vector<Arrival> arrivals_;  // per piece; bent rays only
  struct FacetOfPlane {
    std::size_t plane, number;
    double sine;  // ObjectEchoes::arrival_sine()
    ObjectEcho echo;
  };
  std::vector<FacetOfPlane> facets_;
  struct Arrived {
    double energy = 0.0;
    double moment = 0.0;  // energy times the sine of the direction from which it arrives
  };
  std::vector<Arrived> arrived_;  // by bin; bent rays of steered beams only
};

}  // namespace ensonify::engine
