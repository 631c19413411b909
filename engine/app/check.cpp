#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/random.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/agreement.h>
#include <ensonify/refine/parallel_for.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

constexpr std::string_view reference_name = "pluecker";
constexpr std::string_view slow_name = "brute_force";
constexpr double slow_tests = 1e9;  // of a ray against a face: a quarter of a minute of one core

struct Arguments {
  SceneArguments scene;
  std::filesystem::path cache;
  std::uint64_t rays = 1000000;
  int threads = 0;
  bool json = false;
  bool quiet = false;
};

/// Fans of all sonars along the track, at least so many rays. Where the track has not enough pings it
/// is flown again, the sonar turned a little.
std::vector<RayFan> scene_fans(std::uint64_t seed, Simulator& simulator, std::uint64_t rays) {
  const std::vector<Pose> track = simulator.track();
  std::vector<RayFan> fans;
  const auto place = [&](const Pose& pose) {
    const std::span<const RayFan> ping = simulator.aim(pose);
    fans.insert(fans.end(), ping.begin(), ping.end());
  };
  place(track[track.size() / 2]);
  std::uint64_t a_ping = 0;
  for (const RayFan& fan : fans) a_ping += rays_within_beam(*fan.grid);
  a_ping = std::max<std::uint64_t>(a_ping, 1);
  const std::uint64_t pings = (rays + a_ping - 1) / a_ping;
  fans.clear();
  for (std::uint64_t ping = 0; ping < pings; ++ping) {
    if (pings <= track.size()) {
      place(track[ping * track.size() / pings]);
      continue;
    }
    Pose pose = track[ping % track.size()];
    if (ping >= track.size()) {
      std::array<double, 3> turn;
      Stream(seed, Purpose::agreement, {2, ping, 0}).normal(turn);
      pose.roll_rad += 0.05 * turn[0];
      pose.pitch_rad += 0.05 * turn[1];
      pose.heading_rad += 0.05 * turn[2];
    }
    place(pose);
  }
  return fans;
}

/// Every surface with every intersector.
std::vector<Candidate> candidates(const refine::TriangleMesh& mesh,
                                  const std::shared_ptr<const refine::ProgressiveMesh>& progressive,
                                  const Scene& scene, std::uint64_t rays) {
  const double tests = static_cast<double>(rays) * static_cast<double>(mesh.faces.size());
  std::vector<Candidate> all;
  for (const IntersectorKind& kind : intersector_kinds()) {
    const SurfaceParts parts{.all = mesh,
                             .whole = make_intersector(kind.name, mesh, scene.run.intersection),
                             .progressive = progressive,
                             .intersector = std::string(kind.name),
                             .options = scene.run.intersection,
                             .tree_pings = scene.run.tree_pings};
    for (const SurfaceKind& surface : surface_kinds())
      all.push_back({.surface = std::string(surface.name),
                     .intersector = std::string(kind.name),
                     .make = [make = surface.make, parts] { return make(parts); },
                     .has_every_face = !surface.needs_progressive_mesh,
                     .every = kind.name == slow_name
                                  ? static_cast<std::uint64_t>(std::ceil(tests / slow_tests))
                                  : 1,
                     // Such fans are all over the place, and each wants its faces found afresh.
                     .every_aimed_fan = surface.needs_progressive_mesh ? 50u : 1u});
  }
  return all;
}

std::string csv(const std::vector<AgreementRow>& rows) {
  std::string out = "surface,intersector,source,rays";
  for (const std::string_view verdict : verdict_names) out += fmt::format(",{}", verdict);
  out += ",largest_dt_m,largest_dt_relative,largest_dt_of_tolerance\n";
  for (const AgreementRow& row : rows) {
    out += fmt::format("{},{},{},{}", row.surface, row.intersector,
                       ray_source_names[static_cast<std::size_t>(row.source)], row.rays);
    for (const std::uint64_t count : row.verdicts) out += fmt::format(",{}", count);
    out += fmt::format(",{:.3g},{:.3g},{:.3g}\n", row.largest_dt_m, row.largest_dt_relative,
                       row.largest_dt_of_tolerance);
  }
  return out;
}

nlohmann::ordered_json to_json(const AgreementRow& row) {
  nlohmann::ordered_json json = {{"surface", row.surface},
                                 {"intersector", row.intersector},
                                 {"source", ray_source_names[static_cast<std::size_t>(row.source)]},
                                 {"rays", row.rays}};
  for (std::size_t i = 0; i < verdict_names.size(); ++i) json[verdict_names[i]] = row.verdicts[i];
  json["largest_dt_m"] = row.largest_dt_m;
  json["largest_dt_relative"] = row.largest_dt_relative;
  json["largest_dt_of_tolerance"] = row.largest_dt_of_tolerance;
  return json;
}

/// Enough to ask again: `ensonify seafloor` writes the mesh, `ensonify trace` takes the ray.
void print_unexplained(const AgreementRow& row, const Eigen::Vector3d& world_origin) {
  const auto answer = [](const Hit& hit) {
    return hit ? fmt::format("face {}, t {:.17g}, u {:.17g}, v {:.17g}", hit.face, hit.t, hit.u,
                             hit.v)
               : "no face";
  };
  for (const Difference& d : row.unexplained) {
    const Eigen::Vector3d o = d.ray.origin + world_origin;
    fmt::print(stderr,
               "unexplained: {} {} {}\n  ox,oy,oz,dx,dy,dz,t_min,t_max\n  {:.17g},{:.17g},{:.17g},"
               "{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n  reference: {}\n  found:     {}\n",
               row.surface, row.intersector, ray_source_names[static_cast<std::size_t>(row.source)],
               o.x(), o.y(), o.z(), d.ray.direction.x(), d.ray.direction.y(), d.ray.direction.z(),
               d.ray.t_min, d.ray.t_max, answer(d.expected), answer(d.found));
  }
}

void check(const Arguments& arguments) {
  Scene scene = arguments.scene.read();
  const int threads = refine::thread_count(arguments.threads);
  const SignalWatch signals;
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  const Preparation how{
      .cache = arguments.cache, .threads = threads, .progress = [&](std::string_view stage) {
        progress->tell(stage, 0, 1);
        if (SignalWatch::caught() != 0)
          throw Stopped("stopped on request, before a ray was compared");
      }};

  Clock::time_point start = Clock::now();
  // The mesh is the scene's own, not what its analysis gives back: that is on trial, too.
  scene.run.surface = "static";
  Simulator simulator(scene, how);
  const refine::TriangleMesh& mesh = simulator.seafloor().mesh;
  scene.run.surface = "refined";
  const PreparedSeafloor analysed = prepare_seafloor(scene, how);
  progress->tell("trees", 0, 1);
  const std::unique_ptr<Intersector> reference = make_intersector(reference_name, mesh);
  const std::vector<Candidate> all =
      candidates(mesh, analysed.seafloor.progressive, scene, arguments.rays);
  const std::vector<RayFan> fans = scene_fans(scene.seed, simulator, (arguments.rays + 1) / 2);
  const double prepare_s = seconds_since(start);

  start = Clock::now();
  AgreementProgress reached;
  bool stopped = false;
  const std::vector<AgreementRow> rows = compare(
      mesh, *reference, all, fans,
      {.seed = scene.seed,
       .aimed_fan_rays = arguments.rays / 4,
       .aimed_rays = arguments.rays / 4,
       .threads = threads,
       .progress = [&](const AgreementProgress& now) {
         reached = now;
         progress->tell("rays", now.rays, now.of,
                        fmt::format("{} unexplained, {} leaked", now.unexplained, now.leaks));
         stopped = SignalWatch::caught() != 0;
         return !stopped;
       }});
  const double compare_s = seconds_since(start);
  progress.reset();

  print_warnings(analysed.warnings);
  for (const AgreementRow& row : rows) print_unexplained(row, mesh.world_origin);
  if (arguments.json) {
    nlohmann::ordered_json table = nlohmann::ordered_json::array();
    for (const AgreementRow& row : rows) table.push_back(to_json(row));
    const nlohmann::ordered_json json = {
        {"scene", arguments.scene.file.string()},
        {"seed", scene.seed},
        {"faces", simulator.seafloor().faces},
        {"reference", reference_name},
        {"stopped", stopped},
        {"unexplained", reached.unexplained},
        {"rows", table},
        {"times_s", {{"prepare", prepare_s}, {"compare", compare_s}}},
        {"threads", threads},
    };
    print_object(json);
  } else {
    print(csv(rows));
  }
  if (stopped)
    throw Stopped(fmt::format("stopped on request after {} of {} rays; the table is of those",
                              reached.rays, reached.of));
  if (reached.unexplained > 0)
    throw std::runtime_error(fmt::format(
        "{} differences from the reference are unexplained; the first of each row are above",
        reached.unexplained));
}

/// A number of rays, also as 1e7.
std::string count_of_rays(std::string& text) {
  const char* const end = text.data() + text.size();
  double number = 0.0;
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || number != std::floor(number) || number < 1.0 ||
      number > 1e12)
    return text + " is no whole number from 1 to 1e12";
  text = fmt::format("{:.0f}", number);
  return "";
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "check",
      "Compare every surface and intersector with the exact reference, on a scene's own rays and "
      "on rays aimed at vertices and edges; exit code 1 if a difference is unexplained. Ctrl-C "
      "ends "
      "it with the table of what it has compared");
  arguments->scene.add_to(command);
  command
      .add_option(
          "--rays", arguments->rays,
          "About so many a surface and intersector (default: a million; brute_force gets what "
          "it can do in half a minute)")
      ->type_name("N")
      ->transform(CLI::Validator(count_of_rays, "in [1 - 1e12]"));
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  command.add_flag("--json", arguments->json, "Print the table and times as one JSON object");
  command.add_flag("--quiet", arguments->quiet, "No progress; differences and errors stay");
  command.callback([&action, arguments] { action = [arguments] { check(*arguments); }; });
}

}  // namespace ensonify::engine::app
