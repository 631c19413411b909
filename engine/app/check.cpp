#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/clock.h>
#include <ensonify/engine/random.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/check/hierarchy.h>
#include <ensonify/refine/parallel_for.h>

#include "app.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

constexpr std::string_view reference_name = "pluecker";
constexpr std::string_view slow_name = "brute_force";
constexpr double slow_tests = 1e9;  // ray-face tests: a quarter of a minute on one core
/// An intersector that would get fewer than one of this number of rays is left out.
constexpr std::uint64_t slowest_every = 10000;

struct Arguments {
  SceneArguments scene;
  std::filesystem::path cache;
  std::uint64_t rays = 1000000;
  int threads = 0;
  MemoryLimit memory;
  bool json = false;
  bool quiet = false;
};

/// Blocks of pings as in a run, with at least `rays` rays, spread over the track. A block is long
/// enough for a tree that serves several pings to be built, used and built again. If the track has
/// too few pings, it is repeated with slightly turned sonars.
std::vector<PingBlock> scene_blocks(const Scene& scene, Simulator& simulator, std::uint64_t rays) {
  const std::vector<Pose> track = simulator.track();
  const auto fans_at = [&](const Pose& pose) {
    const std::span<const RayFan> fans = SimulatorInternals::aim(simulator, pose);
    return std::vector<RayFan>(fans.begin(), fans.end());
  };
  std::uint64_t a_ping = 0;
  for (const RayFan& fan : fans_at(track[track.size() / 2])) a_ping += rays_within_beam(*fan.grid);
  const std::uint64_t wanted = rays / std::max<std::uint64_t>(a_ping, 1) + 1;
  const std::size_t length =
      std::min(track.size(), static_cast<std::size_t>(scene.run.tree_pings) + 2);
  const std::size_t count = (wanted + length - 1) / length, a_pass = track.size() / length;
  std::vector<PingBlock> blocks(count);
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t pass = b / a_pass, first = pass * a_pass;
    const std::size_t of = std::min(count - first, a_pass);
    const std::size_t begin = (b - first) * (track.size() - length) / std::max<std::size_t>(of, 1);
    std::array<double, 3> turn{};
    if (pass > 0) RandomStream(scene.seed, Purpose::agreement, {2, pass, 0}).normal(turn);
    for (std::size_t ping = begin; ping < begin + length; ++ping) {
      Pose pose = track[ping];
      pose.roll_rad += 0.05 * turn[0];
      pose.pitch_rad += 0.05 * turn[1];
      pose.heading_rad += 0.05 * turn[2];
      try {
        blocks[b].push_back(fans_at(pose));
      } catch (const std::invalid_argument&) {  // the turn moved a sonar out of the water
        blocks[b].push_back(fans_at(track[ping]));
      }
    }
  }
  return blocks;
}

/// An intersector is compared on every n-th ray, to limit the time of the slow one. Returns n; 0 if
/// too few rays would be left.
std::uint64_t asked_every(const IntersectorKind& kind, std::size_t faces,
                          const std::vector<PingBlock>& blocks, std::uint64_t aimed) {
  if (kind.name != slow_name) return 1;
  double rays = static_cast<double>(aimed);
  for (const PingBlock& block : blocks)  // may be more than requested: blocks are whole
    for (const std::vector<RayFan>& ping : block)
      for (const RayFan& fan : ping) rays += static_cast<double>(rays_within_beam(*fan.grid));
  const auto every =
      static_cast<std::uint64_t>(std::ceil(rays * static_cast<double>(faces) / slow_tests));
  return every > slowest_every ? 0 : every;
}

/// One intersector with every face source; `reference` is built over the whole mesh.
std::vector<Candidate> candidates(const IntersectorKind& kind, const refine::TriangleMesh& mesh,
                                  const std::shared_ptr<const Intersector>& reference,
                                  const std::shared_ptr<const refine::ProgressiveMesh>& progressive,
                                  const Scene& scene, std::uint64_t every) {
  const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
  const FaceSourceParts parts{
      .all = mesh,
      .whole = kind.name == reference_name
                   ? reference
                   : make_intersector(kind.name, mesh, scene.run.intersection),
      .progressive = progressive,
      .intersector = std::string(kind.name),
      .options = scene.run.intersection,
      .tree_pings = scene.run.tree_pings};
  std::vector<Candidate> all;
  for (const FaceSourceKind& surface : face_source_kinds())
    all.push_back(
        {.surface = std::string(surface.name),
         .intersector = std::string(kind.name),
         .make = [make = surface.make, parts,
                  faces] { return std::make_unique<FacesWithBodies>(make(parts), faces, parts); },
         .precision = kind.precision,
         .has_every_face = !surface.needs_progressive_mesh,
         .every = every});
  return all;
}

/// The altitudes of two simulators: over the mesh, and over its progressive mesh.
std::vector<HeightCandidate> heights(const Simulator& of_mesh, const Simulator& of_analysis) {
  const auto candidate = [](std::string surface, std::string name, const Simulator& simulator) {
    return HeightCandidate{std::move(surface), std::move(name), [&simulator] {
                             return
                                 [one = std::make_shared<Simulator>(simulator.clone_for_thread())](
                                     double x_m, double y_m) {
                                   return -one->altitude_m({x_m, y_m, 0.0});
                                 };
                           }};
  };
  return {candidate("static", "bed_grid", of_mesh),
          candidate("refined", "plumb_line", of_analysis)};
}

std::string csv(const std::vector<AgreementRow>& rows) {
  std::string out = "surface,intersector,source,rays";
  for (const std::string_view verdict : verdict_names) out += fmt::format(",{}", verdict);
  out +=
      ",largest_dt_m,largest_dt_relative,largest_dt_of_tolerance,coarse,unlike_static,wrong_index,"
      "wrong_run,over_limit\n";
  for (const AgreementRow& row : rows) {
    out += fmt::format("{},{},{},{}", row.surface, row.intersector,
                       ray_source_names[static_cast<std::size_t>(row.source)], row.rays);
    for (const std::uint64_t count : row.verdicts) out += fmt::format(",{}", count);
    out += fmt::format(",{:.3g},{:.3g},{:.3g},{},{},{},{},{}\n", row.largest_dt_m,
                       row.largest_dt_relative, row.largest_dt_of_tolerance, row.coarse,
                       row.unlike_static, row.wrong_index, row.wrong_run,
                       fmt::join(exceeded_limits(row), "+"));
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
  json["coarse"] = row.coarse;
  json["unlike_static"] = row.unlike_static;
  json["wrong_index"] = row.wrong_index;
  json["wrong_run"] = row.wrong_run;
  json["over_limit"] = exceeded_limits(row);
  nlohmann::ordered_json shares = nlohmann::ordered_json::object();
  for (const Limit& limit : limits(row.source, row.precision)) shares[limit.name] = limit.share;
  json["limits"] = shares;  // as shares of the rays
  return json;
}

/// One line per exceeded limit: "over the limit: static embree scene: tie 0.012 of the rays, ...".
std::string report_limits(const std::vector<AgreementRow>& rows) {
  std::string lines;
  for (const AgreementRow& row : rows)
    for (const Limit& limit : limits(row.source, row.precision))
      if (exceeds(limit, row))
        lines += fmt::format(
            "over the limit: {} {} {}: {} {:.2g} of the rays, at most {:.2g}\n", row.surface,
            row.intersector, ray_source_names[static_cast<std::size_t>(row.source)], limit.name,
            static_cast<double>(limit.of(row)) / static_cast<double>(row.rays), limit.share);
  return lines;
}

/// Prints what is needed to reproduce each difference: `ensonify seafloor` writes the mesh,
/// `ensonify trace` traces the ray.
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
  const Preparation how{.cache = arguments.cache,
                        .threads = threads,
                        .progress =
                            [&](std::string_view stage) {
                              progress->report(stage, 0, 1);
                              if (SignalWatch::caught() != 0)
                                throw Stopped("stopped on request, before a ray was compared");
                            },
                        .memory = arguments.memory};

  Clock::time_point start = Clock::now();
  // The reference mesh is made from the scene, not from its analysis, which is checked as well.
  scene.run.surface = "static";
  Simulator simulator(scene, how);
  const refine::TriangleMesh& mesh = simulator.seafloor().mesh;
  scene.run.surface = "refined";
  const auto analysed = prepare_seafloor(scene, how);
  progress->report("trees", 0, 1);
  const std::shared_ptr<const Intersector> reference = make_intersector(reference_name, mesh);
  const std::vector<PingBlock> blocks = scene_blocks(scene, simulator, (arguments.rays + 1) / 2);
  const Simulator of_analysis(scene, {.threads = threads, .seafloor = analysed});
  const double prepare_s = seconds_since(start);

  start = Clock::now();
  AgreementProgress reached;
  std::string_view reached_what;
  bool stopped = false;
  std::vector<AgreementRow> rows;
  const auto compare_some = [&](std::string_view what, const std::vector<Candidate>& some,
                                AgreementOptions options) {
    reached_what = what;
    options.seed = scene.seed;
    options.threads = threads;
    const AgreementProgress before = reached;
    options.progress = [&](const AgreementProgress& now) {
      reached = {now.rays, now.of, before.unexplained + now.unexplained, before.leaks + now.leaks};
      progress->report(
          what, now.rays, now.of,
          fmt::format("{} unexplained, {} leaked", reached.unexplained, reached.leaks));
      stopped = SignalWatch::caught() != 0;
      return !stopped;
    };
    const std::vector<AgreementRow> more =
        compare(mesh, *reference, some,
                some.empty() ? std::span<const PingBlock>() : std::span(blocks), options);
    rows.insert(rows.end(), more.begin(), more.end());
  };
  // One intersector after another, so that its trees are freed before the next one's are built.
  for (const IntersectorKind& kind : intersector_kinds()) {
    const std::uint64_t every = asked_every(kind, mesh.faces.size(), blocks, arguments.rays / 2);
    if (every == 0 || stopped) continue;
    compare_some(
        kind.name, candidates(kind, mesh, reference, analysed->seafloor.progressive, scene, every),
        {.aimed_fan_rays = arguments.rays / 4, .aimed_rays = arguments.rays / 4, .bodies = true});
  }
  if (!stopped)
    compare_some("altitudes", {},
                 {.heights = heights(simulator, of_analysis),
                  .plumb_lines = arguments.rays / 50,
                  .bed_faces = simulator.seafloor().bed_faces});
  if (!stopped) {
    progress->report("faces", 0, 1);
    rows.push_back({compare_faces(mesh, *analysed->seafloor.progressive, threads), "refined",
                    "progressive_mesh", RaySource::faces, Precision::exact});
    reached.unexplained += rows.back().count(Verdict::unexplained);
  }
  const double compare_s = seconds_since(start);
  progress.reset();

  print_warnings(analysed->warnings);
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
    throw Stopped(fmt::format(
        "stopped on request after {} of {} rays of {}; the table holds the comparison so far",
        reached.rays, reached.of, reached_what));
  const std::string over = report_limits(rows);
  fmt::print(stderr, "{}", over);
  if (reached.unexplained > 0)
    throw std::runtime_error(fmt::format(
        "{} differences from the reference are unexplained; the first of each row are listed above",
        reached.unexplained));
  if (!over.empty())
    throw std::runtime_error(
        "more differences of a class than correct arithmetic can make; they are listed above");
}

/// Replaces a number of rays, which may be written as 1e7, by its digits. Returns the fault, if
/// any.
std::string count_of_rays(std::string& text) {
  const char* const end = text.data() + text.size();
  double number = 0.0;
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end || number != std::floor(number) || number < 1.0 ||
      number > 1e12)
    return text + " is not a whole number from 1 to 1e12";
  text = fmt::format("{:.0f}", number);
  return "";
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "check",
      "Compare every surface (face source) and intersector with the exact reference, on the rays "
      "of a scene and on rays aimed at vertices and edges. Exit code 1 if a difference is "
      "unexplained. Rays are straight, even if the scene's water refracts them. Ctrl-C ends the "
      "comparison and prints the table so far");
  arguments->scene.add_to(command);
  command
      .add_option(
          "--rays", arguments->rays,
          "Approximate number of rays per surface and intersector (default: a million; brute_force "
          "gets as many as it can trace in half a minute)")
      ->type_name("N")
      ->transform(CLI::Validator(count_of_rays, "in [1 - 1e12]"));
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print the table and the times as one JSON object");
  command.add_flag("--quiet", arguments->quiet, "No progress; differences and errors remain");
  command.callback([&action, arguments] { action = [arguments] { check(*arguments); }; });
}

}  // namespace ensonify::engine::app
