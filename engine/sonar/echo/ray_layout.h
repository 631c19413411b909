#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/bent_ranges.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// How the rays of a sonar's fan are laid out, and the samples of the beam that do not change from
/// ping to ping.
///
/// A ray stands for the azimuths about its plane that are nearest to it. These azimuths are divided
/// into parts that are half a null wide, or wider where only the near field reaches. The beam is
/// integrated with two Gauss points in each part.
struct RayLayout {
  /// Rays [from, until) of a plane, by elevation, that are within the beam.
  struct Stretch {
    std::size_t from, until;
  };
  std::shared_ptr<const FanGrid> grid;
  std::vector<BeamSample> samples;           ///< plane by plane, see samples_of()
  std::vector<std::size_t> first_sample;     ///< of each plane, and the end
  std::vector<std::vector<Stretch>> within;  ///< by plane, ascending
  std::uint64_t rays = 0;                    ///< all rays within the beam
  /// By elevation: the angle halfway to the elevation before; then the last elevation itself.
  std::vector<double> edge_rad;
  /// At elevation j (index 2 j), and halfway to the next elevation (2 j + 1).
  std::vector<RayDirection> directions;
  /// By elevation: how many rays from it on may form one piece if all hit one face.
  std::vector<std::uint8_t> max_rays_per_piece;

  std::span<const BeamSample> samples_of(std::size_t plane) const {
    return std::span(samples).subspan(first_sample[plane],
                                      first_sample[plane + 1] - first_sample[plane]);
  }
};

/// The layout of the sectors with this element, for one ratio of the sonar's range to its altitude
/// and for one tilt of the sector (roll_tilt_rad()). Ratio and tilt decide only where rays lie
/// close together; the meaning of a ray does not depend on them. drift_rad: the angle by which the
/// receiver turns and moves until its echo is back. If the receiver's beam is narrower than the
/// transmitter's, the fan has additional planes for this angle. nearest_share: the range of the
/// nearest thing, divided by the altitude. In the near field the beam is wider at that range than
/// over the bed, so there are further planes on the outside. rise_rad: how far above the horizontal
/// the bed reaches, 0 if not. bent: as in FanLayout.
RayLayout make_ray_layout(const Sonar& sonar, double wavelength_m, double range_over_height,
                          const std::optional<Element>& element = {}, double roll_tilt_rad = 0.0,
                          double drift_rad = 0.0, double nearest_share = 1.0, double rise_rad = 0.0,
                          std::span<const LaunchRange> bent = {});

/// The azimuth between neighbouring planes of a fan about the beam's axis.
double planes_apart_rad(const Sonar& sonar, double wavelength_m);

/// How far below the horizontal the abeam axis of a sector points at a pose: its tilt by roll.
double roll_tilt_rad(const Pose& pose, const Sector& sector);

/// The range of the rays. It ends a little beyond the last bin, because the pulse of an echo from
/// there still reaches into the last bin. While sonar and bed approach each other, echoes of a
/// sweep also appear nearer than they are.
double trace_range_m(const Sonar& sonar, double sound_speed_mps);

/// The fan of a sector at a pose. Its origin is the position rounded to floats (nearest_floats.h).
RayFan place_fan(const RayLayout& layout, const Pose& pose, const Sector& sector, double range_m);

/// The layouts of a sonar, made when they are first needed. Pings share one layout if these values
/// lie in the same steps: the altitude and the nearest range in steps of 19 %, the tilt in steps of
/// half a degree, the drift in steps of a quarter of the receiver's lobes, and rise_rad in steps of
/// half the angle between the horizontal and a flat bed at the end of the range. So steady pings
/// make no new layout. Where rays bend, pings share the ranges of bent rays if the altitude lies in
/// one step of 4 % and the depth in one step of 2 % of the altitude. Each of these pings has a
/// separate layout, whose rays follow the limits beyond which rays do not reach a level bed
/// (LaunchLimits).
class RayLayouts {
 public:
  RayLayouts(const Sonar& sonar, double wavelength_m);
  RayLayouts(const RayLayouts&) = delete;  // a copy would share layouts that are used again
  RayLayouts(RayLayouts&&) = default;
  /// Lays the rays for a sea in which rays bend. The profile must outlive this.
  void bend(const scatter::SoundSpeedProfile& profile, double reference_mps) {
    profile_ = &profile;
    reference_mps_ = reference_mps;
  }
  /// nearest_m: the range of the nearest thing, at most the altitude. drift_rad, rise_rad: as in
  /// make_ray_layout().
  std::shared_ptr<const RayLayout> at(const Pose& pose, const Sector& sector, double altitude_m,
                                      double nearest_m, double drift_rad, double rise_rad);

 private:
  /// The layout of a ping, and its grid. A later ping reuses them if nothing else holds them, so
  /// that steady pings allocate no memory.
  struct Moved {
    std::shared_ptr<RayLayout> layout;
    std::shared_ptr<FanGrid> grid;
  };
  Moved& unused(const FanGrid& grid);  ///< a new one, with a copy of the grid, if all are held

  Sonar sonar_;
  double wavelength_m_;
  double sent_rad_, received_rad_;  // how far the traced lobes of each array reach in the far field
  double main_lobe_rad_;            // of the narrower array
  const scatter::SoundSpeedProfile* profile_ = nullptr;  // if rays bend
  double reference_mps_ = 0.0;
  /// By steps of altitude, finer steps of altitude, and steps of depth.
  std::map<std::array<int, 3>, BentRanges> bent_;
  /// The key is the number of the sector (-1 if the sector has no element), then the steps of
  /// altitude, nearest range, tilt, drift and rise. If rays bend, the steps of depth and the finer
  /// steps of altitude follow; otherwise these two are 0.
  std::map<std::array<int, 8>, std::shared_ptr<const RayLayout>> made_;
  std::vector<Moved> moved_;
};

/// A line of each ping: what one receive beam receives of one sector.
struct LinePlan {
  std::size_t sector = 0;  ///< index in Sonar::sectors()
  int beam = 0;            ///< from the rear, see Sonar::beams
  double sine = 0.0;       ///< along the array, of the direction in which a steered beam looks
  std::size_t fan = 0;     ///< index of the sonar's fan from whose rays the line is formed
};

/// Where a fan of a sonar looks at a ping.
struct FanAim {
  RayFan fan;
  std::shared_ptr<const RayLayout> layout;
  ReceiverMotion motion;
  double altitude_m = 0.0;  ///< over the bed straight below
};

}  // namespace ensonify::engine
