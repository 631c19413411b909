#include <ensonify/engine/sonar/vehicle/recorded_track.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace ensonify::engine {
namespace {

constexpr double full_turn_rad = 2.0 * std::numbers::pi;
constexpr double slowest_course_mps = 0.01;  // below this, the course is only rounding error

/// Angles without jumps: each differs from the angle before by at most half a turn.
std::vector<double> unwrapped(std::vector<double> angles_rad) {
  for (std::size_t i = 1; i < angles_rad.size(); ++i)
    angles_rad[i] =
        angles_rad[i - 1] + std::remainder(angles_rad[i] - angles_rad[i - 1], full_turn_rad);
  return angles_rad;
}

/// The rows that smoothed() fits lines to.
struct FittedRows {
  std::vector<double> times_s, values;
  std::vector<double> counts;  ///< how many rows of the log each of these rows stands for
};

/// All rows; or, if they are dense, the mean of the rows within each 64th of the half width.
/// Otherwise the time of smoothed() would grow with the square of the rows' rate. Rows on a
/// straight line have their mean on this line.
FittedRows fitted_rows(const std::vector<double>& times_s, const std::vector<double>& values,
                       double half_width_s) {
  constexpr double groups_per_half_width = 64.0, dense_rows_per_group = 2.0;
  FittedRows means;
  double group = -1.0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double its_group =
        std::floor((times_s[i] - times_s[0]) / half_width_s * groups_per_half_width);
    if (its_group != group) {
      group = its_group;
      means.times_s.push_back(0.0);
      means.values.push_back(0.0);
      means.counts.push_back(0.0);
    }
    const double count = ++means.counts.back();
    means.times_s.back() += (times_s[i] - means.times_s.back()) / count;
    means.values.back() += (values[i] - means.values.back()) / count;
  }
  if (dense_rows_per_group * static_cast<double>(means.counts.size()) <
      static_cast<double>(times_s.size()))
    return means;
  return {times_s, values, std::vector<double>(times_s.size(), 1.0)};
}

/// At each time, the value of the straight line that is fitted to the values around this time.
std::vector<double> smoothed(const std::vector<double>& times_s, const std::vector<double>& values,
                             double half_width_s) {
  if (half_width_s == 0.0) return values;
  const FittedRows rows = fitted_rows(times_s, values, half_width_s);
  std::vector<double> out(values.size());
  std::size_t first = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (rows.times_s[first] < times_s[i] - 4.0 * half_width_s) ++first;
    double w = 0.0, wt = 0.0, wtt = 0.0, wv = 0.0, wtv = 0.0;
    for (std::size_t k = first; k < rows.values.size(); ++k) {
      const double t = (rows.times_s[k] - times_s[i]) / half_width_s;
      if (t > 4.0) break;
      const double weight = rows.counts[k] * std::exp(-0.5 * t * t);
      const double v = rows.values[k] - values[i];
      w += weight;
      wt += weight * t;
      wtt += weight * t * t;
      wv += weight * v;
      wtv += weight * t * v;
    }
    const double determinant = w * wtt - wt * wt;
    out[i] =
        values[i] + (determinant > 1e-9 * w * w ? (wtt * wv - wt * wtv) / determinant : wv / w);
  }
  return out;
}

/// The numbers of the rows whose places are used.
std::vector<std::size_t> fixes(const NavigationLog& log, double smooth_s) {
  std::vector<std::size_t> rows = {0};
  for (std::size_t i = 1; i < log.t_s.size(); ++i) {
    const std::size_t last = rows.back();
    const bool repeats = log.x_m[i] == log.x_m[last] && log.y_m[i] == log.y_m[last];
    if (!repeats || log.t_s[i] - log.t_s[last] >= smooth_s) rows.push_back(i);
  }
  return rows;
}

std::vector<double> picked(const std::vector<double>& values, std::span<const std::size_t> rows) {
  std::vector<double> out;
  for (const std::size_t row : rows) out.push_back(values[row]);
  return out;
}

/// The course at each time of the splines. While the vehicle stands still, this is the last course
/// before, or the first course after if there is none before.
std::vector<double> courses_rad(const Spline& x, const Spline& y) {
  std::vector<double> courses;
  std::size_t unknown = 0;  // courses at the beginning that are not known yet
  for (const double t_s : x.times_s()) {
    const double east_mps = x.rate(t_s), north_mps = y.rate(t_s);
    if (std::hypot(east_mps, north_mps) >= slowest_course_mps) {
      courses.push_back(std::atan2(east_mps, north_mps));
    } else {
      unknown += unknown == courses.size();
      courses.push_back(courses.empty() ? 0.0 : courses.back());
    }
  }
  if (unknown < courses.size()) std::fill_n(courses.begin(), unknown, courses[unknown]);
  return courses;
}

}  // namespace

std::size_t NavigationLog::repeated_places() const {
  std::size_t count = 0;
  for (std::size_t i = 1; i < t_s.size(); ++i)
    count += x_m[i] == x_m[i - 1] && y_m[i] == y_m[i - 1];
  return count;
}

Spline::Spline(std::vector<double> times_s, std::vector<double> values)
    : times_s_(std::move(times_s)), values_(std::move(values)) {
  const std::size_t n = times_s_.size();
  rates_.assign(n, 0.0);
  if (n < 2) return;
  const auto step = [&](std::size_t i) { return times_s_[i + 1] - times_s_[i]; };
  const auto secant = [&](std::size_t i) { return (values_[i + 1] - values_[i]) / step(i); };
  rates_.front() = rates_.back() = secant(0);
  if (n == 2) return;
  const auto stands = [&](std::size_t i) { return secant(i) == 0.0 && !is_gap(i); };
  // At an end of the track, a parabola over a gap would turn back.
  const auto end_rate = [&](std::size_t i, double inner_rate) {
    if (is_gap(i)) return secant(i);
    return stands(i) ? 0.0 : 2.0 * secant(i) - inner_rate;
  };
  for (std::size_t i = 1; i + 1 < n; ++i)
    if (!stands(i - 1) && !stands(i))
      rates_[i] = (step(i) * secant(i - 1) + step(i - 1) * secant(i)) / (step(i - 1) + step(i));
  rates_.front() = end_rate(0, rates_[1]);
  rates_.back() = end_rate(n - 2, rates_[n - 2]);
}

bool Spline::is_gap(std::size_t i) const {
  constexpr double times_longer = 10.0;
  const auto step = [&](std::size_t k) { return times_s_[k + 1] - times_s_[k]; };
  return (i > 0 && step(i) > times_longer * step(i - 1)) ||
         (i + 2 < times_s_.size() && step(i) > times_longer * step(i + 1));
}

std::pair<double, double> Spline::cubic(double t_s) const {
  if (times_s_.empty()) return {0.0, 0.0};
  const auto line = [&](std::size_t i) {
    return std::pair{values_[i] + rates_[i] * (t_s - times_s_[i]), rates_[i]};
  };
  if (t_s <= times_s_.front()) return line(0);
  if (t_s >= times_s_.back()) return line(times_s_.size() - 1);
  const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), t_s);
  const auto i = static_cast<std::size_t>(after - times_s_.begin()) - 1;
  // Hermite's cubic has the values and slopes of both rows.
  const double h = times_s_[i + 1] - times_s_[i], u = t_s - times_s_[i];
  if (u == 0.0) return line(i);
  const double secant = (values_[i + 1] - values_[i]) / h;
  if (is_gap(i)) return {values_[i] + u * secant, secant};
  const double c2 = (3.0 * secant - 2.0 * rates_[i] - rates_[i + 1]) / h;
  const double c3 = (rates_[i] + rates_[i + 1] - 2.0 * secant) / (h * h);
  return {values_[i] + u * (rates_[i] + u * (c2 + u * c3)),
          rates_[i] + u * (2.0 * c2 + 3.0 * u * c3)};
}

RecordedTrack::RecordedTrack(const NavigationLog& log, double smooth_s) {
  const std::size_t rows = log.t_s.size();
  if (rows == 0) throw std::invalid_argument("RecordedTrack: no rows");
  for (const auto* needed : {&log.x_m, &log.y_m})
    if (needed->size() != rows) throw std::invalid_argument("RecordedTrack: places are missing");
  for (const auto* column :
       {&log.z_m, &log.altitude_m, &log.roll_rad, &log.pitch_rad, &log.heading_rad})
    if (!column->empty() && column->size() != rows)
      throw std::invalid_argument("RecordedTrack: a column is not as long as the others");
  for (std::size_t i = 1; i < rows; ++i)
    if (!(log.t_s[i] > log.t_s[i - 1]))
      throw std::invalid_argument("RecordedTrack: times do not ascend");
  begin_s_ = log.t_s.front();
  end_s_ = log.t_s.back();

  const std::vector<std::size_t> kept = fixes(log, smooth_s);
  const std::vector<double> kept_s = picked(log.t_s, kept);
  x_ = Spline(kept_s, smoothed(kept_s, picked(log.x_m, kept), smooth_s));
  y_ = Spline(kept_s, smoothed(kept_s, picked(log.y_m, kept), smooth_s));
  const auto column = [&](const std::vector<double>& values) {
    return values.empty() ? Spline() : Spline(log.t_s, values);
  };
  z_ = column(log.z_m.empty() ? log.z_m : smoothed(log.t_s, log.z_m, smooth_s));
  altitude_ =
      column(log.altitude_m.empty() ? log.altitude_m : smoothed(log.t_s, log.altitude_m, smooth_s));
  roll_ = column(unwrapped(log.roll_rad));
  pitch_ = column(unwrapped(log.pitch_rad));
  heading_ = log.heading_rad.empty() ? Spline(kept_s, unwrapped(courses_rad(x_, y_)))
                                     : column(unwrapped(log.heading_rad));
}

Pose RecordedTrack::at(double t_s) const {
  const double heading_rad = heading_.at(t_s);
  return {.t_s = t_s,
          .position = {x_.at(t_s), y_.at(t_s), z_.at(t_s)},
          .roll_rad = roll_.at(t_s),
          .pitch_rad = pitch_.at(t_s),
          .heading_rad = heading_rad - full_turn_rad * std::floor(heading_rad / full_turn_rad),
          .velocity_mps = {x_.rate(t_s), y_.rate(t_s), z_.rate(t_s)},
          .roll_rate_radps = roll_.rate(t_s),
          .pitch_rate_radps = pitch_.rate(t_s),
          .heading_rate_radps = heading_.rate(t_s)};
}

std::optional<double> RecordedTrack::altitude_m(double t_s) const {
  if (altitude_.times_s().empty()) return std::nullopt;
  return altitude_.at(t_s);
}

}  // namespace ensonify::engine
