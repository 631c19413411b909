#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/glint.h>

namespace ensonify::engine {

/// A stretch of a line, in metres from the line's middle.
struct LineStretch {
  double from_m, until_m;
};

/// Cells of a line, and the parts of them that rays may show.
struct LineCells {
  static constexpr std::size_t most = 12;
  std::size_t count;
  std::array<double, most + 1> edge_m;  ///< where the cells begin, and the end
  std::array<double, most> middle_m;    ///< middles of the parts that rays may show
};

/// A straight line of a surface, and the integral over the part of it that lies in the sonar's
/// beam.
class BeamOnLine {
 public:
  /// middle: of the line, from the sonar. range_m: range of its place that is nearest to the foot
  /// of the line of sight.
  BeamOnLine(const Eigen::Vector3d& middle, const Eigen::Vector3d& along, double half_m,
             double range_m, double wavelength_m, const GlintBeam& beam);

  /// Whether the beam must be part of the integral: it is not wide compared with the Fresnel zone,
  /// and it changes over the line.
  bool counts() const;
  /// Whether the part in the beam has a glint.
  bool reaches() const;
  /// The place nearest to the foot, from the line's middle: within a share of the line, and within
  /// a share of the fan's truncation if the line reaches there.
  double place_m(double share_of_line, double share_of_fan) const;
  double half_m() const { return half_m_; }
  LineStretch in_beam() const { return in_beam_; }  ///< empty if it ends before it begins
  /// The part of the line in the beam, cut into cells that are finest where the glint is; none if
  /// the line is not in the fan. The nearer the edge of a shadow is to the foot of the line of
  /// sight, the more it changes the glint.
  std::optional<LineCells> cells(std::size_t count) const;
  /// The part of the line, extended beyond its ends, that is within a share of the fan's
  /// truncation.
  LineStretch in_fan(double share_of_fan) const;
  /// The beam's two-way field at a distance from the middle, where the range is r_m.
  std::complex<double> beam_at(double z_m, double r_m) const {
    return field_.at((begin_m_ + z_m * share_) / r_m);
  }
  /// The integral over a stretch of the line, by the midpoint rule, of the product of the beam, of
  /// across(distance from the middle, range there), and of the phase relative to a path of range_m.
  /// across_m: how far the parts across lie aside, if their phase turns along the line.
  template <class Across>
  std::complex<double> integral(const LineStretch& stretch, double range_m, double across_m,
                                const Across& across) const {
    const int count = steps(stretch, across_m);
    const double step_m = (stretch.until_m - stretch.from_m) / count;
    std::complex<double> sum = 0.0;
    for (int i = 0; i < count; ++i) {
      const double z_m = stretch.from_m + (i + 0.5) * step_m;
      const double r_m = std::hypot(distance_m_, z_m - foot_m_);
      sum += beam_at(z_m, r_m) * across(z_m, r_m) *
             std::polar(step_m, turn_rad_per_m_ * (r_m - range_m));
    }
    return sum;
  }

 private:
  LineStretch between(double low, double high) const;
  int steps(const LineStretch& stretch, double across_m) const;

  ArrayField field_;
  double array_m_, sin_truncation_;
  // Distance along the array of the line's middle, and its growth per metre of the line.
  double begin_m_, share_;
  double half_m_, range_m_, wavelength_m_, turn_rad_per_m_;
  // Along the line to the foot of the line of sight, and from the sonar to this foot.
  double foot_m_, distance_m_;
  LineStretch in_beam_;
};

/// The part of a flat part that lies in a beam, cut into cells along the array (columns) and across
/// it (rows), and how much of each cell is seen. A line has one row.
struct SeenCells {
  LineCells level, up;  ///< the columns, and the rows
  /// Share of the sound, by column and row.
  std::array<std::array<double, LineCells::most>, LineCells::most> seen{};
  double least = 0.0, most = 0.0;
};

/// A flat part in a sonar's beam, in axes along the array and across it.
class FlatPartInBeam {
 public:
  /// away: its middle, from the sonar. range_m: as for BeamOnLine.
  FlatPartInBeam(const FlatPart& flat_part, const Eigen::Vector3d& away, double range_m,
                 double wavelength_m, const GlintBeam& beam);
  bool counts() const { return line_.counts(); }  ///< BeamOnLine::counts()
  /// The glint of what is seen of these cells; null: of the whole flat part.
  std::optional<Mirror> mirror(const SeenCells* cells = nullptr) const;
  /// Its cells, as if nothing of them was seen; none if it is not in the fan.
  std::optional<SeenCells> cells(std::size_t count) const;
  /// The middle of a cell, from the middle of the flat part.
  Eigen::Vector3d middle_of(const SeenCells& cells, std::size_t column, std::size_t row) const {
    return cells.level.middle_m[column] * level_ + cells.up.middle_m[row] * up_;
  }
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

/// The glint of a straight line in a beam, as in glint_of_line(). seen: null if the whole line is
/// seen.
std::optional<LineGlint> line_glint_in_beam(const BeamOnLine& line, const Eigen::Vector3d& middle,
                                            const Eigen::Vector3d& along, double width_m,
                                            double other_width_m, const SeenCells* seen = nullptr);

}  // namespace ensonify::engine
