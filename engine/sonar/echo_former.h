#pragma once

#include <span>
#include <vector>

#include <ensonify/engine/seafloor/face_labels.h>
#include <ensonify/engine/sonar/aperture.h>
#include <ensonify/engine/sonar/echo.h>
#include <ensonify/engine/sonar/plane_beam.h>
#include <ensonify/engine/sonar/range_bins.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refracted_path.h>
#include <ensonify/scatter/backscatter.h>

namespace ensonify::engine {

/// The water between sonar and bed.
struct Medium {
  double sound_speed_mps = 1500.0;
  double absorption_db_per_m = 0.0;
};

/// Turns the nearest hits of a fan into the expected echo of one side of a ping, with the truth
/// beside it.
///
/// A ray of solid angle dOmega that meets the bed at range r and grazing angle g stands for the area
/// r^2 dOmega / sin(g) and returns b_t b_r sigma(g) / r^4 of it, with absorption. (A bent ray has its
/// spreading J for r^2, g where it arrives, and absorption along its path.) Within a plane
/// of the fan that is a density over elevation: between neighbouring rays that saw one continuous
/// surface it is integrated and spread over the bins between their ranges; where the surface breaks
/// off each ray keeps its own half. The bins then go through the pulse.
class EchoFormer {
 public:
  /// The seafloor, the tables and the labels of bodies that move (see FaceLabels) must outlive this;
  /// by_material[i] belongs to a label's sediment i.
  EchoFormer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
             std::span<const scatter::BackscatterTable> by_material,
             const std::vector<Label>* moving = nullptr);

  /// hits, over these triangles, by the ray numbers of the fan, which is the aperture's. Bent rays come
  /// with their arrivals, and their hits' t is the range that their time stands for; straight ones
  /// without. Fills the line of a side; the speckled intensity is still the expectation.
  void form(const RayFan& fan, const Aperture& aperture, const Reception& reception,
            refine::Triangles triangles, std::span<const Hit> hits, RayArrivals* arrivals,
            EchoLine& line);

 private:
  /// What a ray sees of its hit; `before` is what its neighbour saw.
  void look(const RayFan& fan, std::size_t elevation, const Eigen::Vector3d& direction,
            const Hit& hit, const Arrival* arrival, const Sight& before, Sight& sight);
  bool continuous(Sight& a, Sight& b) const;
  void walk_plane(const RayFan& fan, std::span<const Hit> hits, RayArrivals* arrivals,
                  std::size_t plane, EchoLine& line);
  void shade_beyond(const RayFan& fan, const Sight& blocker);
  double longest_edge_m(Sight& sight) const;

  FaceLabels labels_;
  Beam beam_;
  PlaneBeam plane_beam_;
  refine::Triangles triangles_;  // of this ping
  std::span<const scatter::BackscatterTable> by_material_;
  Eigen::Vector2d lowest_, highest_;  // the seafloor's bounds, seen from above
  double absorption_db_per_m_;
  RangeBins bins_;
  std::vector<double> gain_;    // of a bin's energy: source level and absorption
  std::vector<double> pulse_;   // pulse_kernel
  std::vector<double> energy_;  // of the bins, with gain; room for the pulse on either side
  std::vector<double> sums_;    // of the line's bins, through the pulse
};

}  // namespace ensonify::engine
