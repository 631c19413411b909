#include <ensonify/engine/sonar/reception/other_paths.h>

#include <cmath>
#include <numbers>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/reception/bin_steps.h>
#include <ensonify/engine/sonar/reception/textured_ground.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/ground_texture.h>

namespace ensonify::engine {
namespace {

using scatter::GammaTable;
using std::numbers::pi;

constexpr std::size_t directions = 1440;    // per turn, at which VerticalSum takes the pattern
constexpr int max_pings_back = 8;           // earlier pings whose echoes are added
constexpr int directions_of_volume = 4;     // into which the beam is divided, if the sonar turns
constexpr double inaudible = 1e-3;          // share of the noise that is not noticed
constexpr double strip_part_rad = 0.03;     // half of a calm sea's rms slope
constexpr std::size_t max_beam_parts = 32;  // along the track, for the sea surface

/// The part of a horizontal plane (the bed or the surface) between two ranges. `near_m` and `far_m`
/// are horizontal distances in the plane abeam, from its nearest place, which is `slant_m` away.
struct Strip {
  double slant_m, near_m, far_m;
  Strip(double slant_m, double from_m, double to_m)
      : slant_m(slant_m), near_m(horizontal_m(from_m)), far_m(horizontal_m(to_m)) {}

  /// Integral of at(horizontal_m, range_m) over the strip, in parts that are seen under small
  /// angles, because near the vertical one cell receives from a large range of angles.
  template <class At>
  double sum(At&& at) const {
    if (!(far_m > near_m)) return 0.0;
    const double turned_rad = std::atan2(far_m, slant_m) - std::atan2(near_m, slant_m);
    const int parts = 1 + static_cast<int>(turned_rad / strip_part_rad);
    const double part_m = (far_m - near_m) / parts;
    double sum = 0.0;
    for (int i = 0; i < parts; ++i) {
      const double over_m = near_m + (i + 0.5) * part_m;
      sum += at(over_m, std::hypot(over_m, slant_m));
    }
    return sum * part_m;
  }

 private:
  double horizontal_m(double range_m) const {
    return range_m > slant_m ? std::sqrt(range_m * range_m - slant_m * slant_m) : 0.0;
  }
};

}  // namespace

double farthest_earlier_m(const Sonar& sonar, double ping_m) {
  return sonar.range_m + max_pings_back * ping_m;
}

VerticalSum::VerticalSum(const SonarEquation& law, std::size_t sector) : sums_{0.0} {
  constexpr double step = 2.0 * pi / directions;
  for (std::size_t i = 0; i < directions; ++i) {
    const double depression = (static_cast<double>(i) + 0.5) * step;
    const double pattern = law.vertical(sector, std::cos(depression), std::sin(depression));
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
                       const SonarEquation& law, const LevelBed& bed, double ping_m,
                       std::optional<std::uint64_t> seed)
    : options_(options),
      law_(law),
      bed_(bed),
      ping_m_(ping_m),
      surface_{.wind_mps = sea.wind_mps, .frequency_hz = law.frequency_hz()},
      seed_(seed.value_or(0)) {
  for (std::size_t sector = 0; sector < sonar.sectors().size(); ++sector)
    vertical_sums_.emplace_back(law, sector);
  // A leg is shorter than both legs together, which are twice the echo's range.
  if (options.multiples || options.double_bounce)
    beams_.emplace(sonar, law.wavelength_m(), 2.0 * sonar.range_m);
  if (options.multiples)
    multiples_.emplace(law, bed_, *beams_, sea.wind_mps, options.bottom_loss_db);
  if (options.double_bounce)
    double_bounce_.emplace(law, bed_, *beams_,
                           pulse_kernel(sonar.pulse, law.sound_speed_mps(), law.bin_m()));
  for (std::size_t i = 0; options.surface && i <= sine_steps; ++i)
    surface_strength_.push_back(scatter::surface_cross_section(
        surface_, std::asin(std::max(0.5, static_cast<double>(i)) / sine_steps)));
  const double strength = scatter::from_db(sea.volume_scattering_db);
  for (std::size_t bin = 0; options.volume && bin < law.bins(); ++bin)
    volume_.push_back(strength * law.per_m2_at(law.cell_middle_m(bin)) *
                      law.width_m_at(law.cell_middle_m(bin)) * law.cell_middle_m(bin) *
                      law.cell_m());
  if (options.volume && seed && sea.volume_scatterers_per_m3 > 0.0)
    for (std::size_t bin = 0; bin < law.bins(); ++bin) {
      const double range_m = law.cell_middle_m(bin);
      scatterers_.push_back(sea.volume_scatterers_per_m3 * law.width_m_at(range_m) * range_m);
    }
}

void OtherPaths::add(const LineContext& context, const EchoLine& line,
                     std::span<const float> direct, std::span<float> power,
                     std::vector<double>& sums) const {
  // In ranges by travel time: volume and multiples are computed in water of one sound speed.
  const double depth_m = context.range_per_m_up * context.depth_m(),
               altitude_m = context.range_per_m_down * context.altitude_m;
  const BeamPlane plane(context);
  if (options_.second_time_around) add_earlier_pings(context, plane, power);
  if (options_.surface) add_surface(context, plane, power);
  if (options_.volume) add_volume(context, depth_m, altitude_m, plane, power, sums);
  if (multiples_) multiples_->add(depth_m, altitude_m, plane, direct, power, sums);
  if (double_bounce_) double_bounce_->add(context, line, plane, direct, power, sums);
}

// The length over which a bin receives: its range cell, or the bin itself if that is longer.
double OtherPaths::received_m() const { return std::max(law_.cell_m(), law_.bin_m()); }

// At r, the ping before adds the echo from r + c P / 2, the second ping before the echo from r + c
// P, and so on. Each comes from one strip of the bed, in the sector's direction.
void OtherPaths::add_earlier_pings(const LineContext& context, const BeamPlane& plane,
                                   std::span<float> power) const {
  const double altitude_m = context.altitude_m, per_m = context.range_per_m_down;
  const double slant_m = plane.slant_m(altitude_m), noise = power.front();
  const double length_m = received_m() / per_m;
  const auto strength_at = [&](double range_m) {
    return law_.per_m2_at(range_m) * law_.width_m_at(range_m) *
           bed_.strength_at(altitude_m / range_m);
  };
  const auto received = [&](double sum) {
    return plane.slant_m(sum) * law_.cell_m() / (per_m * length_m);
  };
  for (int pings = 1; pings <= max_pings_back; ++pings) {
    const double before_m = pings * ping_m_;
    const auto strip = [&](std::size_t n) {
      const double from_m = (law_.cell_middle_m(n) + before_m) / per_m;
      return Strip(slant_m, from_m - 0.5 * length_m, from_m + 0.5 * length_m);
    };
    const auto intensity = [&](std::size_t n) {
      const double sum = strip(n).sum([&](double over_m, double range_m) {
        return strength_at(range_m) * law_.two_way(plane, range_m, over_m, slant_m, before_m);
      });
      return context.beam_share(n + static_cast<std::size_t>(before_m / law_.bin_m())) *
             received(sum);
    };
    const double first = std::max(per_m * slant_m - before_m, 0.0) / law_.bin_m();
    if (!(first < static_cast<double>(power.size()))) continue;
    auto begin = static_cast<std::size_t>(first);
    while (begin > 0 && strip(begin - 1).far_m > 0.0) --begin;
    // No cell receives more than a cell that begins at the first range and lies on the beam's axis.
    // If this is far below the noise, so are all cells of this ping and of earlier pings.
    const double nearest_m =
        std::max(slant_m, (law_.cell_middle_m(begin) + before_m) / per_m - 0.5 * length_m);
    const Strip longest(slant_m, nearest_m, nearest_m + length_m);
    const double most = received(strength_at(nearest_m) * (longest.far_m - longest.near_m));
    if (most < inaudible * noise) return;
    over_bins(begin, power.size(), intensity,
              [&](std::size_t n, double value) { power[n] += static_cast<float>(value); });
  }
}

/// A part of the beam along the track: the distance of the line in which this part meets the sea
/// surface, and its share of the two-way power.
struct OtherPaths::BeamPart {
  double slant_m, share;
};

// The beam of a pitched array meets the surface first with its edge that is nearer to the vertical.
// The lobe of a calm sea is so narrow that it returns several times as much at this edge as in the
// middle of the beam.
std::span<const OtherPaths::BeamPart> OtherPaths::beam_parts(const BeamPlane& plane, double depth_m,
                                                             std::span<BeamPart> room) const {
  const double slant_m = plane.slant_m(depth_m), cos_pitch = std::max(plane.cos_pitch, 1e-6);
  const double tan_pitch = plane.sin_pitch / cos_pitch;
  room[0] = {slant_m, 1.0};
  if (!(depth_m > 0.0)) return room.first(1);
  const double half_m = 2.0 * law_.width_m_at(slant_m);  // the beam reaches less far to either side
  // By how much the exponent of the lobe, -tan^2 / slope2, changes over the beam.
  const double exponent_change =
      4.0 * half_m * std::abs(tan_pitch) / (cos_pitch * depth_m * scatter::facet_slope2(surface_));
  constexpr double change_in_part = 0.5;
  const auto count = static_cast<std::size_t>(
      std::min(1.0 + exponent_change / change_in_part, static_cast<double>(room.size())));
  if (count == 1) return room.first(1);
  const auto bin = std::min(static_cast<std::size_t>(slant_m / law_.bin_m()), law_.bins() - 1);
  double whole = 0.0;
  std::size_t used = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double part_m = 2.0 * half_m / static_cast<double>(count);
    const double from_m = static_cast<double>(i) * part_m - half_m;
    const double sine = (from_m + 0.5 * part_m) / slant_m;
    const double share = law_.width_share(bin, from_m, from_m + part_m);
    if (!(share > 0.0)) continue;
    room[used++] = {std::hypot(depth_m, depth_m * (tan_pitch - sine / (cos_pitch * cos_pitch))),
                    share};
    whole += share;
  }
  if (used == 0) return room.first(1);
  for (BeamPart& part : room.first(used)) part.share /= whole;
  return room.first(used);
}

// A bin receives two strips of the sea surface: one to port and one to starboard.
void OtherPaths::add_surface(const LineContext& context, const BeamPlane& plane,
                             std::span<float> power) const {
  const double depth_m = context.depth_m(), per_m = context.range_per_m_up;
  const double length_m = received_m() / per_m;
  std::array<BeamPart, max_beam_parts> room;
  const std::span<const BeamPart> parts = beam_parts(plane, depth_m, room);
  const auto strip = [&](std::size_t n, double slant_m) {
    const double range_m = law_.cell_middle_m(n) / per_m;
    return Strip(slant_m, range_m - 0.5 * length_m, range_m + 0.5 * length_m);
  };
  const auto intensity = [&](std::size_t n) {
    double sum = 0.0;
    for (const BeamPart& part : parts)
      sum += part.share * strip(n, part.slant_m).sum([&](double over_m, double range_m) {
        return law_.per_m2_at(range_m) * law_.width_m_at(range_m) *
               at_sine(surface_strength_, depth_m / range_m) *
               (law_.two_way(plane, range_m, over_m, -part.slant_m) +
                law_.two_way(plane, range_m, -over_m, -part.slant_m));
      });
    return context.beam_share(n) * plane.slant_m(sum) * law_.cell_m() / (per_m * length_m);
  };
  const double nearest_m = std::ranges::min(parts, {}, &BeamPart::slant_m).slant_m;
  auto first =
      static_cast<std::size_t>(std::min(per_m * nearest_m / law_.bin_m(), double(power.size())));
  // The cell of a sweep lies on both sides of its bin.
  while (first > 0 && strip(first - 1, nearest_m).far_m > 0.0) --first;
  over_bins(first, power.size(), intensity,
            [&](std::size_t n, double value) { power[n] += static_cast<float>(value); });
}

// A bin receives a shell of water. The shell has no parts above the surface or below the bed. If
// the sonar rolls, both vertical patterns are taken at the mean of their angles. The share of the
// beam along the track that is left because the sonar moves (moved_share()) is computed in some
// directions only.
void OtherPaths::add_volume(const LineContext& context, double depth_m, double altitude_m,
                            const BeamPlane& plane, std::span<float> power,
                            std::vector<double>& random) const {
  const VerticalSum& sum = vertical_sums_[context.sector];
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
  // The strengths of scatterers are exponentially distributed. So the sum of n of them has a gamma
  // distribution of the shape n, and the echo a K distribution (Abraham and Lyons, IEEE J. Oceanic
  // Eng. 27, 800, 2002). The scatterers drift, and the beam has left most of them before the next
  // ping, which meets other scatterers.
  const double received_m = this->received_m();
  const bool few = !scatterers_.empty();
  const auto received_at = [&](std::size_t n) {
    return static_cast<std::size_t>(law_.cell_middle_m(n) / received_m);
  };
  if (few) {
    random.resize(received_at(power.size() - 1) + 1);
    RandomStream(seed_, Purpose::water_scatterers,
                 {context.ping, static_cast<std::uint64_t>(context.beam), context.facing.number})
        .uniform(random);
  }
  const auto share_of_mean = [&](std::size_t n, double width) {
    const double count = scatterers_[n] * width * law_.cell_m();
    return double{TexturedGround::quantiles().value(
        GammaTable::row_of(std::log2(count)),
        GammaTable::column_of(static_cast<float>(random[received_at(n)])))};
  };
  const auto add = [&](std::size_t n, double width) {
    const double mean = context.beam_share(n) * volume_[n] * width;
    power[n] += static_cast<float>(few && width > 0.0 ? mean * share_of_mean(n, width) : mean);
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

}  // namespace ensonify::engine
