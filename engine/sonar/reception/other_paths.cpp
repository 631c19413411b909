#include <ensonify/engine/sonar/reception/other_paths.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include <ensonify/scatter/ambient_noise.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr std::size_t sines = 1024;         // of the surface's and the bed's tables
constexpr int wave_oscillator = 100;        // its number among those that move
constexpr std::size_t directions = 1440;    // a turn, of the vertical pattern's sums
constexpr double other_bed_loss_db = 10.0;  // of a bed that is no sediment; nobody's measurement

/// Waves of a fully developed sea (Pierson and Moskowitz, J. Geophys. Res. 69, 5181, 1964):
/// significant height 0.21 U^2 / g, peak at 0.877 g / U.
Oscillation waves_under(double wind_mps) {
  constexpr double g = 9.81;
  if (!(wind_mps > 0.0)) return {};
  return {.rms = 0.25 * 0.21 * wind_mps * wind_mps / g,
          .period_s = 2.0 * pi * wind_mps / (0.877 * g)};
}

/// Where a smooth function of range that kinks at a first bin is taken, and linear between: bin by
/// bin there, then a share of the way from there apart, and at most one of the range.
std::size_t next_step(std::size_t n, std::size_t first) {
  return n + std::max<std::size_t>(1, std::min((n - first) / 16, n / 64));
}

/// Calls add(n, value) for the bins from one to an end, f(n) being taken in such steps.
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

}  // namespace

// Level to starboard and straight up in the plane; the roll turns the sonar's down from there to
// port.
BeamPlane::BeamPlane(const ArrayFrame& array, Side side)
    : upright(std::sqrt(std::max(1.0 - array.axis.z() * array.axis.z(), 0.0))) {
  if (upright < 1e-6) return;
  const Eigen::Vector3d level = array.axis.cross(Eigen::Vector3d::UnitZ()) / upright;
  const Eigen::Vector3d up = level.cross(array.axis);
  cos_lean = -array.down.dot(up);
  sin_lean = (side == Side::starboard ? -1.0 : 1.0) * array.down.dot(level);
}

EchoLaw::EchoLaw(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
                 const Scatterers& scatterers)
    : bin_m_(sonar.bin_m()),
      cell_m_(sonar.pulse.cell_m(sound_speed_mps)),
      wavelength_m_(sound_speed_mps / sonar.frequency_hz),
      frequency_hz_(sonar.frequency_hz),
      vertical_{VerticalTable(sonar.vertical, Side::port),
                VerticalTable(sonar.vertical, Side::starboard)},
      scatterers_(&scatterers) {
  for (std::size_t bin = 0; bin < static_cast<std::size_t>(sonar.bins); ++bin) {
    const double r = range_m(bin);
    per_m2_.push_back(scatter::from_db(sonar.source_level_db - 2.0 * absorption_db_per_m * r) /
                      (r * r * r * r));
  }
}

double EchoLaw::per_m2_at(double range_m) const {
  const double place = std::clamp(range_m / bin_m_ - 0.5, 0.0, static_cast<double>(bins() - 1));
  const auto bin = std::min(static_cast<std::size_t>(place), bins() - 2);
  const double share = place - static_cast<double>(bin);
  if (range_m >= bin_m_ * static_cast<double>(bins())) {  // beyond: as 1 / r^4, and nobody hears it
    const double last_m = bin_m_ * static_cast<double>(bins());
    return per_m2_.back() * std::pow(last_m / range_m, 4);
  }
  return per_m2_[bin] + share * (per_m2_[bin + 1] - per_m2_[bin]);
}

double EchoLaw::vertical_width_rad(Side side, int power) const {
  constexpr int steps = 3600;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double depression = 2.0 * pi * (i + 0.5) / steps;
    sum += std::pow(vertical(side, std::cos(depression), std::sin(depression)), power);
  }
  return sum * 2.0 * pi / steps;
}

double noise_power(const Sonar& sonar, const EchoLaw& law, const SeaState& sea, Side side) {
  // Isotropic noise fills the array's beam, lambda / L wide, at all depressions alike.
  const double solid_angle_sr = std::min(law.wavelength_m() / sonar.receive_length_m(), 2.0) *
                                law.vertical_width_rad(side, 1);
  const double ambient =
      scatter::from_db(scatter::ambient_noise_db(sonar.frequency_hz, sea.wind_mps, sea.shipping)) *
      solid_angle_sr / (4.0 * pi);
  const double own =
      sonar.receiver.self_noise_db ? scatter::from_db(*sonar.receiver.self_noise_db) : 0.0;
  return sonar.pulse.noise_bandwidth_hz() * (ambient + own);
}

VerticalSum::VerticalSum(const EchoLaw& law, Side side) : sums_{0.0} {
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

OtherPaths::OtherPaths(const OtherPathsOptions& options, const SeaState& sea, const EchoLaw& law,
                       const std::optional<scatter::Sediment>& bed, std::uint64_t seed)
    : options_(options),
      law_(law),
      surface_{.wind_mps = sea.wind_mps, .frequency_hz = law.frequency_hz()},
      waves_(waves_under(sea.wind_mps), seed, wave_oscillator),
      vertical_sums_{VerticalSum(law, Side::port), VerticalSum(law, Side::starboard)},
      wall_share_(scatter::from_db(-options.wall_loss_db)) {
  for (std::size_t i = 0; options.surface && i <= sines; ++i)
    surface_strength_.push_back(scatter::surface_cross_section(
        surface_, std::asin(std::max(0.5, static_cast<double>(i)) / sines)));
  for (std::size_t i = 0; options.multiples && i <= sines; ++i) {
    const double loss_db =
        options.bottom_loss_db ? *options.bottom_loss_db
        : bed ? scatter::reflection_loss_db(*bed, std::asin(static_cast<double>(i) / sines))
              : other_bed_loss_db;
    bed_reflection_.push_back(scatter::from_db(-loss_db));
  }
  const double strength = scatter::from_db(sea.volume_scattering_db);
  for (std::size_t bin = 0; options.volume && bin < law.bins(); ++bin)
    volume_.push_back(law.per_m2(bin) * strength * law.width_m(bin) * law.range_m(bin) *
                      law.cell_m());
}

void OtherPaths::add(const PingContext& hearing, const EchoLine& line,
                     std::span<const float> direct, std::span<float> power,
                     std::vector<double>& sums) const {
  const double depth_m = hearing.depth_m();
  const double height = options_.surface || options_.multiples ? waves_.at(hearing.t_s) : 0.0;
  const BeamPlane plane(hearing.array, line.side);
  if (options_.surface) add_surface(std::max(depth_m + height, 0.0), line.side, plane, power);
  if (options_.volume) add_volume(depth_m, hearing.altitude_m, line.side, plane, power);
  if (options_.multiples)
    add_multiples(std::max(depth_m + height, 0.0), hearing.altitude_m, line.side, plane, direct,
                  power, sums);
  if (options_.double_bounce) add_double_bounce(hearing, line, direct, power);
}

// Per bin the strip between its two ranges, on the side's own half and on the other.
void OtherPaths::add_surface(double depth_m, Side side, const BeamPlane& plane,
                             std::span<float> power) const {
  const double slant_m = plane.slant_m(depth_m);
  const auto over_m = [&](double range_m) {
    return std::sqrt(std::max(range_m * range_m - slant_m * slant_m, 0.0));
  };
  const auto intensity = [&](std::size_t n) {
    const double near_m = over_m(static_cast<double>(n) * law_.bin_m());
    const double far_m = over_m(static_cast<double>(n + 1) * law_.bin_m());
    const double middle_m = 0.5 * (near_m + far_m);
    const double own = law_.vertical(side, plane, middle_m, -slant_m);
    const double other = law_.vertical(side, plane, -middle_m, -slant_m);
    const double area_m2 =
        plane.slant_m(law_.width_m(n)) * (far_m - near_m) * law_.cell_m() / law_.bin_m();
    const double sine = std::min(depth_m / law_.range_m(n), 1.0);
    return law_.per_m2(n) * surface_strength_[static_cast<std::size_t>(sine * sines)] * area_m2 *
           (own * own + other * other);
  };
  const double first = slant_m / law_.bin_m();
  if (first < static_cast<double>(power.size()))
    over_bins(static_cast<std::size_t>(first), power.size(), intensity,
              [&](std::size_t n, double more) { power[n] += static_cast<float>(more); });
}

// A shell of water, without what would lie above the surface or below the bed.
void OtherPaths::add_volume(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                            std::span<float> power) const {
  const VerticalSum& sum = vertical_sums_[static_cast<std::size_t>(side)];
  const double lean = std::atan2(plane.sin_lean, plane.cos_lean);
  const double surface_m = plane.slant_m(depth_m), bed_m = plane.slant_m(altitude_m);
  const auto width_rad = [&](std::size_t n) {
    const double r = law_.range_m(n);
    const double up = std::asin(std::min(surface_m / r, 1.0));
    const double down = std::asin(std::min(bed_m / r, 1.0));
    return sum.between(-up - lean, down - lean) + sum.between(pi - down - lean, pi + up - lean);
  };
  const auto add = [&](std::size_t n, double width) {
    power[n] += static_cast<float>(volume_[n] * width);
  };
  const auto bin_of = [&](double range_m) {
    return static_cast<std::size_t>(
        std::min(range_m / law_.bin_m(), static_cast<double>(power.size())));
  };
  const std::size_t near = bin_of(std::min(surface_m, bed_m)),
                    far = bin_of(std::max(surface_m, bed_m));
  const double whole = sum.between(0.0, 2.0 * pi);
  for (std::size_t n = 0; n < near; ++n) add(n, whole);
  over_bins(near, far, width_rad, add);
  over_bins(far, power.size(), width_rad, add);
}

// By images: a leg from the array to a place of the bed has the vertical extent a = h straight
// down, h + 2 d by way of the surface, 3 h + 2 d by way of bed and surface. Of two legs of lengths
// r (a) and r' (b) over the same ground, r'^2 - r^2 = b^2 - a^2, and the echo comes from a range of
// (r + r') / 2. A leg by way of the surface meets it once, at the grazing angle of asin(a / r), and
// passes through the bubbles beneath it.
void OtherPaths::add_multiples(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                               std::span<const float> direct, std::span<float> power,
                               std::vector<double>& sums) const {
  sums.resize(direct.size() + 2);
  sums[0] = 0.0;
  for (std::size_t n = 0; n < direct.size(); ++n) sums[n + 1] = sums[n] + direct[n];
  sums[direct.size() + 1] = sums[direct.size()];
  const double per_m = 1.0 / law_.bin_m(), last = static_cast<double>(direct.size());
  const double h = altitude_m, by_surface = h + 2.0 * depth_m, by_bed = 3.0 * h + 2.0 * depth_m;
  struct Way {
    double out_m, back_m, share;
    bool up_out, up_back;  // the legs leave upwards
    bool off_bed;          // the one back is reflected there
  };
  const Way ways[] = {{h, by_surface, 2.0, false, true, false},          // either way round
                      {by_surface, by_surface, 1.0, true, true, false},  // and both legs
                      {h, by_bed, 2.0, false, false, true}};
  for (const Way& way : ways) {
    const double difference = way.back_m * way.back_m - way.out_m * way.out_m;
    // For an apparent range: the direct echo's range, and what becomes of its energy.
    const auto source = [&](double rho, double& gain) {
      const bool twice = difference == 0.0;
      const double out = twice ? rho : rho - difference / (4.0 * rho);
      const double back = twice ? rho : 2.0 * rho - out;
      const double over2 = std::max(out * out - way.out_m * way.out_m, 0.0);  // horizontal, squared
      const double r = std::sqrt(over2 + h * h), over = std::sqrt(over2);
      const double straight = law_.vertical(side, plane, over, h);
      const double pattern =
          law_.vertical(side, plane, over, way.up_out ? -way.out_m : way.out_m) *
          law_.vertical(side, plane, over, way.up_back ? -way.back_m : way.back_m);
      // Spreading and absorption of the legs against those of the direct way.
      gain = way.share * pattern / (straight * straight) *
             std::sqrt(law_.per_m2_at(out) * law_.per_m2_at(back)) / law_.per_m2_at(r);
      const auto through_bubbles = [&](double down_m, double leg_m) {
        const double grazing_rad = std::asin(std::min(down_m / leg_m, 1.0));
        return scatter::from_db(-scatter::bubble_loss_db(surface_, grazing_rad));
      };
      if (way.up_out) gain *= through_bubbles(way.out_m, out);
      gain *= through_bubbles(way.back_m, back);  // this leg always goes by way of the surface
      if (way.off_bed)
        gain *= bed_reflection_[static_cast<std::size_t>(std::min(way.back_m / back, 1.0) * sines)];
      return r;
    };
    // Energy up to a range, in bins.
    const auto energy = [&](double range_m) {
      const double place = std::min(range_m * per_m, last);
      const auto bin = static_cast<std::size_t>(place);
      return sums[bin] + (place - static_cast<double>(bin)) * (sums[bin + 1] - sums[bin]);
    };
    const double first_m = 0.5 * (way.out_m + way.back_m);
    auto n = static_cast<std::size_t>(first_m / law_.bin_m());
    double gain = 0.0, next_gain = 0.0;
    double from_m = source(std::max(static_cast<double>(n) * law_.bin_m(), first_m), gain);
    double before = energy(from_m);
    for (const std::size_t begin = n; n < power.size();) {
      const std::size_t to = next_step(n, begin);
      const double next_m = source(static_cast<double>(to) * law_.bin_m(), next_gain);
      const double a_bin = 1.0 / static_cast<double>(to - n);
      const double way_m = (next_m - from_m) * a_bin, more = (next_gain - gain) * a_bin;
      for (; n < std::min(to, power.size()); ++n) {
        from_m += way_m;
        gain += more;
        const double so_far = energy(from_m);
        power[n] += static_cast<float>(gain * (so_far - before));
        before = so_far;
      }
      from_m = next_m;
      gain = next_gain;
    }
  }
}

// A wall mirrors the bed before it: whatever place the sound meets there, array - wall - bed -
// array is as long as the way to the wall's foot and back, nearly. So the foot's bin gets the echo
// of as much of the bed as the wall is tall enough to mirror, there and back: twice.
void OtherPaths::add_double_bounce(const PingContext& hearing, const EchoLine& line,
                                   std::span<const float> direct, std::span<float> power) const {
  const auto of_object = [&](std::size_t n) { return line.bins.instance[n] != 0; };
  const auto in_shadow = [&](std::size_t n) {
    return line.bins.region[n] == static_cast<std::uint32_t>(Region::shadow);
  };
  for (std::size_t n = 1; n < power.size(); ++n) {
    if (!of_object(n) || of_object(n - 1)) continue;
    const std::size_t top = n;
    while (n < power.size() && of_object(n)) ++n;
    if (n == power.size() || !in_shadow(n)) continue;  // no wall, if nothing is hidden
    const std::size_t foot = n - 1;
    const double sine = std::min(hearing.altitude_m / law_.range_m(foot), 0.99);
    // A wall from the foot's range to the top's is so tall; it mirrors its height over tan of the
    // bed.
    const double shape_height_m = (static_cast<double>(foot - top) + 1.0) * law_.bin_m() / sine;
    const double mirrored_m = shape_height_m * (1.0 - sine * sine) / sine;  // in slant range
    const auto bins =
        static_cast<std::size_t>(std::min(mirrored_m / law_.bin_m(), static_cast<double>(top)));
    double sum = 0.0;
    for (std::size_t i = top - bins; i < top; ++i) sum += direct[i];
    power[foot] += static_cast<float>(2.0 * wall_share_ * sum);
  }
}

}  // namespace ensonify::engine
