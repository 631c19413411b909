#include <algorithm>
#include <cmath>

#include <ensonify/engine/sonar/reception/bin_steps.h>
#include <ensonify/engine/sonar/reception/multiples.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::engine {

Multiples::Multiples(const SonarEquation& law, const LevelBed& bed, const OneWayBeams& beams,
                     double wind_mps, std::optional<double> bottom_loss_db)
    : law_(law),
      bed_(bed),
      beams_(beams),
      surface_{.wind_mps = wind_mps, .frequency_hz = law.frequency_hz()},
      // A calm sea is a mirror; the report has no slopes below 1 m/s.
      surface_slope_(std::min(wind_mps, 1.0) * std::sqrt(0.5 * scatter::facet_slope2(surface_))),
      bed_slope_(bed.sediment ? scatter::rms_slope(*bed.sediment, bed.relief_k_per_cm(law)) : 0.0) {
  constexpr double other_bed_loss_db = 10.0;  // for a bed that is not a sediment; not measured
  for (std::size_t i = 0; i <= sine_steps; ++i) {
    const double loss_db = bottom_loss_db ? *bottom_loss_db
                           : bed.sediment
                               ? scatter::reflection_loss_db(
                                     *bed.sediment, std::asin(static_cast<double>(i) / sine_steps))
                               : other_bed_loss_db;
    bed_reflection_.push_back(scatter::from_db(-loss_db));
  }
}

// Sums of the direct energy up to each bin, divided by the two-way pattern of the direct path.
// Where this pattern suppresses the bed, the bins contain little more than side lobes of the pulse,
// and the echo of a level bed is taken instead.
void Multiples::sum_bed(double slant_m, const BeamPlane& plane, std::span<const float> direct,
                        std::vector<double>& sums) const {
  constexpr double hidden = 1e-5;  // two-way pattern
  const auto horizontal_m = [&](std::size_t n) {
    const double r = law_.range_m(n);
    return std::sqrt(std::max(r * r - slant_m * slant_m, 0.0));
  };
  const auto two_way = [&](std::size_t n) {
    return law_.two_way(plane, law_.range_m(n), horizontal_m(n), slant_m);
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
            bed_.strength_at(plane.cos_pitch * slant_m / r);
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
// asin(a / r), and passes through the bubbles there. The direct echo has the bed's strength at one
// grazing angle, s(g). This echo has two grazing angles, and the strength sqrt(s(g) s(g')). It is
// the same in both directions, and for Lambert's law it is mu sin g sin g' (Ellis and Crowe, JASA
// 89, 2207, 1991). Along the track the beam is as wide as the overlap of the legs' patterns. The
// plane abeam of an array with the pitch p is inclined. In this plane the extents are longer by the
// factor 1 / cos p. A leg that leaves the array downwards meets the bed ahead of the array by sin p
// times its extent, and a leg that leaves upwards meets it as far astern. The leg back meets it
// where the receiver looks when the echo is back.
//
// The relief of surface and bed spreads the sound that they reflect; none of it is coherent at
// these frequencies. A facet that is inclined along the track by t turns a leg with the grazing
// angle g by 2 t sin g. At the bed, this moves the leg along the track by that angle times the
// length of the leg, times the share of the leg between the bed and the reflection. A beam that is
// narrow along the track then receives less.
struct Multiples::Path {
  double out_height_m, back_height_m;  // extents of the leg out and the leg back in the plane
  double count;                        // 2: the legs out and back can be exchanged
  bool up_out, up_back;            // whether the leg out and the leg back leave the array upwards
  bool off_bed;                    // whether the bed reflects the leg back
  double out_spread, back_spread;  // along the track at the bed, over a leg's length and sin g
};

/// The direct echo of the place that a path by the surface comes from.
struct Multiples::Source {
  double range_m;
  double gain;  // energy of the other path, divided by the energy of the direct echo
};

/// The source of the path's echo at a range. bed_m: the bed's distance in the plane.
Multiples::Source Multiples::source_of(const Path& path, double apparent_m, double bed_m,
                                       const BeamPlane& plane) const {
  const double difference =
      path.back_height_m * path.back_height_m - path.out_height_m * path.out_height_m;
  const bool equal_legs = difference == 0.0;
  const double out = equal_legs ? apparent_m : apparent_m - difference / (4.0 * apparent_m);
  const double back = equal_legs ? apparent_m : 2.0 * apparent_m - out;
  const double horizontal_squared =
      std::max(out * out - path.out_height_m * path.out_height_m, 0.0);
  const double r = std::sqrt(horizontal_squared + bed_m * bed_m);
  const double horizontal = std::sqrt(horizontal_squared);
  const double out_down = path.up_out ? -path.out_height_m : path.out_height_m;
  const double back_down = path.up_back ? -path.back_height_m : path.back_height_m;
  const double out_sine = plane.cos_pitch * path.out_height_m / out;
  const double back_sine = plane.cos_pitch * path.back_height_m / back;
  const double spread_m =
      std::hypot(path.out_spread * out_sine * out, path.back_spread * back_sine * back);
  // Both vertical patterns, times the overlap along the track, for sound that goes out by one leg
  // and comes back by the other leg.
  const auto beams = [&](double leg_m, double down, double other_m, double other_down) {
    const double shift_m = apparent_m * (horizontal * plane.turn_level_per_m +
                                         other_down * plane.turn_down_per_m - plane.drift_along);
    return law_.vertical(plane, horizontal, down) *
           law_.vertical_at(plane, apparent_m, horizontal, other_down) *
           beams_.spread_overlap_m(
               leg_m, other_m, std::abs(plane.sin_pitch * (other_down - down) - shift_m), spread_m);
  };
  double both = beams(out, out_down, back, back_down);
  if (path.count > 1.0 && !plane.at_rest())
    both = 0.5 * (both + beams(back, back_down, out, out_down));
  // Spreading and absorption of the legs, divided by those of the direct path.
  const double direct = law_.per_m2_at(r);
  // A direct echo of less than -2900 dB, because water has absorbed it, counts as none: quotients
  // with it would not be numbers.
  constexpr double least_direct = 1e-290;
  if (!(direct > least_direct)) return {r, 0.0};
  const double strengths = bed_.strength_at(out_sine) * bed_.strength_at(back_sine);
  double gain = path.count * both *
                std::sqrt(strengths * law_.per_m2_at(out) * law_.per_m2_at(back)) /
                (bed_.strength_at(plane.cos_pitch * bed_m / r) * direct) / beams_.overlap_m(r, r);
  const auto through_bubbles = [&](double sine) {
    const double grazing_rad = std::asin(std::min(sine, 1.0));
    return scatter::from_db(-scatter::bubble_loss_db(surface_, grazing_rad));
  };
  if (path.up_out) gain *= through_bubbles(out_sine);
  gain *= through_bubbles(back_sine);  // the surface always reflects this leg
  if (path.off_bed) gain *= at_sine(bed_reflection_, std::min(back_sine, 1.0));
  return {r, gain};
}

void Multiples::add(double depth_m, double altitude_m, const BeamPlane& plane,
                    std::span<const float> direct, std::span<float> power,
                    std::vector<double>& sums) const {
  const double per_m = 1.0 / law_.bin_m(), last = static_cast<double>(direct.size());
  const double h = plane.slant_m(altitude_m), d = plane.slant_m(depth_m);
  sum_bed(h, plane, direct, sums);
  // Sum of the direct energy up to a range, without the direct path's pattern.
  const auto energy = [&](double range_m) {
    const double place = std::min(range_m * per_m, last);
    const auto bin = static_cast<std::size_t>(place);
    return sums[bin] + (place - static_cast<double>(bin)) * (sums[bin + 1] - sums[bin]);
  };
  const double by_surface = h + 2.0 * d, by_bed = 3.0 * h + 2.0 * d;
  // From the bed to the surface a leg has (h + d) of its extent, and to a reflection by the bed
  // twice as much.
  const double surface_spread = 2.0 * surface_slope_ * (h + d) / by_surface;
  const double bed_spread = 2.0 * (h + d) / by_bed * std::hypot(surface_slope_, 2.0 * bed_slope_);
  const Path paths[] = {
      {h, by_surface, 2.0, false, true, false, 0.0,
       surface_spread},  // the surface reflects one leg
      {by_surface, by_surface, 1.0, true, true, false, surface_spread,
       surface_spread},                                        // the surface reflects both legs
      {h, by_bed, 2.0, false, false, true, 0.0, bed_spread}};  // surface and bed reflect one leg
  for (const Path& path : paths) {
    const auto source = [&](double apparent_m) { return source_of(path, apparent_m, h, plane); };
    const double first_m = 0.5 * (path.out_height_m + path.back_height_m);
    auto n = static_cast<std::size_t>(first_m / law_.bin_m());
    Source from = source(std::max(static_cast<double>(n) * law_.bin_m(), first_m));
    double energy_before = energy(from.range_m);
    for (const std::size_t begin = n; n < power.size();) {
      const std::size_t to = next_step(n, begin);
      const Source next = source(static_cast<double>(to) * law_.bin_m());
      const double per_bin = 1.0 / static_cast<double>(to - n);
      const double step_m = (next.range_m - from.range_m) * per_bin;
      const double gain_step = (next.gain - from.gain) * per_bin;
      for (; n < std::min(to, power.size()); ++n) {
        from.range_m += step_m;
        from.gain += gain_step;
        const double energy_now = energy(from.range_m);
        power[n] += static_cast<float>(from.gain * (energy_now - energy_before));
        energy_before = energy_now;
      }
      from = next;
    }
  }
}

}  // namespace ensonify::engine
