#include <ensonify/engine/sonar/reception/disturbances.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/base/random.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

constexpr double fish_cell_m = 10.0;
constexpr double fish_height_share = 0.25;  // height of a fish over its length
constexpr std::size_t max_fish = 128;       // per cell

/// The horizontal direction from the array into a sector.
Eigen::Vector2d abeam(const LineContext& context) {
  const Eigen::Vector2d ahead = context.array.axis.head<2>().normalized();
  return context.facing.out * Eigen::Vector2d(ahead.y(), -ahead.x());
}

/// The horizontal vector from the array to the line in which the beam's plane cuts the level
/// above_m above the array, to the nearest place of that line.
Eigen::Vector2d along_of_plane_m(const ArrayFrame& array, double above_m) {
  const double level_squared = std::max(array.axis.head<2>().squaredNorm(), 1e-12);
  return -above_m * array.axis.z() / level_squared * array.axis.head<2>();
}

}  // namespace

Disturbances::Disturbances(const ArtefactOptions& options, const SonarEquation& law,
                           std::function<double(double)> noise, std::uint64_t seed)
    : options_(options), law_(law), noise_(std::move(noise)), seed_(seed) {
  std::array<double, 4> random;
  artefact_stream(seed, Artefact::shimmer).uniform(random);
  artefact_stream(seed, Artefact::shimmer).uniform(shimmer_phases_, random.size());
  interference_begin_m_ = options.interference_range_m > 0.0
                              ? options.interference_range_m
                              : random[3] * law.bin_m() * static_cast<double>(law.bins());
  // One row per effect, in the order in which they are applied.
  if (options.shimmer_db > 0.0) effects_.push_back(&Disturbances::shimmer);
  if (options.fish_per_hectare > 0.0) effects_.push_back(&Disturbances::add_fish);
  if (options.wake_db) effects_.push_back(&Disturbances::add_wake);
  if (options.interference_db) effects_.push_back(&Disturbances::add_interference);
}

void Disturbances::apply(const LineContext& context, std::span<float> gain, std::span<float> power,
                         Artefacts& artefacts) const {
  for (const Effect effect : effects_) (this->*effect)(context, {gain, power, artefacts});
}

// Three waves cross the track: on the port side towards the array, on the starboard side away from
// it. Longer waves are faster, so their sum makes bands that bend, come and go. Each grows and
// fades over some periods, and each sector has separate phases. The phase advances by a constant
// from step to step.
void Disturbances::shimmer(const LineContext& context, const Target& to) const {
  to.artefacts.add(Artefact::shimmer);
  // The number of bins over which the gain is linear: at most an eighth of the wavelength.
  const auto coarse =
      static_cast<std::size_t>(std::clamp(options_.shimmer_m / (8.0 * law_.bin_m()), 1.0, 16.0));
  std::array<std::complex<double>, 3> waves, turns;
  const double to_nepers = 0.1 * std::numbers::ln10 * options_.shimmer_db * std::sqrt(4.0 / 3.0);
  const double periods = -context.facing.out * context.t_s / options_.shimmer_s;
  for (std::size_t i = 0; i < waves.size(); ++i) {
    const auto number = static_cast<double>(i);
    const double* phases = &shimmer_phases_[2 * i + 6 * context.facing.number];
    const double tune = std::exp2((number - 1.0) / 3.0), pace = std::exp2((1.0 - number) / 2.0);
    const double strength =
        to_nepers * std::cos(2.0 * pi * (periods / (5.0 + 2.0 * number) + phases[1]));
    waves[i] = std::polar(
        1.0, 2.0 * pi * (tune * law_.range_m(0) / options_.shimmer_m + pace * periods + phases[0]));
    waves[i] *= strength;
    turns[i] = std::polar(
        1.0, 2.0 * pi * tune * static_cast<double>(coarse) * law_.bin_m() / options_.shimmer_m);
  }
  const auto level = [&] { return std::exp(waves[0].real() + waves[1].real() + waves[2].real()); };
  double here = level();
  for (std::size_t n = 0; n < to.gain.size(); n += coarse) {
    for (std::size_t i = 0; i < waves.size(); ++i)
      waves[i] = {waves[i].real() * turns[i].real() - waves[i].imag() * turns[i].imag(),
                  waves[i].real() * turns[i].imag() + waves[i].imag() * turns[i].real()};
    const double next = level();
    const auto slope = static_cast<float>((next - here) / static_cast<double>(coarse));
    for (std::size_t i = 0; i < coarse && n + i < to.gain.size(); ++i)
      to.gain[n + i] *= static_cast<float>(here) + static_cast<float>(i) * slope;
    here = next;
  }
}

void Disturbances::add_interference(const LineContext& context, const Target& to) const {
  const double reach_m = law_.bin_m() * static_cast<double>(to.power.size());
  double begin_m = interference_begin_m_;
  if (options_.interference_drift_m != 0.0) {  // a pulse that leaves the picture enters it again
    begin_m = std::fmod(begin_m + static_cast<double>(context.ping) * options_.interference_drift_m,
                        reach_m);
    if (begin_m < 0.0) begin_m += reach_m;
  }
  if (begin_m >= reach_m) return;  // behind what this sonar records
  to.artefacts.add(Artefact::interference);
  const auto first = static_cast<std::size_t>(begin_m / law_.bin_m());
  const std::size_t bins = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::lround(options_.interference_length_m / law_.bin_m())));
  const double level = noise_(context.speed_mps) * scatter::from_db(*options_.interference_db);
  for (std::size_t n = first; n < std::min(first + bins, to.power.size()); ++n)
    to.power[n] += static_cast<float>(level);
}

// Bubbles at the surface along a ship's track. A bin receives a strip of them, as in
// OtherPaths::add_surface; their strength falls to both sides as a Gaussian, whose integral over
// the strip is a difference of error functions.
void Disturbances::add_wake(const LineContext& context, const Target& to) const {
  const BeamPlane plane(context);
  const double depth_m = plane.slant_m(context.depth_m());
  const double strength = scatter::from_db(*options_.wake_db);
  const double s = std::sin(options_.wake_heading_rad), c = std::cos(options_.wake_heading_rad);
  const Eigen::Vector2d across{c, -s};
  // Where the beam's plane meets the surface: ahead of the array if the bow is down.
  const Eigen::Vector2d below_m =
      context.array.origin.head<2>() + along_of_plane_m(context.array, context.depth_m());
  const double from_line_m = across.dot(below_m) - options_.wake_offset_m;
  const double per_metre = across.dot(abeam(context));
  // The part of the surface within twice the half width of the track's middle.
  double near_m = 0.0, far_m = std::numeric_limits<double>::infinity();
  if (per_metre != 0.0) {
    const double one_m = (options_.wake_width_m - from_line_m) / per_metre;
    const double other_m = (-options_.wake_width_m - from_line_m) / per_metre;
    near_m = std::max(std::min(one_m, other_m), 0.0);
    far_m = std::max(one_m, other_m);
  } else if (std::abs(from_line_m) > options_.wake_width_m) {
    return;
  }
  const double range_per_m = context.range_per_m_up;
  const double length_m = std::max(law_.cell_m(), law_.bin_m()) / range_per_m;
  const auto over_m = [&](double range_m) {
    return std::sqrt(std::max(range_m * range_m - depth_m * depth_m, 0.0));
  };
  const double half_m = 0.5 * options_.wake_width_m;
  const auto gaussian_m = [&](double begin_m, double end_m) {
    const double begin = (from_line_m + begin_m * per_metre) / half_m,
                 end = (from_line_m + end_m * per_metre) / half_m;
    if (std::abs(end - begin) < 1e-6) return std::exp(-begin * begin) * (end_m - begin_m);
    return 0.5 * std::sqrt(pi) * half_m / per_metre * (std::erf(end) - std::erf(begin));
  };
  const double first =
      range_per_m * std::max(std::hypot(near_m, depth_m) - length_m, 0.0) / law_.bin_m();
  if (!(far_m > 0.0 && first < static_cast<double>(to.power.size()))) return;
  for (auto n = static_cast<std::size_t>(first); n < to.power.size(); ++n) {
    const double cell_m = law_.cell_middle_m(n) / range_per_m;
    const double begin_m = std::max(over_m(std::max(cell_m - 0.5 * length_m, 0.0)), near_m),
                 end_m = std::min(over_m(cell_m + 0.5 * length_m), far_m);
    if (begin_m > far_m) break;
    if (!(end_m > begin_m)) continue;
    const double middle_m = 0.5 * (begin_m + end_m), range_m = std::hypot(middle_m, depth_m);
    to.power[n] += static_cast<float>(
        context.beam_share(n) * law_.per_m2_at(range_m) * strength * gaussian_m(begin_m, end_m) *
        plane.slant_m(law_.width_m_at(range_m)) * law_.cell_m() / (range_per_m * length_m) *
        law_.two_way(plane, range_m, middle_m, -depth_m));
    to.artefacts.add(Artefact::wake);
  }
}

// Fish stay in their cells of the ground, at heights above the bed's height below the sonar.
void Disturbances::add_fish(const LineContext& context, const Target& to) const {
  const double reach_m = law_.bin_m() * static_cast<double>(to.power.size());
  const Eigen::Vector2d out = abeam(context), ahead{-out.y(), out.x()};
  const Eigen::Vector2d here = context.array.origin.head<2>(), there = here + reach_m * out;
  // No fish swims above the mean sea surface.
  const double highest_m =
      std::clamp(context.altitude_m - context.array.origin.z(), 0.0, options_.fish_height_m);
  // How far ahead the beam's plane is at a height above the array.
  const auto plane_m = [&](double above_m) {
    return std::clamp(ahead.dot(along_of_plane_m(context.array, above_m)), -reach_m, reach_m);
  };
  const double bed_m = plane_m(-context.altitude_m),
               top_m = plane_m(highest_m - context.altitude_m);
  const double wide_m = law_.width_m(to.power.size() - 1) + options_.fish_length_m;
  const double min_ahead_m = std::min(bed_m, top_m) - wide_m,
               max_ahead_m = std::max(bed_m, top_m) + wide_m;
  Eigen::Array2d low = here.array().min(there.array()), high = here.array().max(there.array());
  for (const double ahead_m : {min_ahead_m, max_ahead_m}) {
    low = low.min(here.array() + ahead_m * ahead.array())
              .min(there.array() + ahead_m * ahead.array());
    high = high.max(here.array() + ahead_m * ahead.array())
               .max(there.array() + ahead_m * ahead.array());
  }
  const auto cell_of = [](double m) {
    return static_cast<std::int64_t>(std::floor(m / fish_cell_m));
  };
  const double mean = options_.fish_per_hectare * fish_cell_m * fish_cell_m / 1e4;
  std::array<double, 3 * max_fish + 1> random;
  for (std::int64_t i = cell_of(low.x()); i <= cell_of(high.x()); ++i)
    for (std::int64_t j = cell_of(low.y()); j <= cell_of(high.y()); ++j) {
      // Skips cells far from the beam's plane.
      const Eigen::Vector2d middle{(static_cast<double>(i) + 0.5) * fish_cell_m,
                                   (static_cast<double>(j) + 0.5) * fish_cell_m};
      const double ahead_m = (middle - here).dot(ahead);
      if (ahead_m < min_ahead_m - fish_cell_m || ahead_m > max_ahead_m + fish_cell_m) continue;
      const RandomStream stream = artefact_stream(
          seed_, Artefact::fish, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(j));
      stream.uniform(std::span(random).first(1));
      const std::size_t count = poisson_count(mean, random[0], max_fish);
      if (count == 0) continue;
      stream.uniform(std::span(random).first(3 * count), 4);
      for (std::size_t k = 0; k < count; ++k) {
        const double over_bed_m = random[3 * k + 2] * highest_m;
        const Eigen::Vector3d place{(static_cast<double>(i) + random[3 * k]) * fish_cell_m,
                                    (static_cast<double>(j) + random[3 * k + 1]) * fish_cell_m,
                                    context.array.origin.z() - context.altitude_m + over_bed_m};
        const Eigen::Vector3d from_array = place - context.array.origin;
        if (from_array.head<2>().dot(out) > 0.0) add_one_fish(context, from_array, over_bed_m, to);
      }
    }
}

void Disturbances::add_one_fish(const LineContext& context, const Eigen::Vector3d& from_array,
                                double over_bed_m, const Target& to) const {
  // Range as in water of one sound speed. The range of the fish's shadow on the bed is scaled in
  // the same way.
  const double per_m = from_array.z() > 0.0 ? context.range_per_m_up : context.range_per_m_down;
  const double range_m = per_m * from_array.norm();
  const auto bin = static_cast<std::size_t>(range_m / law_.bin_m());
  if (bin >= to.power.size()) return;
  const BeamPlane plane(context);
  const Eigen::Vector3d to_side = context.facing.out * context.array.down.cross(context.array.axis);
  const double abeam = from_array.dot(to_side), down = from_array.dot(context.array.down);
  const double level_m = abeam * plane.cos_roll_tilt - down * plane.sin_roll_tilt,
               below_m = down * plane.cos_roll_tilt + abeam * plane.sin_roll_tilt;
  // The two-way beam lies halfway between the beams of the transmitter and of the receiver that has
  // moved.
  const double from_beam_m =
      from_array.dot(context.array.axis) + 0.5 * range_m * plane.shift(level_m, below_m);
  // The beam's share on this length of the fish, around the middle of the fish.
  const auto beam_share = [&](double along_m) {
    return law_.width_share(bin, from_beam_m - 0.5 * along_m, from_beam_m + 0.5 * along_m);
  };
  const double share = beam_share(options_.fish_length_m);
  if (!(share > 0.0)) return;
  to.artefacts.add(Artefact::fish);
  const double over_m = from_array.head<2>().norm();
  const double thick_m = fish_height_share * options_.fish_length_m;
  // The fish scatters evenly along its length. The energy of a cell is spread over the bins that
  // the fish or the cell fills.
  const auto bins = static_cast<std::size_t>(std::max(thick_m, law_.cell_m()) / law_.bin_m()) + 1;
  const double echo = context.beam_share(bin) * law_.per_m2(bin) *
                      scatter::from_db(options_.fish_strength_db) * share * law_.width_m(bin) /
                      options_.fish_length_m * law_.two_way(plane, range_m, level_m, below_m) *
                      law_.cell_m() / law_.bin_m() / static_cast<double>(bins);
  for (std::size_t n = bin; n < std::min(bin + bins, to.power.size()); ++n)
    to.power[n] += static_cast<float>(echo);

  // The shadow lies where lines of sight through the fish, an ellipse, meet the bed. Diffraction
  // blurs the shadow over a Fresnel zone, and makes it weaker by the factor by which it becomes
  // higher.
  const double h = context.altitude_m;
  const auto shadow_m = [&](double height_m) {
    if (height_m >= h) return std::numeric_limits<double>::infinity();
    return std::hypot(over_m * h / (h - std::max(height_m, 0.0)), h);
  };
  const double away_m = from_array.norm(), bed_m = shadow_m(over_bed_m);
  const double bed_bin_m = law_.bin_m() / context.range_per_m_down;
  if (!(bed_m < bed_bin_m * static_cast<double>(to.gain.size()))) return;
  const double zone_m = std::sqrt(law_.wavelength_m() * away_m * (bed_m - away_m) / bed_m);
  const double half_m = 0.5 * std::hypot(thick_m, zone_m);
  const double darkest = 0.5 * thick_m / half_m;
  const auto first = static_cast<std::size_t>(shadow_m(over_bed_m - half_m) / bed_bin_m);
  const double last_m = shadow_m(over_bed_m + half_m);
  for (std::size_t n = first; n < to.gain.size(); ++n) {
    const double bin_middle_m = (static_cast<double>(n) + 0.5) * bed_bin_m;
    if (bin_middle_m > last_m) break;
    const double ground_m = std::sqrt(std::max(bin_middle_m * bin_middle_m - h * h, 1e-9));
    const double off = (h * (1.0 - over_m / ground_m) - over_bed_m) / half_m;
    const double across = std::sqrt(std::max(1.0 - off * off, 0.0));
    to.gain[n] *= static_cast<float>(1.0 - darkest * beam_share(options_.fish_length_m * across));
  }
}

}  // namespace ensonify::engine
