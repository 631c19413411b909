#include <ensonify/engine/sonar/reception/other_paths.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include <ensonify/scatter/ambient_noise.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/forward_lobe.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr std::size_t sine_steps = 1024;    // of the tables over the sine of the grazing angle
constexpr std::size_t directions = 1440;    // per turn, at which VerticalSum takes the pattern
constexpr double other_bed_loss_db = 10.0;  // for a bed that is not a sediment; not measured
constexpr int max_pings_back = 8;           // whose echoes are added
constexpr int directions_of_volume = 4;     // to the side, of a sonar that turns
constexpr double inaudible = 1e-3;          // over the noise

/// The next bin at which a smooth function of range is evaluated; between such bins it is
/// interpolated linearly. The function has a kink at bin `first`: steps are one bin there and grow
/// with the distance from it, up to 1/64 of the range.
std::size_t next_step(std::size_t n, std::size_t first) {
  return n + std::max<std::size_t>(1, std::min((n - first) / 16, n / 64));
}

/// Calls add(n, value) for the bins [begin, end). Evaluates f only at the bins of next_step(), and
/// interpolates between them.
template <class F, class Add>
void over_bins(std::size_t begin, std::size_t end, F&& f, Add&& add) {
  if (begin >= end) return;
  double here = f(begin);
  for (std::size_t n = begin; n < end;) {
    const std::size_t to = std::min(next_step(n, begin), end);
    const double next = f(std::min(to, end - 1));
    const double slope = (next - here) / static_cast<double>(to - n);
    for (std::size_t i = n; i < to; ++i) add(i, here + static_cast<double>(i - n) * slope);
    here = next;
    n = to;
  }
}

/// A table over the sine of the grazing angle, of sine_steps + 1 values.
double at_sine(std::span<const double> table, double sine) {
  const double place = sine * static_cast<double>(sine_steps);
  const std::size_t step = std::min(static_cast<std::size_t>(place), sine_steps - 1);
  return std::lerp(table[step], table[step + 1], place - static_cast<double>(step));
}

}  // namespace

// In the plane abeam, `level` is the horizontal direction to starboard and `up` is upwards. A
// positive roll turns the sonar's downward axis to port.
BeamPlane::BeamPlane(const PingContext& context, Side side)
    : cos_pitch(std::sqrt(std::max(1.0 - context.array.axis.z() * context.array.axis.z(), 0.0))),
      sin_pitch(context.array.axis.z()) {
  if (cos_pitch < 1e-6) return;
  const ArrayFrame& array = context.array;
  const double to_side = side == Side::starboard ? 1.0 : -1.0;
  const Eigen::Vector3d level = array.axis.cross(Eigen::Vector3d::UnitZ()) / cos_pitch;
  const Eigen::Vector3d up = level.cross(array.axis);
  cos_roll_tilt = -array.down.dot(up);
  sin_roll_tilt = -to_side * array.down.dot(level);
  const ReceiverMotion& motion = context.motion[static_cast<std::size_t>(side)];
  roll_tilt_per_m = motion.abeam_turn.dot(array.down);
  turn_level_per_m = to_side * motion.array_turn.dot(level);
  turn_down_per_m = -motion.array_turn.dot(up);
  drift_along = motion.drift_along;
}

SonarEquation::SonarEquation(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
                             const Scatterers& scatterers)
    : bin_m_(sonar.bin_m()),
      cell_m_(sonar.pulse.cell_m(sound_speed_mps)),
      lead_m_(0.5 * sound_speed_mps * sonar.pulse.middle_s()),
      wavelength_m_(sound_speed_mps / sonar.frequency_hz),
      frequency_hz_(sonar.frequency_hz),
      source_level_db_(sonar.source_level_db),
      absorption_db_per_m_(absorption_db_per_m),
      vertical_{VerticalTable(sonar.vertical, Side::port),
                VerticalTable(sonar.vertical, Side::starboard)},
      moved_beam_(sonar, wavelength_m_),
      scatterers_(&scatterers) {
  for (std::size_t bin = 0; bin < static_cast<std::size_t>(sonar.bins); ++bin)
    per_m2_.push_back(on_axis(range_m(bin)));
}

double SonarEquation::on_axis(double range_m) const {
  const double squared = range_m * range_m;
  return scatter::from_db(source_level_db_ - 2.0 * absorption_db_per_m_ * range_m) /
         (squared * squared);
}

double SonarEquation::per_m2_at(double range_m) const {
  if (range_m >= this->range_m(bins() - 1)) return on_axis(range_m);
  const double place = std::max(range_m / bin_m_ - 0.5, 0.0);
  const auto bin = static_cast<std::size_t>(place);
  const double share = place - static_cast<double>(bin);
  return per_m2_[bin] + share * (per_m2_[bin + 1] - per_m2_[bin]);
}

double SonarEquation::width_m_at(double range_m) const {
  if (range_m >= this->range_m(bins() - 1)) return scatterers_->width_m_at(range_m);
  return width_m(static_cast<std::size_t>(range_m / bin_m_));
}

double SonarEquation::level_bed(Side side, const BeamPlane& plane, double range_m, double sine,
                                double before_m) const {
  const double down = std::min(sine, 0.9), level = std::sqrt(1.0 - down * down);
  return per_m2_at(range_m) * width_m_at(range_m) * cell_m_ / level *
         two_way(side, plane, range_m, level * range_m, down * range_m, before_m);
}

double SonarEquation::vertical_width_rad(Side side, int power) const {
  constexpr int steps = 3600;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double depression = 2.0 * pi * (i + 0.5) / steps;
    sum += std::pow(vertical(side, std::cos(depression), std::sin(depression)), power);
  }
  return sum * 2.0 * pi / steps;
}

double farthest_earlier_m(const Sonar& sonar, double ping_m) {
  return sonar.range_m + max_pings_back * ping_m;
}

double sea_noise_power(const Sonar& sonar, const SonarEquation& law, const SeaState& sea,
                       Side side) {
  // The array receives isotropic noise in a beam that is lambda / L wide at all depressions, wider
  // by its shading.
  const LineArray array = sonar.receive_array(law.wavelength_m());
  const double width = array.wavelength_m / array.length_m * array.shading.noise_width_x();
  const double solid_angle_sr = std::min(width, 2.0) * law.vertical_width_rad(side, 1);
  const double ambient =
      scatter::from_db(scatter::ambient_noise_db(sonar.frequency_hz, sea.wind_mps, sea.shipping)) *
      solid_angle_sr / (4.0 * pi);
  return sonar.pulse.noise_bandwidth_hz() * ambient;
}

VerticalSum::VerticalSum(const SonarEquation& law, Side side) : sums_{0.0} {
  constexpr double step = 2.0 * pi / directions;
  for (std::size_t i = 0; i < directions; ++i) {
    const double depression = (static_cast<double>(i) + 0.5) * step;
    const double pattern = law.vertical(side, std::cos(depression), std::sin(depression));
    sums_.push_back(sums_.back() + step * pattern * pattern);
  }
}

double VerticalSum::up_to(double depression_rad) const {
  const double turns = depression_rad / (2.0 * pi), whole = std::floor(turns);
  const double place = (turns - whole) * directions;
  const std::size_t below = std::min(static_cast<std::size_t>(place), directions - 1);
  const double share = place - static_cast<double>(below);
  return whole * sums_.back() + sums_[below] + share * (sums_[below + 1] - sums_[below]);
}

OtherPaths::OtherPaths(const OtherPathsOptions& options, const Sonar& sonar, const SeaState& sea,
                       const SonarEquation& law, const Bed& bed, double ping_m)
    : options_(options),
      law_(law),
      bed_strength_(bed.strength),
      sediment_(bed.sediment),
      k_per_cm_(sediment_ ? scatter::relief_wavenumber_per_cm(*sediment_, law.frequency_hz(),
                                                              law.sound_speed_mps())
                          : 0.0),
      ping_m_(ping_m),
      surface_{.wind_mps = sea.wind_mps, .frequency_hz = law.frequency_hz()},
      vertical_sums_{VerticalSum(law, Side::port), VerticalSum(law, Side::starboard)} {
  // A leg is shorter than both together, which are twice the echo's range.
  if (options.multiples || options.double_bounce)
    beams_.emplace(sonar, law.wavelength_m(), 2.0 * sonar.range_m);
  for (std::size_t i = 0; options.surface && i <= sine_steps; ++i)
    surface_strength_.push_back(scatter::surface_cross_section(
        surface_, std::asin(std::max(0.5, static_cast<double>(i)) / sine_steps)));
  for (std::size_t i = 0; options.multiples && i <= sine_steps; ++i) {
    const double loss_db = options.bottom_loss_db ? *options.bottom_loss_db
                           : bed.sediment
                               ? scatter::reflection_loss_db(
                                     *bed.sediment, std::asin(static_cast<double>(i) / sine_steps))
                               : other_bed_loss_db;
    bed_reflection_.push_back(scatter::from_db(-loss_db));
  }
  const double strength = scatter::from_db(sea.volume_scattering_db);
  for (std::size_t bin = 0; options.volume && bin < law.bins(); ++bin)
    volume_.push_back(strength * law.per_m2_at(law.cell_middle_m(bin)) *
                      law.width_m_at(law.cell_middle_m(bin)) * law.cell_middle_m(bin) *
                      law.cell_m());
}

void OtherPaths::add(const PingContext& context, const EchoLine& line,
                     std::span<const float> direct, std::span<float> power,
                     std::vector<double>& sums) const {
  // In ranges by travel time: volume and multiples are computed in water of one sound speed.
  const double depth_m = context.range_per_m_up * context.depth_m(),
               altitude_m = context.range_per_m_down * context.altitude_m;
  const BeamPlane plane(context, line.side);
  if (options_.second_time_around) add_earlier_pings(context, line.side, plane, power);
  if (options_.surface) add_surface(context, line.side, plane, power);
  if (options_.volume) add_volume(context, depth_m, altitude_m, line.side, plane, power);
  if (options_.multiples) add_multiples(depth_m, altitude_m, line.side, plane, direct, power, sums);
  if (options_.double_bounce) add_double_bounce(context, line, plane, direct, power);
}

// The ping before adds at r the echo from r + c P / 2, the one before that from r + c P, and so on.
void OtherPaths::add_earlier_pings(const PingContext& context, Side side, const BeamPlane& plane,
                                   std::span<float> power) const {
  const double altitude_m = context.altitude_m, per_m = context.range_per_m_down;
  const double slant_m = plane.slant_m(altitude_m), noise = power.front();
  for (int pings = 1; pings <= max_pings_back; ++pings) {
    const auto intensity = [&](std::size_t n) {
      const double before_m = pings * ping_m_;
      const double from_m = (law_.cell_middle_m(n) + before_m) / per_m;
      return context.beam_share(power.size()) *
             law_.level_bed(side, plane, from_m, slant_m / from_m, before_m) / per_m *
             bed_strength_(std::min(altitude_m / from_m, 1.0));
    };
    const double first = std::max(per_m * slant_m - pings * ping_m_, 0.0) / law_.bin_m();
    if (!(first < static_cast<double>(power.size()))) continue;
    const auto begin = static_cast<std::size_t>(first);
    // The intensity falls with range: if the first bin is far below the noise, so are all others.
    if (intensity(begin) < inaudible * noise) return;
    over_bins(begin, power.size(), intensity,
              [&](std::size_t n, double value) { power[n] += static_cast<float>(value); });
  }
}

// A bin receives two strips of the sea surface between the ranges where its cell begins and ends,
// or the bin itself if that is longer: one to port and one to starboard.
void OtherPaths::add_surface(const PingContext& context, Side side, const BeamPlane& plane,
                             std::span<float> power) const {
  const double depth_m = context.depth_m(), per_m = context.range_per_m_up;
  const double slant_m = plane.slant_m(depth_m),
               length_m = std::max(law_.cell_m(), law_.bin_m()) / per_m;
  const auto horizontal_m = [&](double range_m) {
    return std::sqrt(std::max(range_m * range_m - slant_m * slant_m, 0.0));
  };
  const auto intensity = [&](std::size_t n) {
    const double range_m = law_.cell_middle_m(n) / per_m;
    const double near_m = horizontal_m(std::max(range_m - 0.5 * length_m, 0.0));
    const double far_m = horizontal_m(range_m + 0.5 * length_m);
    const double middle_m = 0.5 * (near_m + far_m);
    const double own = law_.two_way(side, plane, range_m, middle_m, -slant_m);
    const double other = law_.two_way(side, plane, range_m, -middle_m, -slant_m);
    const double area_m2 = plane.slant_m(law_.width_m_at(range_m)) * (far_m - near_m) *
                           law_.cell_m() / (per_m * length_m);
    const double sine = std::min(depth_m / range_m, 1.0);
    return context.beam_share(n) * law_.per_m2_at(range_m) * at_sine(surface_strength_, sine) *
           area_m2 * (own + other);
  };
  const double first = per_m * slant_m / law_.bin_m();
  if (first < static_cast<double>(power.size()))
    over_bins(static_cast<std::size_t>(first), power.size(), intensity,
              [&](std::size_t n, double value) { power[n] += static_cast<float>(value); });
}

// A bin receives a shell of water. The shell has no parts above the surface or below the bed. Both
// vertical patterns of a sonar that rolls are taken at the mean of their angles, and what is left
// of its beam along the track, in some directions.
void OtherPaths::add_volume(const PingContext& context, double depth_m, double altitude_m,
                            Side side, const BeamPlane& plane, std::span<float> power) const {
  const VerticalSum& sum = vertical_sums_[static_cast<std::size_t>(side)];
  const double roll_tilt = std::atan2(plane.sin_roll_tilt, plane.cos_roll_tilt);
  const double surface_m = plane.slant_m(depth_m), bed_m = plane.slant_m(altitude_m);
  const auto width_rad = [&](std::size_t n) {
    const double r = law_.cell_middle_m(n);
    const double up = std::asin(std::min(surface_m / r, 1.0));
    const double down = std::asin(std::min(bed_m / r, 1.0));
    const double mean_tilt = roll_tilt + 0.5 * r * plane.roll_tilt_per_m;
    const auto between = [&](double from, double to, int parts) {
      const double part = (to - from) / parts;
      double width = 0.0;
      for (int i = 0; i < parts; ++i) {
        const double begin = from + i * part, middle = begin + 0.5 * part;
        width += sum.between(begin - mean_tilt, begin + part - mean_tilt) *
                 law_.moved_share(plane, r, r * std::cos(middle), r * std::sin(middle));
      }
      return width;
    };
    return between(-up, down, plane.turns() ? directions_of_volume : 1) +
           between(pi - down, pi + up, 1);
  };
  const auto add = [&](std::size_t n, double width) {
    power[n] += static_cast<float>(context.beam_share(n) * volume_[n] * width);
  };
  const auto bin_of = [&](double range_m) {
    return static_cast<std::size_t>(
        std::min(range_m / law_.bin_m(), static_cast<double>(power.size())));
  };
  const std::size_t near = bin_of(std::min(surface_m, bed_m)),
                    far = bin_of(std::max(surface_m, bed_m));
  if (plane.at_rest()) {
    const double whole = sum.between(0.0, 2.0 * pi);
    for (std::size_t n = 0; n < near; ++n) add(n, whole);
  } else {
    over_bins(0, near, width_rad, add);
  }
  over_bins(near, far, width_rad, add);
  over_bins(far, power.size(), width_rad, add);
}

// Sums of the direct energy up to each bin, as it would be without the vertical pattern of the
// direct path and at rest. Where that pattern hides the bed, the bins hold little more than side
// lobes of the pulse: there the bed is taken as level.
void OtherPaths::sum_bed(double slant_m, Side side, const BeamPlane& plane,
                         std::span<const float> direct, std::vector<double>& sums) const {
  constexpr double hidden = 1e-5;  // two-way pattern
  const auto horizontal_m = [&](std::size_t n) {
    const double r = law_.range_m(n);
    return std::sqrt(std::max(r * r - slant_m * slant_m, 0.0));
  };
  const auto two_way = [&](std::size_t n) {
    return law_.two_way(side, plane, law_.range_m(n), horizontal_m(n), slant_m);
  };
  sums.assign(direct.size() + 2, two_way(0));
  const auto first = static_cast<std::size_t>(slant_m / law_.bin_m());
  over_bins(first, direct.size(), two_way,
            [&](std::size_t n, double pattern) { sums[n + 1] = pattern; });
  sums[0] = 0.0;
  for (std::size_t n = 0; n < direct.size(); ++n) {
    const double pattern = sums[n + 1];
    double bed = 0.0;
    if (pattern > hidden) {
      bed = direct[n] / pattern;
    } else if (n > first) {
      const double r = law_.range_m(n), level = std::max(horizontal_m(n) / r, 0.1);
      bed = law_.per_m2_at(r) * law_.width_m_at(r) * law_.cell_m() / level *
            bed_strength_(std::clamp(plane.cos_pitch * slant_m / r, 1e-4, 1.0));
    }
    sums[n + 1] = sums[n] + bed;
  }
  sums[direct.size() + 1] = sums[direct.size()];
}

// By image sources, with the altitude h and the depth d of the array: a leg from the array to a
// point of the bed has the vertical extent a = h if it is direct, h + 2 d if the surface reflects
// it, 3 h + 2 d if bed and surface reflect it. Let two legs of lengths r and r' have the extents a
// and b and the same horizontal distance: then r'^2 - r^2 = b^2 - a^2, and the echo appears at the
// range (r + r') / 2. A leg that the surface reflects meets the surface once, at the grazing angle
// asin(a / r), and passes through the bubbles there. Where the direct echo has the bed's strength
// at one grazing angle, s(g), this echo has it at two, by sqrt(s(g) s(g')). It is the same both
// ways, and for Lambert's law it is mu sin g sin g' (Ellis and Crowe, JASA 89, 2207, 1991). Along
// the track the beam is as wide as the legs' patterns overlap. The plane abeam of
// an array with the pitch p is inclined: in it these extents are longer by 1 / cos p, and a leg
// meets the bed ahead of the array by sin p of its extent if it leaves downwards, or astern by as
// much if it leaves upwards. The leg back meets it where the receiver looks when the echo is back.
void OtherPaths::add_multiples(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                               std::span<const float> direct, std::span<float> power,
                               std::vector<double>& sums) const {
  const double per_m = 1.0 / law_.bin_m(), last = static_cast<double>(direct.size());
  const double h = plane.slant_m(altitude_m), d = plane.slant_m(depth_m);
  sum_bed(h, side, plane, direct, sums);
  const double by_surface = h + 2.0 * d, by_bed = 3.0 * h + 2.0 * d;
  struct Path {
    double out_height_m, back_height_m;  // extents of the leg out and the leg back in the plane
    double count;                        // 2: the leg out and the leg back can be exchanged
    bool up_out, up_back;  // whether the leg out and the leg back leave the array upwards
    bool off_bed;          // whether the bed reflects the leg back
  };
  const Path paths[] = {
      {h, by_surface, 2.0, false, true, false},          // the surface reflects one leg
      {by_surface, by_surface, 1.0, true, true, false},  // the surface reflects both legs
      {h, by_bed, 2.0, false, false, true}};             // surface and bed reflect one leg
  const auto strength = [&](double sine) { return bed_strength_(std::clamp(sine, 1e-4, 1.0)); };
  for (const Path& path : paths) {
    const double difference =
        path.back_height_m * path.back_height_m - path.out_height_m * path.out_height_m;
    // For the apparent range rho of this echo: returns the range at which the direct echo of the
    // same place appears, and sets the gain from the direct echo's energy to this echo's.
    const auto source = [&](double rho, double& gain) {
      const bool equal_legs = difference == 0.0;
      const double out = equal_legs ? rho : rho - difference / (4.0 * rho);
      const double back = equal_legs ? rho : 2.0 * rho - out;
      const double horizontal_squared =
          std::max(out * out - path.out_height_m * path.out_height_m, 0.0);
      const double r = std::sqrt(horizontal_squared + h * h);
      const double horizontal = std::sqrt(horizontal_squared);
      const double out_down = path.up_out ? -path.out_height_m : path.out_height_m;
      const double back_down = path.up_back ? -path.back_height_m : path.back_height_m;
      // Both vertical patterns, and the overlap along the track, of sound that goes out by one leg
      // and comes back by the other.
      const auto beams = [&](double leg_m, double down, double other_m, double other_down) {
        const double shift_m = rho * (horizontal * plane.turn_level_per_m +
                                      other_down * plane.turn_down_per_m - plane.drift_along);
        return law_.vertical(side, plane, horizontal, down) *
               law_.vertical_at(side, plane, rho, horizontal, other_down) *
               beams_->overlap_m(leg_m, other_m,
                                 std::abs(plane.sin_pitch * (other_down - down) - shift_m));
      };
      double both = beams(out, out_down, back, back_down);
      if (path.count > 1.0 && !plane.at_rest())
        both = 0.5 * (both + beams(back, back_down, out, out_down));
      // Spreading and absorption of the legs relative to those of the direct path.
      const double out_sine = plane.cos_pitch * path.out_height_m / out;
      const double back_sine = plane.cos_pitch * path.back_height_m / back;
      const double strengths = strength(out_sine) * strength(back_sine);
      gain = path.count * both * std::sqrt(strengths * law_.per_m2_at(out) * law_.per_m2_at(back)) /
             (strength(plane.cos_pitch * h / r) * law_.per_m2_at(r)) / beams_->overlap_m(r, r);
      const auto through_bubbles = [&](double sine) {
        const double grazing_rad = std::asin(std::min(sine, 1.0));
        return scatter::from_db(-scatter::bubble_loss_db(surface_, grazing_rad));
      };
      if (path.up_out) gain *= through_bubbles(out_sine);
      gain *= through_bubbles(back_sine);  // the surface always reflects this leg
      if (path.off_bed) gain *= at_sine(bed_reflection_, std::min(back_sine, 1.0));
      return r;
    };
    // Sum of the direct energy up to a range, without the direct path's pattern.
    const auto energy = [&](double range_m) {
      const double place = std::min(range_m * per_m, last);
      const auto bin = static_cast<std::size_t>(place);
      return sums[bin] + (place - static_cast<double>(bin)) * (sums[bin + 1] - sums[bin]);
    };
    const double first_m = 0.5 * (path.out_height_m + path.back_height_m);
    auto n = static_cast<std::size_t>(first_m / law_.bin_m());
    double gain = 0.0, next_gain = 0.0;
    double from_m = source(std::max(static_cast<double>(n) * law_.bin_m(), first_m), gain);
    double energy_before = energy(from_m);
    for (const std::size_t begin = n; n < power.size();) {
      const std::size_t to = next_step(n, begin);
      const double next_m = source(static_cast<double>(to) * law_.bin_m(), next_gain);
      const double per_bin = 1.0 / static_cast<double>(to - n);
      const double step_m = (next_m - from_m) * per_bin, gain_step = (next_gain - gain) * per_bin;
      for (; n < std::min(to, power.size()); ++n) {
        from_m += step_m;
        gain += gain_step;
        const double energy_now = energy(from_m);
        power[n] += static_cast<float>(gain * (energy_now - energy_before));
        energy_before = energy_now;
      }
      from_m = next_m;
      gain = next_gain;
    }
  }
}

/// The sound of the array as a wall mirrors it onto a line of the bed along the track, and the
/// array that receives it from there. Distances from the middles of both beams.
struct OtherPaths::MirroredBeam {
  double image_m, receiver_m;  // from the array's image and from the array to the line
  double begin_m, end_m;       // between which the image is seen through the wall
  double shift_m;              // from the image's middle to the receiver's
  double blur_m;               // rms
};

/// The integral along the line of both one-way patterns.
double OtherPaths::mirrored_m(const MirroredBeam& beam) const {
  constexpr int steps = 32;
  const double image_reach_m = beams_->main_m(beam.image_m);
  const double begin_m = std::max(beam.begin_m, -image_reach_m);
  const double step_m = (std::min(beam.end_m, image_reach_m) - begin_m) / steps;
  if (!(step_m > 0.0)) return 0.0;
  // The receiver's beam, blurred: a Gaussian with the beam's integral and peak, widened.
  const double peak = beams_->power(OneWayBeams::receiver, beam.receiver_m, 0.0);
  double width_m = 0.0;
  const double reach_m = beams_->main_m(beam.receiver_m), cell_m = 2.0 * reach_m / steps;
  for (int i = 0; i < steps / 2; ++i)
    width_m +=
        2.0 * cell_m * beams_->power(OneWayBeams::receiver, beam.receiver_m, (i + 0.5) * cell_m);
  const double rms_m = width_m / std::max(peak, 1e-9) / std::sqrt(2.0 * pi);
  const double blurred_m = std::hypot(rms_m, beam.blur_m);
  const bool sharp = beam.blur_m < 0.2 * rms_m;
  const auto received = [&](double along_m) {
    if (sharp) return beams_->power(OneWayBeams::receiver, beam.receiver_m, along_m);
    const double x = along_m / blurred_m;
    return width_m / (std::sqrt(2.0 * pi) * blurred_m) * std::exp(-0.5 * x * x);
  };
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double along_m = begin_m + (i + 0.5) * step_m;
    sum += beams_->power(OneWayBeams::transmitter, beam.image_m, along_m) *
           received(along_m + beam.shift_m);
  }
  return sum * step_m;
}

// A wall mirrors the array: the bed before it receives sound from an image of the array behind the
// wall, through the window that the wall is. For each place of the bed the path array - wall - bed
// - array is nearly as long as that to the wall's foot and back, if the wall is upright. In the
// direction abeam let the wall be at the distance x, the array H above the bed, and the normal of
// the wall turned away from the array by the angle a, to the side, and by t, upwards. Sound that
// meets the wall z above the bed, at the depression g, tan g = (H - z) / x, leaves it at the
// depression g' = g - 2 t and meets the bed z / tan g' before the wall, turned by 2 a to the side.
// The array hears it with its own beam from there. So of a wall that is wide, upright and faces the
// sonar the array's two beams overlap, from the image and from the array; of an oblique one they
// part, more so the farther from the wall; of a narrow one the image is seen in a part of its beam.
// Along the track the image is blurred by the inclinations of the wall's surface, with the rms
// slope s by 2 s times the distance from the wall, and by diffraction: sinc^2(L sin / lambda) has
// the peak and the integral of a Gaussian with the rms angle lambda / (sqrt(2 pi) L).
//
// Seen from the bed, sound from the wall continues forwards, near the specular direction, turned by
// 2 a: it has the strength of the bed's forward lobe and, around it, sqrt(s(g) s(g')) as a
// multiple. For each place the paths in both directions are equally long and alike, so that their
// amplitudes add: four times the energy of one. Left out: rough walls that send sound up or farther
// down than smooth ones.
void OtherPaths::add_double_bounce(const PingContext& context, const EchoLine& line,
                                   const BeamPlane& plane, std::span<const float> direct,
                                   std::span<float> power) const {
  constexpr double lowest_rad = 0.01;  // of sound that reaches the bed after a wall
  constexpr int max_steps = 16;
  const auto strength = [&](double sine) { return bed_strength_(std::clamp(sine, 1e-4, 1.0)); };
  const Eigen::Vector3d abeam = (line.side == Side::port ? -1.0 : 1.0) *
                                context.array.axis.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d along =
      Eigen::Vector3d(context.array.axis.x(), context.array.axis.y(), 0.0).normalized();
  for (const WallFacet& wall : line.walls) {
    const double facing = -wall.normal.dot(abeam), aside = wall.normal.dot(along);
    if (!(facing > std::abs(aside))) continue;  // else it sends the sound farther away
    const double tangent = aside / facing, turned_rad = std::atan(tangent);
    const double upwards_rad = std::asin(std::clamp(wall.normal.z(), -1.0, 1.0));
    // The wall's ends along the track, and its distance where it is nearest to the beam's middle.
    const double middle_m = wall.middle.dot(along);
    const double half_m = 0.5 * wall.length_m * std::cos(turned_rad);
    const double begin_m = middle_m - half_m, end_m = middle_m + half_m;
    const double x_m =
        wall.middle.dot(abeam) + (std::clamp(0.0, begin_m, end_m) - middle_m) * tangent;
    if (!(x_m > 0.0)) continue;
    // The bed before it: the last bins of bed before the wall's.
    auto bed = static_cast<std::size_t>(std::hypot(x_m, wall.middle.z()) / law_.bin_m());
    bed = std::min(bed, power.size() - 1);
    while (bed > 0 && line.bins.region[bed] != static_cast<std::uint32_t>(Region::seabed)) --bed;
    if (bed == 0) continue;
    const double height_m = context.array.origin.z() - double(line.bins.z_m[bed]);
    if (!(height_m > 0.0)) continue;
    const double tall_m = 0.5 * wall.height_m * std::cos(upwards_rad);
    const double low_m = std::max(height_m + wall.middle.z() - tall_m, 0.0);
    const double high_m = std::min(height_m + wall.middle.z() + tall_m, 0.99 * height_m);
    // From the wall to the bed, from a height: its depression.
    const auto depression_rad = [&](double z_m) {
      return std::atan2(height_m - z_m, x_m) - 2.0 * upwards_rad;
    };
    const auto range_on_bed_m = [&](double z_m) {
      const double before_m = z_m / std::tan(std::max(depression_rad(z_m), lowest_rad));
      return std::hypot(x_m - before_m * std::cos(2.0 * turned_rad), height_m);
    };
    const double bins = std::abs(range_on_bed_m(high_m) - range_on_bed_m(low_m)) / law_.bin_m();
    const int steps = static_cast<int>(std::clamp(std::ceil(bins), 1.0, double(max_steps)));
    const double step_m = (high_m - low_m) / steps;
    for (int i = 0; i < steps && step_m > 0.0; ++i) {
      const double z_m = low_m + (i + 0.5) * step_m;
      const double in_rad = depression_rad(z_m);
      if (!(in_rad > lowest_rad && in_rad < 0.5 * pi)) continue;
      const double before_m = z_m / std::tan(in_rad), to_wall_m = std::hypot(x_m, height_m - z_m);
      if (!(before_m < x_m)) continue;
      const double image_m = to_wall_m + std::hypot(before_m, z_m);
      const double range_m = range_on_bed_m(z_m);
      const double bins_of_step =
          std::abs(range_on_bed_m(z_m + 0.5 * step_m) - range_on_bed_m(z_m - 0.5 * step_m)) /
          law_.bin_m();
      const auto foot = static_cast<std::size_t>(0.5 * (image_m + range_m) / law_.bin_m());
      if (foot >= power.size()) continue;
      // A rough wall also turns what the array hears, within its beam.
      const double spread_rad =
          std::min(2.0 * wall.slope, std::atan2(beams_->main_m(range_m), before_m));
      const double sine_in = std::sin(in_rad), sine_out = std::min(height_m / range_m, 1.0);
      const double direct_strength = strength(sine_out);
      double forwards = std::sqrt(strength(sine_in) * direct_strength);
      if (sediment_)
        forwards += scatter::forward_lobe(*sediment_, k_per_cm_, in_rad, std::asin(sine_out),
                                          std::hypot(2.0 * turned_rad, spread_rad));
      const double beyond = (x_m + before_m) / x_m;
      const double mirrored = mirrored_m(
          {.image_m = image_m,
           .receiver_m = range_m,
           .begin_m = begin_m * beyond,
           .end_m = end_m * beyond,
           .shift_m = before_m * std::tan(2.0 * turned_rad),
           .blur_m = std::hypot(2.0 * wall.slope * before_m,
                                law_.wavelength_m() / (std::sqrt(2.0 * pi) * wall.length_m) *
                                    (image_m - to_wall_m))});
      const double to_bed = law_.vertical(line.side, plane, x_m - before_m, height_m);
      const double to_wall = law_.vertical(line.side, plane, x_m, height_m - z_m);
      // Energy of the path over the wall, relative to the direct echo of the same place.
      const double gain = forwards / direct_strength *
                          std::sqrt(law_.per_m2_at(image_m) / law_.per_m2_at(range_m)) * to_wall /
                          to_bed * mirrored / beams_->overlap_m(range_m, range_m);
      const auto bin = std::min(static_cast<std::size_t>(range_m / law_.bin_m()), bed);
      power[foot] +=
          static_cast<float>(4.0 * wall.reflected * gain * bins_of_step * double(direct[bin]));
    }
  }
}

}  // namespace ensonify::engine
