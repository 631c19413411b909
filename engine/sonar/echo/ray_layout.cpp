#include <ensonify/engine/sonar/echo/ray_layout.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/trace/beam_ranges.h>
#include <ensonify/engine/trace/nearest_floats.h>

namespace ensonify::engine {

namespace {

/// Samples the beam over the azimuths of a plane: two Gauss points in each of some equal parts.
/// null_rad: the first null without shading, by which side lobes are spaced with any shading.
void add_samples(const FanGrid::Plane& plane, double null_rad, std::vector<BeamSample>& samples) {
  const double azimuth = std::asin(plane.sin_azimuth);
  // Where only the near field reaches, the beam changes over a larger angle.
  const double part_rad = 0.5 * null_rad * std::cbrt(std::max(1.0, std::abs(azimuth) / null_rad));
  const int parts = static_cast<int>(std::ceil(plane.width_rad / part_rad * (1.0 - 1e-9)));
  const double width = plane.width_rad / parts;
  for (int i = 0; i < parts; ++i)
    for (const double sign : {-1.0, 1.0}) {
      const double middle = azimuth - 0.5 * plane.width_rad + (i + 0.5) * width;
      samples.push_back({static_cast<float>(std::sin(middle + sign * width / std::sqrt(12.0))),
                         static_cast<float>(0.5 * width)});
    }
}

/// The angle from broadside to which the pattern of an array reaches at a range: to one of its
/// nulls, and in the near field farther, by the angle of half the array's length times its defocus.
double reach_rad(const LineArray& array, int null, double defocus, double at_m) {
  const double near_rad = std::atan(0.5 * array.length_m * std::abs(defocus) / at_m);
  return std::min(array.null_rad(null) + near_rad, std::numbers::pi / 2.0);
}

/// The first null of the narrower array, in the far field.
double first_null_rad(const LineArray& transmit, const LineArray& receive) {
  return std::min(transmit.null_rad(1), receive.null_rad(1));
}

/// By elevation: how many rays from it on may form one piece. Their steps must be equal, and the
/// vertical pattern over them must be nearly a straight line. (How their ranges differ depends on
/// the face: limit_runs().)
std::vector<std::uint8_t> max_rays_per_piece(const std::vector<double>& elevation_rad,
                                             double middle_depression_rad, const Sonar& sonar,
                                             const std::optional<Element>& element) {
  constexpr double widest_rad = 0.01, unevenness = 0.05, bend = 0.002;
  constexpr std::size_t most = 255;
  std::vector<std::vector<double>> powers;  // one-way, by sector
  for (const Sector& sector : sonar.sectors()) {
    if (sector.element != element) continue;
    std::vector<double>& power = powers.emplace_back();
    for (const double angle_rad : elevation_rad)
      power.push_back(sonar.vertical.power(middle_depression_rad - angle_rad, sector));
  }
  // Whether a ray is in the middle of the elevations that it stands for.
  const auto even = [&](std::size_t j) {
    if (j == 0 || j + 1 >= elevation_rad.size()) return false;
    const double below = elevation_rad[j] - elevation_rad[j - 1];
    const double above = elevation_rad[j + 1] - elevation_rad[j];
    return std::abs(above - below) < unevenness * below;
  };
  // Whether the pattern is nearly straight from the neighbours below the rays to the neighbours
  // above, because the kernel takes the beam's slope from the difference of these neighbours.
  const auto straight = [&](std::size_t j, std::size_t rays) {
    const std::size_t from = j - std::min(j, rays);
    const std::size_t last = std::min(j + 2 * rays, elevation_rad.size()) - 1;
    const double length_rad = elevation_rad[last] - elevation_rad[from];
    for (const std::vector<double>& power : powers)
      for (const std::size_t k : {j, j + rays - 1}) {
        const double share = (elevation_rad[k] - elevation_rad[from]) / length_rad;
        if (std::abs(std::lerp(power[from], power[last], share) - power[k]) > bend * power[k])
          return false;
      }
    return true;
  };
  std::vector<std::uint8_t> max_rays;
  for (std::size_t j = 0; j < elevation_rad.size(); ++j) {
    std::size_t rays = 1;
    while (even(j) && rays < most && even(j + rays) &&
           elevation_rad[j + rays] - elevation_rad[j] < widest_rad)
      ++rays;
    while (rays > 2 && !straight(j, rays)) rays /= 2;
    max_rays.push_back(static_cast<std::uint8_t>(rays));
  }
  return max_rays;
}

/// Fills in the angles of the layout's rays, and which rays are within the beam.
void set_grid(std::shared_ptr<const FanGrid> grid, RayLayout& layout) {
  layout.grid = std::move(grid);
  layout.rays = 0;
  layout.directions.clear();
  layout.edge_rad.clear();
  layout.within.resize(layout.grid->planes.size());
  for (std::size_t plane = 0; plane < layout.grid->planes.size(); ++plane) {
    std::vector<RayLayout::Stretch>& stretches = layout.within[plane];
    stretches.clear();
    for_beam_ranges(*layout.grid, plane, [&](std::size_t from, std::size_t until, bool within) {
      if (!within) return;
      stretches.push_back({from, until});
      layout.rays += until - from;
    });
  }
  const std::vector<double>& elevation_rad = layout.grid->elevation_rad;
  const std::size_t count = elevation_rad.size();
  const auto add = [&](double angle_rad) {
    layout.directions.push_back({std::cos(angle_rad), std::sin(angle_rad)});
  };
  layout.edge_rad.push_back(elevation_rad.front());
  for (std::size_t j = 0; j < count; ++j) {
    const double halfway_rad = 0.5 * (elevation_rad[j] + elevation_rad[std::min(j + 1, count - 1)]);
    add(elevation_rad[j]);
    add(halfway_rad);
    layout.edge_rad.push_back(halfway_rad);
  }
}

/// How the fan of a sector lies in the water, and where rays of it do not reach a level bed.
struct FanInWater {
  double roll_tilt_rad;
  // Sine of a depression, divided by the sine of the angle below the abeam axis.
  double level_share;
  double planes_rad;  // how far the planes of the main lobe differ in depression, by pitch
  LaunchLimits limits;

  /// The elevations of the limits, ascending. The first limit is taken from the plane in which its
  /// elevation is highest, because rays lie close together only on the side that reaches the bed.
  std::array<double, 3> limit_elevations_rad(double middle_depression_rad) const {
    const auto elevation_rad = [&](double depression_rad) {
      return middle_depression_rad + roll_tilt_rad -
             std::asin(std::clamp(std::sin(depression_rad) / level_share, -1.0, 1.0));
    };
    return {elevation_rad(limits.grazing_rad) + planes_rad, elevation_rad(-limits.grazing_rad),
            elevation_rad(-limits.surface_rad)};
  }
};

/// Sets `result`, with `grid`, to the layout with its rays moved: rays that lay at the limits then
/// lie at the present limits, because near a limit a millionth of an angle is metres of the bed.
/// Rays between two limits divide the angle between them as before.
void move_in_water(const RayLayout& layout, const FanInWater& laid_for, const FanInWater& now,
                   const std::shared_ptr<FanGrid>& grid, RayLayout& result) {
  *grid = *layout.grid;
  std::vector<double>& elevation_rad = grid->elevation_rad;
  struct Shift {
    double from_rad, to_rad;
  };
  const std::array from_rad = laid_for.limit_elevations_rad(grid->middle_depression_rad),
                   to_rad = now.limit_elevations_rad(grid->middle_depression_rad);
  std::array<Shift, 5> moved;  // the limits and both ends
  const double end_rad = elevation_rad.back();
  moved[0] = {elevation_rad.front(), elevation_rad.front()};
  std::size_t last = 0;
  for (std::size_t i = 0; i < from_rad.size(); ++i)
    if (std::min(from_rad[i] - moved[last].from_rad, to_rad[i] - moved[last].to_rad) > 0.0 &&
        std::max(from_rad[i], to_rad[i]) < end_rad)
      moved[++last] = {from_rad[i], to_rad[i]};
  moved[++last] = {end_rad, end_rad};
  std::size_t next = 1;
  for (std::size_t j = 0; j < elevation_rad.size(); ++j) {
    while (next < last && elevation_rad[j] > moved[next].from_rad) ++next;
    const Shift &before = moved[next - 1], &after = moved[next];
    elevation_rad[j] =
        std::lerp(before.to_rad, after.to_rad,
                  (elevation_rad[j] - before.from_rad) / (after.from_rad - before.from_rad));
    grid->sin_elevation[j] = std::sin(elevation_rad[j]);
    grid->cos_elevation[j] = std::cos(elevation_rad[j]);
  }
  result.samples = layout.samples;
  result.first_sample = layout.first_sample;
  result.max_rays_per_piece = layout.max_rays_per_piece;  // equal steps stay equal
  set_grid(grid, result);
}

}  // namespace

RayLayout make_ray_layout(const Sonar& sonar, double wavelength_m, double range_over_height,
                          const std::optional<Element>& element, double roll_tilt_rad,
                          double drift_rad, double nearest_share, double rise_rad,
                          std::span<const LaunchRange> bent) {
  const LineArray transmit = sonar.transmit_array(wavelength_m);
  const LineArray receive = sonar.receive_array(wavelength_m);
  const double first_return_m = sonar.range_m / range_over_height;
  // The transmitter is as far from an outer beam as this beam is from the array's middle.
  const double beam_offset_m = sonar.beam_offset_m(sonar.parallel_beams() - 1);
  // No more lobes than needed, because the planes are spread over them.
  const auto lobes = [&](double aside_rad) {
    return std::clamp(static_cast<int>(std::ceil(aside_rad / transmit.null_rad(1))), 1,
                      sonar.lobes_beyond());
  };
  const auto reach = [&](int null, double drifting_rad, double nearest_m) {
    const double worst_m = sonar.most_defocused_m(nearest_m);
    const double offset_rad =
        sonar.parallel_beams() > 1 ? std::atan(beam_offset_m / nearest_m) : 0.0;
    const double sent_rad = sonar.parallel_beams() > 1
                                ? reach_rad(transmit, null, 1.0, nearest_m)
                                : reach_rad(transmit, null, sonar.defocus(worst_m), worst_m);
    const double received_rad = reach_rad(receive, null, sonar.defocus(worst_m), worst_m);
    return std::min(
        offset_rad + sent_rad +
            next_lobe_rad(drifting_rad, sent_rad, transmit.null_rad(lobes(drifting_rad))),
        received_rad + drifting_rad +
            next_lobe_rad(offset_rad, sent_rad, receive.null_rad(lobes(offset_rad))));
  };
  const double wider = reach(1, drift_rad, first_return_m) / reach(1, 0.0, first_return_m);
  const double lobes_sine =
      receive.wavelength_m / receive.length_m * receive.shading.null_x(sonar.side_lobes + 1);
  const double steered_reach_rad =
      std::asin(std::min(std::sin(0.5 * sonar.field_of_view_rad) + lobes_sine, 1.0));
  RayLayout layout;
  auto grid = std::make_shared<const FanGrid>(FanLayout{
      .sector_low_rad = sonar.lowest_rad({.element = element}),
      .sector_high_rad = sonar.highest_rad({.element = element}),
      .truncation_rad =
          sonar.steers() ? steered_reach_rad
                         : reach(sonar.side_lobes + 1, drift_rad, nearest_share * first_return_m),
      .main_lobe_rad = wider * first_null_rad(transmit, receive),
      .main_beam_rad = reach(1, drift_rad, first_return_m),
      .planes = 2 * static_cast<int>(std::ceil(0.5 * wider * sonar.planes)),
      .sine_step = sonar.steers() ? sonar.sine_step(wavelength_m) : 0.0,
      .elevations = sonar.elevations,
      .range_over_height = range_over_height,
      .roll_tilt_rad = roll_tilt_rad,
      .rise_rad = rise_rad,
      .bent = bent,
  });
  const double longest_m = std::max(transmit.length_m, receive.length_m);
  const double lobe_rad = LineArray{longest_m, wavelength_m}.null_rad(1);
  for (const FanGrid::Plane& plane : grid->planes) {
    layout.first_sample.push_back(layout.samples.size());
    add_samples(plane, lobe_rad, layout.samples);
  }
  layout.first_sample.push_back(layout.samples.size());
  layout.max_rays_per_piece =
      max_rays_per_piece(grid->elevation_rad, grid->middle_depression_rad, sonar, element);
  set_grid(std::move(grid), layout);
  return layout;
}

double planes_apart_rad(const Sonar& sonar, double wavelength_m) {
  return 2.0 / sonar.planes *
         first_null_rad(sonar.transmit_array(wavelength_m), sonar.receive_array(wavelength_m));
}

double trace_range_m(const Sonar& sonar, double sound_speed_mps) {
  // The highest closing speed at which the last bins get all echoes.
  constexpr double closing_mps = 3.0;
  return sonar.range_m +
         std::max(sonar.pulse.cell_m(sound_speed_mps) + 2.0 * sonar.bin_m(), 0.01 * sonar.range_m) +
         closing_mps * sonar.pulse.closing_shift_s(sonar.frequency_hz);
}

double roll_tilt_rad(const Pose& pose, const Sector& sector) {
  const Eigen::Matrix3d body = body_to_world(pose);
  const double out = sector.out * body(2, 1);
  return std::atan2(-out, -body(2, 2));
}

RayFan place_fan(const RayLayout& layout, const Pose& pose, const Sector& sector, double range_m) {
  const Eigen::Matrix3d body = body_to_world(pose);
  const Eigen::Vector3d abeam = sector.out * body.col(1);
  const Eigen::Vector3d down = body.col(2);
  const double c = std::cos(layout.grid->middle_depression_rad);
  const double s = std::sin(layout.grid->middle_depression_rad);
  return {layout.grid,          nearest_floats(pose.position), body.col(0),
          c * abeam + s * down, s * abeam - c * down,          range_m};
}

RayLayouts::RayLayouts(const Sonar& sonar, double wavelength_m)
    : sonar_(sonar),
      wavelength_m_(wavelength_m),
      sent_rad_(sonar.transmit_array(wavelength_m).null_rad(sonar.side_lobes + 1)),
      received_rad_(sonar.receive_array(wavelength_m).null_rad(sonar.side_lobes + 1)),
      main_lobe_rad_(
          first_null_rad(sonar.transmit_array(wavelength_m), sonar.receive_array(wavelength_m))) {}

std::shared_ptr<const RayLayout> RayLayouts::at(const Pose& pose, const Sector& sector,
                                                double altitude_m, double nearest_m,
                                                double drift_rad, double rise_rad) {
  constexpr std::size_t max_kept = 256;  // only a bed that rises, or bent rays, make so many
  constexpr double steps_per_octave = 4.0;
  constexpr double roll_tilt_step_rad = 0.5 * degree;
  const auto step_of = [&](double range_m) {
    const double lowest_m = 1e-3 * sonar_.range_m;
    return static_cast<int>(std::floor(steps_per_octave * std::log2(std::max(range_m, lowest_m))));
  };
  const int step = step_of(altitude_m), nearest_step = step_of(nearest_m);
  const double tilt_rad = roll_tilt_rad(pose, sector);
  const int roll_tilt_step = static_cast<int>(std::lround(tilt_rad / roll_tilt_step_rad));
  // If the receiver's lobes are as wide as the transmitter's, and it looks nearly in the same
  // direction, it receives all that the transmitter insonifies, and no extra planes are needed.
  const bool drifts = !sonar_.steers() && (sonar_.beams > 1 || received_rad_ < sent_rad_ ||
                                           drift_rad > 0.5 * sent_rad_);
  const double drift_step_rad = std::max(1e-3, 0.25 * received_rad_);
  const int drift_step = drifts ? static_cast<int>(std::ceil(drift_rad / drift_step_rad)) : 0;
  const double height_m = std::exp2(step / steps_per_octave);
  const double rise_step_rad = 0.5 * height_m / sonar_.range_m;
  const int rise_step = rise_rad > 0.0 ? static_cast<int>(std::ceil(rise_rad / rise_step_rad)) : 0;
  // Near the turning point, a depth change of centimetres moves a ray's hit by tens of metres, so
  // the steps are finer, and move_in_water() does the rest.
  constexpr double bent_steps_per_octave = 16.0, bent_depth_share = 0.02;
  const double depth_m = std::max(-pose.position.z(), 0.0),
               over_bed_m = std::max(altitude_m, height_m);
  const int bent_step =
      profile_ ? static_cast<int>(std::lround(bent_steps_per_octave * std::log2(over_bed_m))) : 0;
  const double bent_height_m = std::exp2(bent_step / bent_steps_per_octave);
  const double depth_step_m = bent_depth_share * height_m;
  const int depth_step = profile_ ? static_cast<int>(std::lround(depth_m / depth_step_m)) : 0;
  const int element = sector.element ? static_cast<int>(sector.number) : -1;
  const std::array key{element,    step,      nearest_step, roll_tilt_step,
                       drift_step, rise_step, depth_step,   bent_step};
  if (!made_.contains(key) && made_.size() >= max_kept) {
    made_.clear();
    bent_.clear();
  }
  const BentRanges* bent = nullptr;
  if (profile_) {
    const auto [ranges, is_new] = bent_.try_emplace({step, bent_step, depth_step});
    if (is_new) {
      ranges->second = bent_ranges(*profile_, {.source_depth_m = depth_step * depth_step_m,
                                               .height_m = bent_height_m,
                                               .reference_mps = reference_mps_,
                                               .range_m = sonar_.range_m});
      for (LaunchRange& launch : ranges->second.by_launch)
        launch.range_over_height *= bent_height_m / height_m;
    }
    bent = &ranges->second;
  }
  const double laid_tilt_rad = roll_tilt_step * roll_tilt_step_rad;
  std::shared_ptr<const RayLayout>& layout = made_[key];
  if (!layout)
    layout = std::make_shared<const RayLayout>(make_ray_layout(
        sonar_, wavelength_m_, sonar_.range_m / height_m, sector.element, laid_tilt_rad,
        drift_step * drift_step_rad, std::exp2((nearest_step - step) / steps_per_octave),
        rise_step * rise_step_rad,
        bent ? std::span(bent->by_launch) : std::span<const LaunchRange>()));
  if (!bent) return layout;
  const Eigen::RowVector3d downwards = -body_to_world(pose).row(2);
  const FanInWater laid_for{.roll_tilt_rad = laid_tilt_rad,
                            .level_share = 1.0,
                            .planes_rad = 0.0,
                            .limits = bent->limits};
  const FanInWater now{.roll_tilt_rad = tilt_rad,
                       .level_share = std::max(downwards.tail<2>().norm(), 1e-6),
                       .planes_rad = std::abs(downwards.x()) * main_lobe_rad_,
                       .limits = launch_limits(*profile_, depth_m, depth_m + over_bed_m)};
  Moved& moved = unused(*layout->grid);
  move_in_water(*layout, laid_for, now, moved.grid, *moved.layout);
  return moved.layout;
}

RayLayouts::Moved& RayLayouts::unused(const FanGrid& grid) {
  // The grid is held by this entry and by the layout.
  const auto is_unused = [](const Moved& moved) {
    return moved.layout.use_count() == 1 && moved.grid.use_count() <= 2;
  };
  const auto found = std::ranges::find_if(moved_, is_unused);
  if (found != moved_.end()) return *found;
  moved_.push_back({std::make_shared<RayLayout>(), std::make_shared<FanGrid>(grid)});
  return moved_.back();
}

}  // namespace ensonify::engine
