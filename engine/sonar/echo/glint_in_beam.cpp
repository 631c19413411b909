#include <ensonify/engine/sonar/echo/glint_in_beam.h>

#include <algorithm>
#include <numbers>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

// Shares of the fan's truncation that rays reach, and that rays of all planes reach.
constexpr double almost_all = 0.98, well_inside = 0.7;

/// Half a Fresnel zone.
double finest_cell_m(double wavelength_m, double range_m) {
  return 0.5 * std::sqrt(wavelength_m * range_m);
}

/// Cuts a stretch, of which rays show `shown`, into cells that are about finest_m long at a place
/// and grow with the distance from it.
LineCells cut(const LineStretch& stretch, const LineStretch& shown, double about_m, double finest_m,
              std::size_t count) {
  const double first = std::asinh((shown.from_m - about_m) / finest_m),
               last = std::asinh((shown.until_m - about_m) / finest_m);
  LineCells cells{.count = count};
  for (std::size_t i = 0; i <= count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count);
    cells.edge_m[i] = about_m + finest_m * std::sinh(first + share * (last - first));
    if (i > 0) cells.middle_m[i - 1] = 0.5 * (cells.edge_m[i - 1] + cells.edge_m[i]);
  }
  cells.edge_m[0] = stretch.from_m;
  cells.edge_m[count] = stretch.until_m;
  return cells;
}

}  // namespace

BeamOnLine::BeamOnLine(const Eigen::Vector3d& middle, const Eigen::Vector3d& along, double half_m,
                       double range_m, double wavelength_m, const GlintBeam& beam)
    : field_(beam.beam.field_near(middle.normalized(), range_m, beam.motion)),
      array_m_(beam.array_m),
      sin_truncation_(beam.sin_truncation),
      begin_m_(middle.dot(beam.array_axis)),
      share_(along.dot(beam.array_axis)),
      half_m_(half_m),
      range_m_(range_m),
      wavelength_m_(wavelength_m),
      turn_rad_per_m_(4.0 * pi / wavelength_m),
      foot_m_(-middle.dot(along)),
      distance_m_((middle + foot_m_ * along).norm()) {
  const LineStretch in_beam = between(field_.low, field_.high);
  in_beam_ = {std::max(in_beam.from_m, -half_m), std::min(in_beam.until_m, half_m)};
}

LineStretch BeamOnLine::between(double low, double high) const {
  const double one_m = (range_m_ * low - begin_m_) / share_;
  const double other_m = (range_m_ * high - begin_m_) / share_;
  return {std::min(one_m, other_m), std::max(one_m, other_m)};
}

bool BeamOnLine::counts() const {
  constexpr double wide = 320.0, no_change = 0.01;
  const double width_m = (field_.high - field_.low) * range_m_;
  return width_m * width_m < wide * wavelength_m_ * range_m_ &&
         std::abs(share_) * half_m_ > no_change * width_m;
}

bool BeamOnLine::reaches() const {
  const double length_m = in_beam_.until_m - in_beam_.from_m,
               middle_m = 0.5 * (in_beam_.from_m + in_beam_.until_m);
  return length_m > 0.0 &&
         MirrorExtent{length_m, (foot_m_ - middle_m) / range_m_, range_m_}.reaches(wavelength_m_,
                                                                                   array_m_);
}

LineStretch BeamOnLine::in_fan(double share_of_fan) const {
  const double sine = share_of_fan * sin_truncation_;
  return between(std::max(field_.low, -sine), std::min(field_.high, sine));
}

double BeamOnLine::place_m(double share_of_line, double share_of_fan) const {
  const LineStretch fan = in_fan(share_of_fan);
  return std::clamp(std::max(fan.from_m, std::min(foot_m_, fan.until_m)), -share_of_line * half_m_,
                    share_of_line * half_m_);
}

std::optional<LineCells> BeamOnLine::cells(std::size_t count) const {
  const LineStretch fan = in_fan(almost_all);
  const LineStretch shown{std::max(fan.from_m, -half_m_), std::min(fan.until_m, half_m_)};
  if (!(shown.from_m < shown.until_m)) return std::nullopt;
  const double place = place_m(1.0, almost_all);
  return cut(in_beam_, shown, place,
             finest_cell_m(wavelength_m_, std::hypot(distance_m_, place - foot_m_)), count);
}

/// The number of steps that resolves the phase and the beam.
int BeamOnLine::steps(const LineStretch& stretch, double across_m) const {
  constexpr double least = 16.0, per_lobe = 8.0;
  const double length_m = stretch.until_m - stretch.from_m;
  const double farthest_m =
      std::max(std::abs(stretch.from_m - foot_m_), std::abs(stretch.until_m - foot_m_));
  const double turns_rad = turn_rad_per_m_ * (farthest_m + across_m) / range_m_ * length_m;
  const double lobes = std::abs(share_) * length_m * array_m_ / (wavelength_m_ * range_m_);
  return static_cast<int>(least + turns_rad + per_lobe * lobes);
}

FlatPartInBeam::FlatPartInBeam(const FlatPart& flat_part, const Eigen::Vector3d& away,
                               double range_m, double wavelength_m, const GlintBeam& beam)
    : round_(flat_part.round),
      away_(away),
      normal_(flat_part.normal.cast<double>()),
      level_((beam.array_axis - beam.array_axis.dot(normal_) * normal_).normalized()),
      up_(normal_.cross(level_)),
      one_(axis_of(flat_part.along, flat_part.length_m)),
      other_(axis_of(flat_part.across, flat_part.width_m)),
      line_(away - away.dot(up_) * up_, level_, half_extent_m(&Axis::level), range_m, wavelength_m,
            beam),
      wavelength_m_(wavelength_m) {}

FlatPartInBeam::Axis FlatPartInBeam::axis_of(const Eigen::Vector3f& direction,
                                             float length_m) const {
  const Eigen::Vector3d way = direction.cast<double>();
  const double share = round_ ? std::numbers::inv_sqrtpi : 0.5;
  return {way.dot(level_), way.dot(up_), share * double(length_m)};
}

double FlatPartInBeam::half_extent_m(double Axis::*way) const {
  const double one_m = std::abs(one_.*way * one_.half_m),
               other_m = std::abs(other_.*way * other_.half_m);
  return round_ ? std::hypot(one_m, other_m) : one_m + other_m;
}

/// The chord across the array, at a distance along the array from the middle.
FlatPartInBeam::Chord FlatPartInBeam::chord_at(double level_m) const {
  if (round_) {  // where a z^2 + 2 b z + c = 0
    double a = 0.0, b = 0.0, c = -1.0;
    for (const Axis& axis : {one_, other_}) {
      const double up = axis.up / axis.half_m, on = level_m * axis.level / axis.half_m;
      a += up * up, b += up * on, c += on * on;
    }
    return {-b / a, 2.0 * std::sqrt(std::max(b * b - a * c, 0.0)) / a};
  }
  const double half_up_m = half_extent_m(&Axis::up);
  double from_m = -half_up_m, until_m = half_up_m;
  for (const Axis& axis : {one_, other_}) {
    if (std::abs(axis.up) < 1e-9) continue;
    const double middle_m = -level_m * axis.level / axis.up;
    const double half_m = std::abs(axis.half_m / axis.up);
    from_m = std::max(from_m, middle_m - half_m);
    until_m = std::min(until_m, middle_m + half_m);
  }
  return {0.5 * (from_m + until_m), std::max(until_m - from_m, 0.0)};
}

std::optional<SeenCells> FlatPartInBeam::cells(std::size_t count) const {
  const std::optional<LineCells> level = line_.cells(count);
  if (!level) return std::nullopt;
  const double half_up_m = half_extent_m(&Axis::up);
  const double level_m = line_.place_m(1.0, almost_all),
               up_m = std::clamp(-away_.dot(up_), -half_up_m, half_up_m);
  const double finest_m = finest_cell_m(wavelength_m_, (away_ + level_m * level_).norm());
  const LineStretch across{-half_up_m, half_up_m};
  return SeenCells{.level = *level, .up = cut(across, across, up_m, finest_m, count)};
}

std::optional<Mirror> FlatPartInBeam::mirror(const SeenCells* cells) const {
  const double up_foot_m = -away_.dot(up_), half_up_m = half_extent_m(&Axis::up);
  const auto next_to_foot = [&](double share_of_part, double share_of_fan) -> Eigen::Vector3d {
    const double level_m = line_.place_m(share_of_part, share_of_fan);
    const Chord chord = chord_at(level_m);
    const double half_m = 0.5 * share_of_part * chord.length_m;
    return level_m * level_ +
           std::clamp(up_foot_m, chord.middle_m - half_m, chord.middle_m + half_m) * up_;
  };
  const Eigen::Vector3d offset = next_to_foot(1.0, almost_all);
  const double range_m = (away_ + offset).norm();
  if (!line_.reaches() ||
      !MirrorExtent{2.0 * half_up_m, up_foot_m / range_m, range_m}.reaches(wavelength_m_))
    return std::nullopt;
  // If chords end at slanting sides, their phase turns along the array as well.
  const double slant = round_ ? 1.0 : 2.0 * std::min(std::abs(one_.level), std::abs(one_.up));
  const double across_m = slant * (half_up_m + std::abs(up_foot_m));
  const auto field_m = [&](double middle_m, double length_m, double r_m) {
    return MirrorExtent{length_m, (up_foot_m - middle_m) / r_m, r_m}.field_m(wavelength_m_);
  };
  std::complex<double> field_m2 = 0.0;
  if (!cells)
    field_m2 = line_.integral(line_.in_beam(), range_m, across_m, [&](double level_m, double r_m) {
      const Chord chord = chord_at(level_m);
      return field_m(chord.middle_m, chord.length_m, r_m);
    });
  for (std::size_t column = 0; cells && column < cells->level.count; ++column) {
    const auto of_rows = [&](double level_m, double r_m) {
      const Chord chord = chord_at(level_m);
      std::complex<double> sum = 0.0;
      for (std::size_t row = 0; row < cells->up.count; ++row) {
        const double from_m =
            std::max(chord.middle_m - 0.5 * chord.length_m, cells->up.edge_m[row]);
        const double until_m =
            std::min(chord.middle_m + 0.5 * chord.length_m, cells->up.edge_m[row + 1]);
        if (cells->seen[column][row] > 0.0 && from_m < until_m)
          sum +=
              cells->seen[column][row] * field_m(0.5 * (from_m + until_m), until_m - from_m, r_m);
      }
      return sum;
    };
    field_m2 += line_.integral({cells->level.edge_m[column], cells->level.edge_m[column + 1]},
                               range_m, across_m, of_rows);
  }
  return Mirror{.offset = offset,
                .inside = next_to_foot(round_ ? 0.6 : 0.8, well_inside),
                .cross_section_m2 = std::norm(field_m2) / (wavelength_m_ * wavelength_m_),
                .phase_rad = std::arg(field_m2),
                .in_beam = true};
}

std::optional<LineGlint> line_glint_in_beam(const BeamOnLine& line, const Eigen::Vector3d& middle,
                                            const Eigen::Vector3d& along, double width_m,
                                            double other_width_m, const SeenCells* seen) {
  if (!line.reaches()) return std::nullopt;
  const double place_m = line.place_m(1.0, almost_all);
  const double range_m = (middle + place_m * along).norm();
  const auto width_at = [&](double z_m, double) {
    const double share = 0.5 * (z_m / line.half_m() + 1.0);
    return std::sqrt(width_m + share * (other_width_m - width_m));
  };
  std::complex<double> field = 0.0;
  if (!seen) field = line.integral(line.in_beam(), range_m, 0.0, width_at);
  for (std::size_t i = 0; seen && i < seen->level.count; ++i)
    if (const double share = seen->seen[i][0]; share > 0.0)
      field += share * line.integral({seen->level.edge_m[i], seen->level.edge_m[i + 1]}, range_m,
                                     0.0, width_at);
  return LineGlint{place_m, range_m, std::norm(field), true};
}

}  // namespace ensonify::engine
