#pragma once

#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// A vehicle's recorded navigation: a value a row in each column; a column may be left out (empty)
/// but for time and place.
struct NavigationLog {
  std::vector<double> t_s;  ///< ascending
  std::vector<double> x_m, y_m;
  std::vector<double> z_m;         ///< height above the sea surface
  std::vector<double> altitude_m;  ///< over the bed
  std::vector<double> roll_rad, pitch_rad;
  std::vector<double> heading_rad;  ///< left out: the course

  /// Rows after the first whose place is that of the row before.
  std::size_t repeated_places() const;
};

/// A column as a smooth function of time: cubics between the rows, whose slopes there are those of
/// the parabola through the row and its neighbours, so that steady acceleration is kept exactly; a
/// straight line beyond the ends. Between rows with the same value it stands.
class Spline {
 public:
  Spline() = default;  ///< 0
  /// Times ascend.
  Spline(std::vector<double> times_s, std::vector<double> values);
  double at(double t_s) const { return cubic(t_s).first; }
  double rate(double t_s) const { return cubic(t_s).second; }
  std::span<const double> times_s() const { return times_s_; }

 private:
  std::pair<double, double> cubic(double t_s) const;  // value and rate
  std::vector<double> times_s_, values_, rates_;
};

/// A recorded track as a function of time.
class RecordedTrack {
 public:
  /// With smooth_s > 0 the place is a straight line fitted about each row by least squares with
  /// Gaussian weights of that half width (Cleveland, J. Am. Stat. Assoc. 74, 829, 1979, without its
  /// robustness), and so are heights. A row that repeats a place younger than smooth_s counts for
  /// nothing: navigation slower than the recorder stands still in the file, not in the water.
  /// Throws std::invalid_argument for columns that do not fit each other, times that do not ascend,
  /// or no rows.
  RecordedTrack(const NavigationLog& log, double smooth_s);

  double begin_s() const { return begin_s_; }
  double end_s() const { return end_s_; }
  bool has_height() const { return !z_.times_s().empty(); }
  /// Place, attitude and their rates; the height is 0 where it was not recorded.
  Pose at(double t_s) const;
  /// Over the bed, where it was recorded.
  std::optional<double> altitude_m(double t_s) const;

 private:
  double begin_s_ = 0.0, end_s_ = 0.0;
  Spline x_, y_, z_, altitude_, roll_, pitch_, heading_;
};

}  // namespace ensonify::engine
