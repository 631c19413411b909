#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/buried_surfaces.h>
#include <ensonify/engine/sonar/echo/object_sight.h>
#include <ensonify/scatter/buried_path.h>

namespace ensonify::engine {

/// The echoes of things in the bed: engine/sonar/README.md, "Buried things". Flat parts return
/// sound as if they lay at the range sqrt(J), where J is the geometric mean of the spreading on the
/// way down and on the way back. How much of a thing is seen follows from the rays next to the one
/// that leads to where the sound enters the bed. A bent ray enters the bed like the straight ray
/// that arrives there in the same direction with the same spreading.
class BuriedEchoes {
 public:
  /// All arguments must outlive this.
  BuriedEchoes(const ObjectSight& sight, std::span<const MaterialInSonar> materials,
               double wavelength_m)
      : sight_(sight), materials_(materials), wavelength_m_(wavelength_m) {}

  /// Appends the echoes of a group in the sector that the sight looks at.
  void find(const BuriedGroup& group, std::vector<ObjectEcho>& facets,
            std::vector<ObjectEcho>& glints) const;

 private:
  struct Way {  // from the sonar to a place in the bed
    scatter::BuriedPath path;
    const scatter::Sediment* sediment;
    RayToPlace ray;           // to where it enters the bed
    Eigen::Vector3d arrival;  // unit, of travel in the sediment
  };
  std::optional<Way> way_into_bed(const Eigen::Vector3d& away, double depth_m,
                                  const BuriedPart& part) const;
  struct Sight {
    double time_range_m = 0.0, energy = 0.0;  // energy: of 1 m^2 of cross-section
  };
  Sight see(const Way& way) const;
  void add_facets(const BuriedPart& part, const BuriedGroup& group, const Label& label,
                  std::vector<ObjectEcho>& facets) const;
  void add_glint(const BuriedPart& part, const BuriedGroup& group, double specular,
                 std::vector<ObjectEcho>& glints) const;

  const ObjectSight& sight_;
  std::span<const MaterialInSonar> materials_;
  double wavelength_m_;
};

}  // namespace ensonify::engine
