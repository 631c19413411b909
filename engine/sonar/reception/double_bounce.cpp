#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/sonar/reception/double_bounce.h>
#include <ensonify/scatter/forward_lobe.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

/// Spreads energy evenly over the bins between two places, in bins.
void spread_over(double from_bin, double to_bin, double energy, std::span<double> energies) {
  const auto [first, last] = std::minmax({from_bin, to_bin});
  const double bins = last - first;
  for (auto n = static_cast<std::size_t>(first); n < energies.size(); ++n) {
    const double end = static_cast<double>(n) + 1.0;
    const double share = std::min(end, last) - std::max(end - 1.0, first);
    energies[n] += bins > 1e-6 ? energy * share / bins : energy;
    if (last < end || !(bins > 1e-6)) return;
  }
}

}  // namespace

DoubleBounce::DoubleBounce(const SonarEquation& law, const LevelBed& bed, const OneWayBeams& beams,
                           PulseKernel pulse)
    : law_(law),
      bed_(bed),
      beams_(beams),
      pulse_(std::move(pulse)),
      k_per_cm_(bed.sediment ? bed.relief_k_per_cm(law) : 0.0) {}

/// The sound of the array that a wall mirrors onto a line of the bed along the track, and the array
/// that receives it from there. Distances are from the middles of both beams.
struct DoubleBounce::MirroredBeam {
  double image_m, receiver_m;  // from the array's image and from the array to the line
  double begin_m, end_m;       // part of the line to which the wall mirrors the image
  double shift_m;              // from the image's middle to the receiver's
  double blur_m;               // rms blur of the image along the line
};

/// The integral along the line of both one-way patterns.
double DoubleBounce::mirrored_m(const MirroredBeam& beam) const {
  constexpr int steps = 32;
  const double image_reach_m = beams_.main_m(beam.image_m);
  const double begin_m = std::max(beam.begin_m, -image_reach_m);
  const double step_m = (std::min(beam.end_m, image_reach_m) - begin_m) / steps;
  if (!(step_m > 0.0)) return 0.0;
  // The blurred beam of the receiver: a Gaussian with the integral and peak of the beam, then
  // widened.
  const double peak = beams_.power(OneWayBeams::receiver, beam.receiver_m, 0.0);
  double width_m = 0.0;
  const double reach_m = beams_.main_m(beam.receiver_m), cell_m = 2.0 * reach_m / steps;
  for (int i = 0; i < steps / 2; ++i)
    width_m +=
        2.0 * cell_m * beams_.power(OneWayBeams::receiver, beam.receiver_m, (i + 0.5) * cell_m);
  const double rms_m = width_m / std::max(peak, 1e-9) / std::sqrt(2.0 * pi);
  const double blurred_m = std::hypot(rms_m, beam.blur_m);
  const bool sharp = beam.blur_m < 0.2 * rms_m;
  const auto received = [&](double along_m) {
    if (sharp) return beams_.power(OneWayBeams::receiver, beam.receiver_m, along_m);
    const double x = along_m / blurred_m;
    return width_m / (std::sqrt(2.0 * pi) * blurred_m) * std::exp(-0.5 * x * x);
  };
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double along_m = begin_m + (i + 0.5) * step_m;
    sum += beams_.power(OneWayBeams::transmitter, beam.image_m, along_m) *
           received(along_m + beam.shift_m);
  }
  return sum * step_m;
}

/// A wall and the bed in front of it. x: distance abeam, z: height above the bed.
struct DoubleBounce::WallOverBed {
  const WallFacet& facet;
  double x_m;                      // of the wall
  double array_height_m;           // above the bed
  double low_m, high_m;            // of the wall
  double begin_m, end_m;           // along the track, from the beam's middle
  double turned_rad, upwards_rad;  // of its normal
  std::size_t bed_bin;             // the last bin of bed in front of the wall's bin

  static constexpr double lowest_rad = 0.01;  // of sound that reaches the bed after the wall

  /// The depression of sound from the wall to the bed.
  double depression_rad(double z_m) const {
    return std::atan2(array_height_m - z_m, x_m) - 2.0 * upwards_rad;
  }
  /// From the array to where that sound meets the bed.
  double range_on_bed_m(double z_m) const {
    const double before_m = z_m / std::tan(std::max(depression_rad(z_m), lowest_rad));
    return std::hypot(x_m - before_m * std::cos(2.0 * turned_rad), array_height_m);
  }
  /// The range of the path: array, wall, bed, array.
  double appears_at_m(double z_m) const {
    const double before_m = z_m / std::tan(std::max(depression_rad(z_m), lowest_rad));
    return 0.5 * (std::hypot(x_m, array_height_m - z_m) + std::hypot(before_m, z_m) +
                  range_on_bed_m(z_m));
  }
};

/// None if the wall sends the sound away from the array, or has no bed in front of it.
std::optional<DoubleBounce::WallOverBed> DoubleBounce::wall_over_bed(const LineContext& context,
                                                                     const EchoLine& line,
                                                                     const WallFacet& wall) const {
  const Eigen::Vector3d abeam =
      context.facing.out * context.array.axis.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d along =
      Eigen::Vector3d(context.array.axis.x(), context.array.axis.y(), 0.0).normalized();
  const double facing = -wall.normal.dot(abeam), aside = wall.normal.dot(along);
  if (!(facing > std::abs(aside))) return std::nullopt;
  const double tangent = aside / facing, turned_rad = std::atan(tangent);
  const double upwards_rad = std::asin(std::clamp(wall.normal.z(), -1.0, 1.0));
  // The wall's ends along the track, and its distance where it is nearest to the beam's middle.
  const double middle_m = wall.middle.dot(along);
  const double half_m = 0.5 * wall.length_m * std::cos(turned_rad);
  const double begin_m = middle_m - half_m, end_m = middle_m + half_m;
  const double x_m =
      wall.middle.dot(abeam) + (std::clamp(0.0, begin_m, end_m) - middle_m) * tangent;
  if (!(x_m > 0.0)) return std::nullopt;
  const std::vector<std::uint32_t>& regions = line.bins.region;
  auto bed = static_cast<std::size_t>(std::hypot(x_m, wall.middle.z()) / bin_length_m(context));
  bed = std::min(bed, regions.size() - 1);
  while (bed > 0 && regions[bed] != static_cast<std::uint32_t>(Region::seabed)) --bed;
  if (bed == 0) return std::nullopt;
  const double height_m = context.array.origin.z() - double(line.bins.z_m[bed]);
  if (!(height_m > 0.0)) return std::nullopt;
  const double tall_m = 0.5 * wall.height_m * std::cos(upwards_rad);
  return WallOverBed{.facet = wall,
                     .x_m = x_m,
                     .array_height_m = height_m,
                     .low_m = std::max(height_m + wall.middle.z() - tall_m, 0.0),
                     .high_m = std::min(height_m + wall.middle.z() + tall_m, 0.99 * height_m),
                     .begin_m = begin_m,
                     .end_m = end_m,
                     .turned_rad = turned_rad,
                     .upwards_rad = upwards_rad,
                     .bed_bin = bed};
}

// A wall mirrors the array: the bed in front of the wall receives sound from an image of the array
// behind the wall. The wall acts as a window for this sound. If the wall is upright, the path array
// - wall - bed - array is nearly as long for each place of the bed as the path to the wall's foot
// and back. In the direction abeam let the wall be at the distance x, the array H above the bed,
// and the normal of the wall turned away from the array by the angle a, to the side, and by t,
// upwards. Sound that meets the wall z above the bed, at the depression g, tan g = (H - z) / x,
// leaves it at the depression g' = g - 2 t, turned by 2 a to the side, and meets the bed at the
// distance z / tan g' in front of the wall. From there the array receives it. If the wall is wide,
// upright and faces the sonar, the beams of the image and of the array overlap. If the wall is
// oblique, they separate, and more so farther from the wall. If the wall is narrow, only a part of
// the image's beam passes it. Along the track the image is blurred by the inclinations of the
// wall's surface, with the rms slope s by 2 s times the distance from the wall, and by diffraction:
// sinc^2(L sin / lambda) has the peak and the integral of a Gaussian with the rms angle lambda /
// (sqrt(2 pi) L).
//
// Seen from the bed, sound from the wall continues forwards, near the specular direction, turned by
// 2 a: it has the strength of the bed's forward lobe and, around it, sqrt(s(g) s(g')) as in a
// multiple. For each place the paths in both directions are equal, so their amplitudes add:
// together they have four times the energy of one path. Left out: rough walls that send sound up or
// farther down than smooth ones.
//
// The bed that the wall mirrors must be seen: in front of a deck house is the deck, and behind a
// hull the bed lies in shadow.
void DoubleBounce::add(const LineContext& context, const EchoLine& line, const BeamPlane& plane,
                       std::span<const float> direct, std::span<float> power,
                       std::vector<double>& energies) const {
  if (line.walls.empty()) return;
  energies.assign(power.size(), 0.0);
  for (const WallFacet& facet : line.walls)
    if (const std::optional<WallOverBed> wall = wall_over_bed(context, line, facet))
      add_wall(context, line, *wall, plane, direct, energies);
  // The energies contain the sum of the pulse already, because they come from the direct echo. Only
  // its shape is applied.
  const double all = std::accumulate(pulse_.weights.begin(), pulse_.weights.end(), 0.0);
  for (std::size_t from = 0; from < energies.size(); ++from)
    for (std::size_t i = 0; energies[from] > 0.0 && i < pulse_.weights.size(); ++i) {
      const auto to = static_cast<std::ptrdiff_t>(from + i) + pulse_.first;
      if (to >= 0 && to < std::ssize(power))
        power[static_cast<std::size_t>(to)] +=
            static_cast<float>(energies[from] * pulse_.weights[i] / all);
    }
}

/// Whether the array sees the bed at that range, before_m in front of the wall. Only the upper
/// parts of the wall may be at that range as well, with a stronger echo than the bed.
bool DoubleBounce::sees_bed(const LineContext& context, const BinLayers& bins,
                            const WallOverBed& wall, double range_m, double before_m) const {
  const auto bin = static_cast<std::size_t>(range_m / bin_length_m(context));
  if (bin >= bins.region.size()) return false;
  if (bins.region[bin] != static_cast<std::uint32_t>(Region::object))
    return bins.region[bin] == static_cast<std::uint32_t>(Region::seabed);
  const double over_m = std::hypot(double(bins.x_m[bin]) - context.array.origin.x(),
                                   double(bins.y_m[bin]) - context.array.origin.y());
  return over_m > wall.x_m - 0.5 * before_m - bin_length_m(context);
}

void DoubleBounce::add_wall(const LineContext& context, const EchoLine& line,
                            const WallOverBed& wall, const BeamPlane& plane,
                            std::span<const float> direct, std::span<double> energies) const {
  constexpr int max_steps = 16;
  const double x_m = wall.x_m, height_m = wall.array_height_m, bin_m = bin_length_m(context);
  const double bins =
      std::abs(wall.range_on_bed_m(wall.high_m) - wall.range_on_bed_m(wall.low_m)) / bin_m;
  const int steps = static_cast<int>(std::clamp(std::ceil(bins), 1.0, double(max_steps)));
  const double step_m = (wall.high_m - wall.low_m) / steps;
  const auto level_bed = [&](double range_m) {
    const double sine = std::min(height_m / range_m, 1.0);
    return law_.level_bed(plane, range_m, sine) * bed_.strength_at(sine);
  };
  for (int i = 0; i < steps && step_m > 0.0; ++i) {
    const double z_m = wall.low_m + (i + 0.5) * step_m;
    const double in_rad = wall.depression_rad(z_m);
    if (!(in_rad > WallOverBed::lowest_rad && in_rad < 0.5 * pi)) continue;
    const double before_m = z_m / std::tan(in_rad), to_wall_m = std::hypot(x_m, height_m - z_m);
    if (!(before_m < x_m)) continue;
    const double image_m = to_wall_m + std::hypot(before_m, z_m);
    const double range_m = wall.range_on_bed_m(z_m);
    if (!sees_bed(context, line.bins, wall, range_m, before_m)) continue;
    const double below_m = z_m - 0.5 * step_m, above_m = z_m + 0.5 * step_m;
    const double bins_of_step =
        std::abs(wall.range_on_bed_m(above_m) - wall.range_on_bed_m(below_m)) / bin_m;
    // A rough wall also turns the sound that the array receives, within its beam.
    const double spread_rad =
        std::min(2.0 * wall.facet.slope, std::atan2(beams_.main_m(range_m), before_m));
    const double sine_in = std::sin(in_rad), sine_out = std::min(height_m / range_m, 1.0);
    const double direct_strength = bed_.strength_at(sine_out);
    double forwards = std::sqrt(bed_.strength_at(sine_in) * direct_strength);
    if (bed_.sediment)
      forwards += scatter::forward_lobe(*bed_.sediment, k_per_cm_, in_rad, std::asin(sine_out),
                                        std::hypot(2.0 * wall.turned_rad, spread_rad));
    const double beyond = (x_m + before_m) / x_m;
    const double mirrored = mirrored_m(
        {.image_m = image_m,
         .receiver_m = range_m,
         .begin_m = wall.begin_m * beyond,
         .end_m = wall.end_m * beyond,
         .shift_m = before_m * std::tan(2.0 * wall.turned_rad),
         .blur_m = std::hypot(2.0 * wall.facet.slope * before_m,
                              law_.wavelength_m() / (std::sqrt(2.0 * pi) * wall.facet.length_m) *
                                  (image_m - to_wall_m))});
    const double to_bed = law_.vertical(plane, x_m - before_m, height_m);
    const double to_wall = law_.vertical(plane, x_m, height_m - z_m);
    // Energy of the path over the wall, relative to the direct echo of the same place.
    const double gain = forwards / direct_strength *
                        std::sqrt(law_.per_m2_at(image_m) / law_.per_m2_at(range_m)) * to_wall /
                        to_bed * mirrored / beams_.overlap_m(range_m, range_m);
    const auto own_bin = static_cast<std::size_t>(range_m / bin_m);
    const std::size_t bin = std::min(own_bin, wall.bed_bin);
    double bed = double(direct[bin]);
    // Near the wall, the direct echo contains the wall, too. There the bed is continued as level.
    if (bin < own_bin && bed > 0.0) {
      const double there = level_bed(law_.cell_middle_m(bin) / context.range_per_m_down);
      bed = there > 0.0 ? bed * level_bed(range_m) / there : 0.0;
    }
    spread_over(wall.appears_at_m(below_m) / bin_m, wall.appears_at_m(above_m) / bin_m,
                4.0 * wall.facet.reflected * gain * bins_of_step * bed, energies);
  }
}

}  // namespace ensonify::engine
