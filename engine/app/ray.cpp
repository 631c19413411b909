#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/tables/profile_reader.h>
#include <ensonify/scatter/eigenray.h>

#include "app.h"

namespace ensonify::engine::app {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double between_rows_m = 1e-4;  // largest distance of the ray from lines between rows
constexpr int max_rows = 2000000;        // about 200 MB of text

struct RayArguments {
  std::filesystem::path profile;
  double source_depth_m = 0.0;
  std::optional<double> launch_deg, range_m, target_range_m, target_depth_m, bottom_depth_m;
};

scatter::SoundRay launched(const scatter::SoundSpeedProfile& profile, const RayArguments& arguments,
                           double bottom_m) {
  const double rad = *arguments.launch_deg * degree;
  return {profile, arguments.source_depth_m, std::cos(rad), std::sin(rad), 0.0, bottom_m};
}

scatter::SoundRay eigenray(const scatter::SoundSpeedProfile& profile, const RayArguments& arguments,
                           double bottom_m) {
  const double range_m = *arguments.target_range_m, depth_m = *arguments.target_depth_m;
  const auto found =
      scatter::find_eigenray(profile, {arguments.source_depth_m, range_m, depth_m, 0.0, bottom_m});
  if (!found)
    throw UsageError(fmt::format(
        "no ray from {} m depth reaches {} m range at {} m depth without touching the surface or "
        "the bottom: the target lies in a shadow zone; move it or the source, or try rays with "
        "several values of --launch-deg",
        arguments.source_depth_m, range_m, depth_m));
  return *found;
}

/// Prints the ray as rows. Between two rows it is straight (within between_rows_m).
void print_path(scatter::SoundRay ray, double range_m, const RayArguments& arguments,
                const scatter::SoundSpeedProfile& profile) {
  std::string out = "range_m,depth_m,time_s,path_m,angle_deg,loss_db\n";
  double upper_m = arguments.source_depth_m, lower_m = upper_m;
  const auto row = [&] {
    const scatter::SoundRayPoint& p = ray.point();
    upper_m = std::min(upper_m, p.depth_m);
    lower_m = std::max(lower_m, p.depth_m);
    out += fmt::format("{:.15g},{:.15g},{:.15g},{:.15g},{:.12g},{:.12g}\n", p.range_m, p.depth_m,
                       p.time_s, p.path_m, std::atan2(p.down, p.along) / degree, ray.loss_db());
  };
  row();
  for (int rows = 1;; ++rows) {
    const double edge_m = ray.path_to_edge_m(), end_m = ray.path_to_range_m(range_m);
    const double on_m = std::min(edge_m, end_m);
    if (on_m == inf || rows == max_rows)
      throw UsageError(fmt::format(
          "the ray is at {:.6g} m range after {} layers, reflections and bends, and does not "
          "reach {} m; use a flatter --launch-deg or a shorter --range-m",
          ray.point().range_m, rows, range_m));
    const double straight_m = std::sqrt(8.0 * between_rows_m / std::abs(ray.curvature_per_m()));
    if (straight_m < on_m) {
      ray.advance(on_m / std::ceil(on_m / straight_m));
      row();
      continue;
    }
    ray.advance(on_m);
    row();
    if (end_m <= edge_m) break;
  }
  for (const std::string& remark : profile.remarks(upper_m, lower_m))
    print_note("ensonify: warning: {}: {}\n", arguments.profile.string(), remark);
  print(out);
}

void print_ray(const RayArguments& arguments) {
  const scatter::SoundSpeedProfile profile = read_profile(arguments.profile);
  const double bottom_m = arguments.bottom_depth_m.value_or(inf);
  if (arguments.source_depth_m > bottom_m)
    throw UsageError(fmt::format("--source-depth-m is {}, expected at most --bottom-depth-m, {}",
                                 arguments.source_depth_m, bottom_m));
  if (arguments.target_depth_m && *arguments.target_depth_m > bottom_m)
    throw UsageError(fmt::format("--target-depth-m is {}, expected at most --bottom-depth-m, {}",
                                 *arguments.target_depth_m, bottom_m));
  if (arguments.launch_deg)
    print_path(launched(profile, arguments, bottom_m), *arguments.range_m, arguments, profile);
  else
    print_path(eigenray(profile, arguments, bottom_m), *arguments.target_range_m, arguments,
               profile);
}

}  // namespace

void add_ray(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<RayArguments>();
  CLI::App& command = *app.add_subcommand(
      "ray",
      "Trace a sound ray through a cast (a sound speed profile), from a launch angle or to a "
      "target. The ray to a target is the first to arrive without touching surface or bottom. Output: "
      "range_m,depth_m,time_s,path_m,angle_deg,loss_db along the path; angles are positive "
      "downwards from the horizontal, the loss is spreading loss re 1 m. Straight lines between "
      "the rows stay within 0.1 mm of the ray");
  add_value(command, "--profile", arguments->profile, "FILE",
            "The cast: CSV with columns depth_m and soundspeed_mps, or a CastAway file")
      ->required();
  const CLI::Validator depth = number(0.0, 12000.0), range = number(1e-6, 1e7);
  command.add_option("--source-depth-m", arguments->source_depth_m, "Depth of the source, m")
      ->required()
      ->check(depth);
  CLI::Option& launch = *command
                             .add_option("--launch-deg", arguments->launch_deg,
                                         "Launch angle, degrees below the horizontal; needs "
                                         "--range-m")
                             ->check(number(-89.999, 89.999));
  CLI::Option& range_m =
      *command.add_option("--range-m", arguments->range_m, "Horizontal range to trace to, m")
           ->check(range);
  CLI::Option& target_range =
      *command
           .add_option("--target-range-m", arguments->target_range_m,
                       "Horizontal range of the target, m; needs --target-depth-m")
           ->check(range);
  CLI::Option& target_depth =
      *command.add_option("--target-depth-m", arguments->target_depth_m, "Depth of the target, m")
           ->check(depth);
  launch.needs(&range_m)->excludes(&target_range)->excludes(&target_depth);
  range_m.needs(&launch);
  target_range.needs(&target_depth);
  target_depth.needs(&target_range);
  command
      .add_option("--bottom-depth-m", arguments->bottom_depth_m,
                  "Depth of a level, reflecting bottom, m (default: no bottom)")
      ->check(depth);
  command.callback([&action, arguments] {
    if (!arguments->launch_deg && !arguments->target_range_m)
      throw CLI::RequiredError(
          "--launch-deg with --range-m, or --target-range-m with --target-depth-m");
    action = [arguments] { print_ray(*arguments); };
  });
}

}  // namespace ensonify::engine::app
