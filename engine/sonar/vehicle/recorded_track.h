#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// A vehicle's recorded navigation: one value per row in each column. Columns except time and place
/// may be empty.
struct NavigationLog {
  std::vector<double> t_s;  ///< ascending
  std::vector<double> x_m, y_m;
  std::vector<double> z_m;         ///< height above the sea surface
  std::vector<double> altitude_m;  ///< above the bed
  std::vector<double> roll_rad, pitch_rad;
  std::vector<double> heading_rad;        ///< if empty, the course is used
  std::optional<GeographicPlace> origin;  ///< where x_m = y_m = 0, if the places define it
  std::vector<std::string> warnings;      ///< warnings about the file of the log

  /// The number of rows that repeat the place of the row before.
  std::size_t repeated_places() const;
};

/// A column as a smooth function of time: cubics between the rows, straight lines beyond the ends.
/// The slope at a row is the slope of the parabola through the row and its neighbours, so constant
/// acceleration is reproduced exactly. Between two rows with the same value the function is
/// constant. Over a gap between rows the function is a straight line, because the slopes at the
/// ends of the gap come from much shorter steps.
class Spline {
 public:
  Spline() = default;  ///< always 0
  /// Times must ascend.
  Spline(std::vector<double> times_s, std::vector<double> values);
  double at(double t_s) const { return cubic(t_s).first; }
  double rate(double t_s) const { return cubic(t_s).second; }
  std::span<const double> times_s() const { return times_s_; }

 private:
  bool is_gap(std::size_t i) const;                   // whether a gap follows row i
  std::pair<double, double> cubic(double t_s) const;  // value and rate
  std::vector<double> times_s_, values_, rates_;
};

/// A recorded track as a function of time.
class RecordedTrack {
 public:
  /// With smooth_s > 0, places and heights are smoothed: at each row by the straight line that fits
  /// the rows around it in least squares, with Gaussian weights of the half width smooth_s
  /// (Cleveland, J. Am. Stat. Assoc. 74, 829, 1979, without the robust iterations). A row that
  /// repeats the place of a row less than smooth_s earlier is ignored, because there the vehicle
  /// did not stop: the navigation was slower than the recorder. Throws std::invalid_argument for
  /// columns of different lengths, times that do not ascend, or no rows.
  RecordedTrack(const NavigationLog& log, double smooth_s);

  double begin_s() const { return begin_s_; }
  double end_s() const { return end_s_; }
  bool has_height() const { return !z_.times_s().empty(); }
  /// Place, attitude and their rates; the height is 0 if it was not recorded.
  Pose at(double t_s) const;
  /// The altitude above the bed, if it was recorded.
  std::optional<double> altitude_m(double t_s) const;

 private:
  double begin_s_ = 0.0, end_s_ = 0.0;
  Spline x_, y_, z_, altitude_, roll_, pitch_, heading_;
};

}  // namespace ensonify::engine
