#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// Where a bent ray meets a level bed: its slant range by travel time, divided by the height of the
/// sonar over the bed. Not a number if it does not meet the bed, or if the rays next to it meet the
/// bed at very different ranges.
struct LaunchRange {
  double depression_rad, range_over_height;
};

/// What a fan's grid of rays is laid out from. Angles of the sector are depressions: 0 is level, 90
/// degrees straight down; a larger angle looks past nadir to the other side.
struct FanLayout {
  double sector_low_rad = 0.0;   ///< the smallest depression (above the horizontal if negative)
  double sector_high_rad = 0.0;  ///< the largest
  double truncation_rad = 0.0;   ///< psi_t: rays farther from the broadside plane are skipped
  double main_lobe_rad = 0.0;    ///< from the beam's axis to its first null, far off
  /// From the beam's axis to the end of the main beam at the nearest range. If it is smaller than
  /// main_lobe_rad, main_lobe_rad is used.
  double main_beam_rad = 0.0;
  int planes = 8;  ///< planes across the main beam
  /// If positive, the planes lie at even steps of the sine of azimuth instead, for beams that are
  /// steered along the array.
  double sine_step = 0.0;
  int elevations = 2048;            ///< rays per plane
  double range_over_height = 10.0;  ///< the end of even ranges, see FanGrid
  /// How much roll lowers this side: added to the depressions when rays are laid out.
  double roll_tilt_rad = 0.0;
  /// The angle above the horizontal to which the bed reaches within range_over_height; 0 if the bed
  /// stays below the sonar.
  double rise_rad = 0.0;
  /// The ranges of bent rays by launch angle, the steepest first (bent_ranges()). Empty for
  /// straight rays.
  std::span<const LaunchRange> bent = {};
};

/// The rays of a fan in its own frame, the same for every ping. Each plane contains the pole and is
/// turned about it by an azimuth; within a plane rays differ by elevation, counted from the middle
/// of the sector. The sine of a ray's angle from broadside is cos(elevation) sin(azimuth).
///
/// Planes have even spacing across a main beam that is no wider than its main lobe. In the near
/// field the beam is wider; there the spacing grows outwards from the axis, so that the same number
/// of planes covers it: a wider beam means a nearer bed, which changes less over the same angle.
/// Beyond the main beam the spacing grows further.
///
/// Elevations are at equal steps of the distribution of a mixture. 65 % are even in slant range
/// over a flat bed, on both sides of nadir, so that every bin gets rays. 15 % are even in range
/// beyond that, in case the bed rises. 20 % are even in angle, for walls, hulls and nadir. Where
/// the bed rises above the sonar, 45 % are even in range over a slope that reaches the height of
/// the bed at the end of the range, and 35 % over a flat bed. Where rays bend, ranges are those of
/// the bent rays. The first and the last ray are at the ends of the sector.
struct FanGrid {
  explicit FanGrid(const FanLayout& layout);

  struct Plane {
    double sin_azimuth, cos_azimuth;
    double width_rad;  ///< the width in azimuth of the part of the beam that it stands for
  };
  double middle_depression_rad;
  double sin_truncation;
  std::vector<Plane> planes;          ///< by azimuth, ascending
  std::vector<double> elevation_rad;  ///< ascending: from the largest depression upwards
  std::vector<double> sin_elevation;
  std::vector<double> cos_elevation;

  std::size_t rays() const { return planes.size() * elevation_rad.size(); }
  bool within_beam(std::size_t plane, std::size_t elevation) const {
    return cos_elevation[elevation] * std::abs(planes[plane].sin_azimuth) <= sin_truncation;
  }
};

/// The limits of how far a fan's rays may bend from straight lines, each in the vertical plane of
/// its launch; no bend by default. For each point of a ray, seen from the origin: its direction is
/// within turn_rad of the launch direction; the cosine of its angle from the level is at most
/// `widening` times the same cosine of the launch direction; its distance is at most `lengthening`
/// times its t.
struct FanBend {
  double turn_rad = 0.0;
  double widening = 1.0;
  double lengthening = 1.0;
};

/// The ray bundle of one side of one ping: a grid of rays at a place. Ray (plane, elevation) has
/// number plane * elevations() + elevation.
struct RayFan {
  std::shared_ptr<const FanGrid> grid;
  Eigen::Vector3d origin;      ///< local metres
  Eigen::Vector3d array_axis;  ///< unit, along the array
  Eigen::Vector3d middle;      ///< unit, across the array, the middle of the sector
  Eigen::Vector3d pole;        ///< unit, across both, upwards
  double range_m;              ///< rays end here
  FanBend bend = {};

  std::size_t planes() const { return grid->planes.size(); }
  std::size_t elevations() const { return grid->elevation_rad.size(); }

  /// A plane's direction at elevation 0, from which its rays turn towards the pole.
  Eigen::Vector3d plane_direction(std::size_t plane) const {
    const FanGrid::Plane& p = grid->planes[plane];
    return p.cos_azimuth * middle + p.sin_azimuth * array_axis;
  }
  Eigen::Vector3d direction(const Eigen::Vector3d& in_plane, std::size_t elevation) const {
    return grid->cos_elevation[elevation] * in_plane + grid->sin_elevation[elevation] * pole;
  }
  /// The plane whose rays at elevation 0 have the sine nearest to this; for planes at even steps.
  std::size_t nearest_plane(double sine) const {
    const auto next =
        std::ranges::lower_bound(grid->planes, sine, {}, &FanGrid::Plane::sin_azimuth);
    if (next == grid->planes.begin()) return 0;
    const auto i = static_cast<std::size_t>(next - grid->planes.begin());
    if (next == grid->planes.end()) return i - 1;
    return next->sin_azimuth - sine < sine - grid->planes[i - 1].sin_azimuth ? i : i - 1;
  }
  Ray ray(std::size_t plane, std::size_t elevation) const {
    return {origin, direction(plane_direction(plane), elevation), 0.0, range_m};
  }
};

}  // namespace ensonify::engine
