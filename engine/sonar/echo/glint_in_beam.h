#pragma once

#include <cmath>
#include <complex>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/flat_parts.h>
#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/echo/glint.h>

namespace ensonify::engine {

/// A straight line of a surface that passes a sonar, and the integral over what lies of it in the
/// sonar's beam.
class BeamOnLine {
 public:
  /// middle: of the line, from the sonar. range_m: of its place next to the foot of the line of
  /// sight.
  BeamOnLine(const Eigen::Vector3d& middle, const Eigen::Vector3d& along, double half_m,
             double range_m, double wavelength_m, const GlintBeam& beam);

  /// Whether the beam must be in the integral: it is not wide against the Fresnel zone, and it
  /// changes over the line.
  bool counts() const;
  /// Whether what lies in the beam has a glint.
  bool reaches() const;
  /// From the line's middle, the place next to the foot within a share of the line, and within a
  /// share of the fan's truncation if the line reaches there.
  double place_m(double share_of_line, double share_of_fan) const;
  double half_m() const { return half_m_; }
  /// The beam's two-way field at a distance from the middle, where the range is r_m.
  std::complex<double> beam_at(double z_m, double r_m) const {
    return field_.at((begin_m_ + z_m * share_) / r_m);
  }
  /// The integral along the line, by the midpoint rule, of the beam, of across(distance from the
  /// middle, range there), and of the phase against that of a path of range_m. across_m: how far
  /// what is across lies aside, where its phase turns along the line.
  template <class Across>
  std::complex<double> integral(double range_m, double across_m, const Across& across) const {
    const int count = steps(across_m);
    const double step_m = (until_m_ - from_m_) / count;
    std::complex<double> sum = 0.0;
    for (int i = 0; i < count; ++i) {
      const double z_m = from_m_ + (i + 0.5) * step_m;
      const double r_m = std::hypot(distance_m_, z_m - foot_m_);
      sum += beam_at(z_m, r_m) * across(z_m, r_m) *
             std::polar(step_m, turn_rad_per_m_ * (r_m - range_m));
    }
    return sum;
  }

 private:
  struct Stretch {
    double from_m, until_m;
  };
  Stretch between(double low, double high) const;
  int steps(double across_m) const;

  ArrayField field_;
  double array_m_, sin_truncation_;
  double begin_m_, share_;  // along the array: from the sonar to the middle, and per metre of line
  double half_m_, range_m_, wavelength_m_, turn_rad_per_m_;
  double foot_m_, distance_m_;  // along the line to where it passes the sonar, and that distance
  double from_m_, until_m_;     // what is in the beam; less than nothing: none
};

/// A flat part in a sonar's beam, in axes along the array and across it.
class FlatPartInBeam {
 public:
  /// away: its middle, from the sonar. range_m: as of BeamOnLine.
  FlatPartInBeam(const FlatPart& flat_part, const Eigen::Vector3d& away, double range_m,
                 double wavelength_m, const GlintBeam& beam);
  bool counts() const { return line_.counts(); }  ///< as of BeamOnLine
  std::optional<Mirror> mirror() const;
  /// The beam's phase at a place of it, `offset` from its middle.
  double beam_rad(const Eigen::Vector3d& offset) const {
    return std::arg(line_.beam_at(offset.dot(level_), (away_ + offset).norm()));
  }

 private:
  struct Axis {  // one of its principal axes
    double level, up, half_m;
  };
  struct Chord {
    double middle_m, length_m;
  };
  Axis axis_of(const Eigen::Vector3f& direction, float length_m) const;
  double half_extent_m(double Axis::*way) const;
  Chord chord_at(double level_m) const;

  bool round_;
  Eigen::Vector3d away_, normal_, level_, up_;
  Axis one_, other_;
  BeamOnLine line_;  // through the foot of the line of sight
  double wavelength_m_;
};

/// The glint of a straight line in a beam, as that of glint_of_line().
std::optional<LineGlint> line_glint_in_beam(const BeamOnLine& line, const Eigen::Vector3d& middle,
                                            const Eigen::Vector3d& along, double width_m,
                                            double other_width_m);

}  // namespace ensonify::engine
