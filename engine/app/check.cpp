#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/check/hierarchy.h>
#include <ensonify/refine/ball_tree.h>
#include <ensonify/refine/parallel_for.h>

#include "app.h"
#include "check_parts.h"
#include "progress.h"

namespace ensonify::engine::app {
namespace {

constexpr double slow_tests = 1e9;  // number of ray-face tests that take 15 s on one core
/// An intersector that could be compared on fewer than one ray in this number is skipped.
constexpr std::uint64_t slowest_every = 10000;
/// One in max_bent_every of the scene's rays is also compared as a bent ray; more, if these are
/// fewer than enough_bent rays. The reference takes about 10 µs per bent ray.
constexpr std::uint64_t max_bent_every = 10;
constexpr std::uint64_t enough_bent = 20000;

struct CheckArguments {
  SceneArguments scene;
  std::filesystem::path cache;
  std::vector<std::string> intersectors;  // empty: all
  std::uint64_t rays = 1000000;
  int threads = 0;
  MemoryLimit memory;
  bool json = false, quiet = false;
};

/// An intersector is compared on every n-th ray, which limits the time of a slow one. Returns n; 0
/// if too few rays would be left.
std::uint64_t asked_every(const IntersectorKind& kind, std::size_t faces, std::uint64_t rays) {
  if (!kind.tests_every_face) return 1;
  const auto every = static_cast<std::uint64_t>(
      std::ceil(static_cast<double>(rays) * static_cast<double>(faces) / slow_tests));
  return every > slowest_every ? 0 : every;
}

/// The intersectors with these names; all intersectors if there are no names. Throws
/// std::invalid_argument.
std::vector<IntersectorKind> kinds_of(const std::vector<std::string>& names) {
  const std::span<const IntersectorKind> all = intersector_kinds();
  if (names.empty()) return {all.begin(), all.end()};
  std::vector<IntersectorKind> kinds;
  for (const std::string& name : names) kinds.push_back(intersector_kind(name));
  return kinds;
}

/// The refraction of a run; without a profile if the rays of these blocks are straight.
Refraction refraction_of(const Simulator& simulator, const std::vector<PingBlock>& blocks) {
  Refraction refraction = SimulatorInternals::refraction(simulator);
  if (blocks.front().front().front().bend.turn_rad == 0.0) refraction.profile = nullptr;
  return refraction;
}

/// What a check compares, and with what.
struct Prepared {
  Scene scene;          ///< with the surface "refined"
  Simulator simulator;  ///< over the scene's mesh, not over its analysis, which is checked
  std::shared_ptr<const Intersector> reference;  ///< over the same mesh
  std::optional<Simulator> of_heights;
  std::shared_ptr<const PreparedSeafloor> analysed;
  std::vector<PingBlock> blocks;
  std::uint64_t scene_rays = 0;  ///< may be more than requested, because blocks are whole
  Refraction refraction;
  BentWater water;
  std::uint64_t bent_every = 1;
  std::optional<Simulator> of_analysis;

  const refine::TriangleMesh& mesh() const { return simulator.seafloor().mesh; }
};

/// The scene with another surface and another intersector.
Scene scene_with(Scene scene, std::string_view surface, std::string_view intersector) {
  scene.run.surface = surface;
  scene.run.intersector = intersector;
  return scene;
}

/// The least number of rays that the scene's pings must have: half of all rays.
std::uint64_t least_scene_rays(std::uint64_t rays) { return (rays + 1) / 2; }

std::unique_ptr<Prepared> prepare(const CheckArguments& arguments, const Preparation& how) {
  const Scene read = arguments.scene.read();
  require_at_once(read.seafloor);
  // Every thread compares fans. fan_scan takes the most memory per ray of all intersectors.
  require_rays(how.memory, read.sonars, "fan_scan", how.threads);
  // A signal may end the check only while the tree is made: later, the table is still printed.
  const auto making = std::make_shared<bool>(true);
  Preparation how_reference = how;
  how_reference.stop_check = [making, progress = how.progress] {
    if (*making) progress("tree");
  };
  // The tree of this simulator is the reference. A tree of the scene's intersector would waste
  // memory.
  auto all = std::make_unique<Prepared>(Prepared{
      .scene = scene_with(read, refined_surface, read.run.intersector),
      .simulator =
          Simulator(scene_with(read, static_surface, reference_intersector), how_reference)});
  *making = false;
  all->reference = SimulatorInternals::whole(all->simulator);
  if (read.seafloor.is_grid())
    all->of_heights.emplace(scene_with(read, footprint_surface, read.run.intersector), how);
  all->analysed = prepare_seafloor(all->scene, how);
  all->blocks = scene_blocks(all->scene, all->simulator, least_scene_rays(arguments.rays));
  all->scene_rays = rays_of(all->blocks);
  all->refraction = refraction_of(all->simulator, all->blocks);
  all->water = {all->refraction.profile, all->refraction.highest_m,
                all->simulator.sound_speed_mps()};
  all->bent_every = std::clamp<std::uint64_t>(all->scene_rays / enough_bent, 1, max_bent_every);
  all->of_analysis.emplace(all->scene,
                           Preparation{.threads = how.threads, .seafloor = all->analysed});
  return all;
}

/// One intersector with each face source, compared on every n-th ray.
std::vector<Candidate> candidates(const Prepared& all, const IntersectorKind& kind,
                                  std::uint64_t every) {
  std::function<std::unique_ptr<RefractedTracer>()> make_bent;
  if (all.water.profile)
    make_bent = [&all, takes_lists = kind.takes_lists] {
      return std::make_unique<RefractedTracer>(*all.water.profile, all.water.highest_m,
                                               all.refraction.deepest_m, all.water.reference_mps,
                                               takes_lists);
    };
  const refine::TriangleMesh& mesh = all.mesh();
  const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
  const RunOptions& run = all.scene.run;
  const FaceSourceParts parts{.all = mesh,
                              .whole = kind.name == reference_intersector
                                           ? all.reference
                                           : make_intersector(kind.name, mesh, run.intersection),
                              .progressive = all.analysed->seafloor.progressive,
                              .intersector = std::string(kind.name),
                              .options = run.intersection,
                              .tree_pings = run.tree_pings};
  std::vector<Candidate> some;
  const auto add = [&](std::string name, const FaceSourceKind& surface, const FaceSourceParts& of) {
    some.push_back(
        {.surface = std::move(name),
         .intersector = std::string(kind.name),
         .make = [make = surface.make, of,
                  faces] { return std::make_unique<FacesWithBodies>(make(of), faces, of); },
         .precision = kind.precision,
         .has_every_face = !surface.needs_progressive_mesh,
         .every = every,
         .make_bent = make_bent});
  };
  for (const FaceSourceKind& surface : face_source_kinds()) {
    add(std::string(surface.name), surface, parts);
    if (!surface.takes_grid || !all.of_heights) continue;
    const Seafloor& of_heights = all.of_heights->seafloor();
    FaceSourceParts of_grid = parts;
    of_grid.grid = of_heights.grid;
    of_grid.objects = std::make_shared<const refine::BallTree>(of_heights.mesh);
    add(fmt::format("{}_of_heights", surface.name), surface, of_grid);
  }
  return some;
}

/// What finds altitudes: over the mesh, its progressive mesh, and the heights, if there are any.
std::vector<HeightCandidate> heights(const Prepared& all) {
  const auto candidate = [](std::string_view surface, std::string name,
                            const Simulator& simulator) {
    return HeightCandidate{std::string(surface), std::move(name), [&simulator] {
                             return
                                 [one = std::make_shared<Simulator>(simulator.clone_for_thread())](
                                     double x_m, double y_m) {
                                   return -one->altitude_m({x_m, y_m, 0.0});
                                 };
                           }};
  };
  std::vector<HeightCandidate> some = {candidate(static_surface, "bed_grid", all.simulator),
                                       candidate(refined_surface, "plumb_line", *all.of_analysis)};
  if (all.of_heights) some.push_back(candidate(footprint_surface, "height_grid", *all.of_heights));
  return some;
}

/// The comparisons of a check. They are made one after another, until one is stopped.
class Comparison {
 public:
  Comparison(const Prepared& prepared, const CheckArguments& arguments, int threads,
             Progress& progress)
      : all_(prepared), arguments_(arguments), threads_(threads), progress_(progress) {}

  void run() {
    std::vector<IntersectorKind> kinds = kinds_of(arguments_.intersectors);
    std::erase_if(kinds, [&](const IntersectorKind& kind) { return every(kind) == 0; });
    if (kinds.empty())
      throw UsageError(fmt::format("{} would take too long: use fewer --rays, or fewer faces",
                                   fmt::join(arguments_.intersectors, ", ")));
    const bool all_kinds = arguments_.intersectors.empty();
    comparisons_ = kinds.size() + (all_kinds ? 2 : 0);
    // One after another: the trees of an intersector are freed before those of the next are built.
    for (const IntersectorKind& kind : kinds) {
      compare_intersector(kind);
      if (stopped_) return;
    }
    if (!all_kinds) return;
    compare_altitudes();
    if (!stopped_) compare_hierarchy();
  }

  const std::vector<AgreementRow>& rows() const { return rows_; }
  bool stopped() const { return stopped_; }
  std::uint64_t unexplained() const { return reached_.unexplained; }
  /// How much was done when the check was stopped.
  std::string reached() const {
    return fmt::format(
        "{} of {} comparisons{}", finished_, comparisons_,
        reached_.rays < reached_.of  // for aimed rays, `of` is an estimate
            ? fmt::format(" and {} of {} rays of {}", reached_.rays, reached_.of, reached_what_)
            : "");
  }

 private:
  std::uint64_t every(const IntersectorKind& kind) const {
    return asked_every(kind, all_.mesh().faces.size(), all_.scene_rays + arguments_.rays / 2);
  }

  void compare_intersector(const IntersectorKind& kind) {
    compare_some(kind.name, candidates(all_, kind, every(kind)),
                 {.aimed_fan_rays = arguments_.rays / 4,
                  .aimed_rays = arguments_.rays / 4,
                  .bodies = true,
                  .water = every(kind) == 1 ? all_.water : BentWater{},
                  .bent_every = all_.bent_every});
  }

  void compare_altitudes() {
    compare_some("altitudes", {},
                 {.heights = heights(all_),
                  .plumb_lines = arguments_.rays / 50,
                  .bed_faces = all_.simulator.seafloor().bed_faces});
  }

  void compare_hierarchy() {
    progress_.report("faces", 0, 1);
    rows_.push_back({compare_faces(all_.mesh(), *all_.analysed->seafloor.progressive, threads_),
                     std::string(refined_surface), "progressive_mesh", RaySource::faces,
                     Precision::exact});
    reached_.unexplained += rows_.back().count(Verdict::unexplained);
  }

  void compare_some(std::string_view what, const std::vector<Candidate>& some,
                    AgreementOptions options) {
    reached_what_ = what;
    options.seed = all_.scene.seed;
    options.threads = threads_;
    const AgreementProgress before = reached_;
    options.progress = [&](const AgreementProgress& now) {
      reached_ = {now.rays, now.of, before.unexplained + now.unexplained, before.leaks + now.leaks};
      progress_.report(
          what, now.rays, now.of,
          fmt::format("{} unexplained, {} leaked", reached_.unexplained, reached_.leaks));
      stopped_ = SignalWatch::caught() != 0;
      return !stopped_;
    };
    const std::vector<AgreementRow> more =
        compare(all_.mesh(), *all_.reference, some,
                some.empty() ? std::span<const PingBlock>() : std::span(all_.blocks), options);
    rows_.insert(rows_.end(), more.begin(), more.end());
    if (!stopped_) ++finished_;
  }

  const Prepared& all_;
  const CheckArguments& arguments_;
  int threads_;
  Progress& progress_;
  AgreementProgress reached_;
  std::string_view reached_what_;
  bool stopped_ = false;
  std::size_t finished_ = 0, comparisons_ = 0;
  std::vector<AgreementRow> rows_;
};

struct CheckTimes {
  double prepare_s, compare_s;
};

void print_comparison(const CheckArguments& arguments, const Prepared& prepared,
                      const Comparison& comparison, const CheckTimes& times, int threads) {
  const bool bent = prepared.water.profile != nullptr;
  print_warnings(prepared.analysed->warnings);
  for (const AgreementRow& row : comparison.rows())
    print_unexplained(row, prepared.mesh().world_origin);
  if (!arguments.quiet)
    print_note("source scene: {} rays of {} whole pings; --rays {} asks for at least {}\n",
               prepared.scene_rays, pings_of(prepared.blocks), arguments.rays,
               least_scene_rays(arguments.rays));
  if (bent && !arguments.quiet)
    print_note("source bent: one in {} of the scene's rays, as the water bends them\n",
               prepared.bent_every);
  if (!arguments.json) {
    print(csv(comparison.rows()));
    return;
  }
  nlohmann::ordered_json table = nlohmann::ordered_json::array();
  for (const AgreementRow& row : comparison.rows()) table.push_back(to_json(row));
  print_object({
      {"scene", arguments.scene.file.string()},
      {"seed", prepared.scene.seed},
      {"faces", prepared.simulator.seafloor().faces},
      {"pings", pings_of(prepared.blocks)},
      {"reference", reference_intersector},
      {"bent_every", bent ? nlohmann::ordered_json(prepared.bent_every) : nullptr},
      {"stopped", comparison.stopped()},
      {"unexplained", comparison.unexplained()},
      {"rows", table},
      {"times_s", {{"prepare", times.prepare_s}, {"compare", times.compare_s}}},
      {"threads", threads},
  });
}

void check(const CheckArguments& arguments) {
  kinds_of(arguments.intersectors);  // throws for an unknown name before the scene is read
  const int threads = refine::thread_count(arguments.threads);
  const SignalWatch signals;
  std::optional<Progress> progress(std::in_place, arguments.quiet);
  Clock::time_point start = Clock::now();
  const std::unique_ptr<const Prepared> prepared =
      prepare(arguments, {.cache = arguments.cache,
                          .threads = threads,
                          .progress =
                              [&](std::string_view stage) {
                                progress->report(stage, 0, 1);
                                stop_on_signal("stopped on request, before a ray was compared");
                              },
                          .memory = arguments.memory});
  const double prepare_s = seconds_since(start);
  start = Clock::now();
  Comparison comparison(*prepared, arguments, threads, *progress);
  comparison.run();
  const double compare_s = seconds_since(start);
  progress.reset();

  print_comparison(arguments, *prepared, comparison, {prepare_s, compare_s}, threads);
  if (comparison.stopped())
    throw Stopped(fmt::format("stopped on request after {}; the table holds what was compared",
                              comparison.reached()));
  const std::string over = report_limits(comparison.rows());
  write_note(over);
  if (comparison.unexplained() > 0)
    throw std::runtime_error(fmt::format(
        "{} differences from the reference are unexplained; the first of each row are listed above",
        comparison.unexplained()));
  if (!over.empty())
    throw std::runtime_error(
        "more differences of a class than correct arithmetic can make; they are listed above");
}

/// Replaces a number of rays, which may be written as 1e7, by its digits. Returns what is wrong
/// with the text; empty if nothing is.
std::string count_of_rays(std::string& text) {
  const std::optional number = number_in<double>(text);
  if (!number || *number != std::floor(*number) || *number < 1.0 || *number > 1e12)
    return text + " is not a whole number from 1 to 1e12";
  text = fmt::format("{:.0f}", *number);
  return "";
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  const auto arguments = std::make_shared<CheckArguments>();
  CLI::App& command = *app.add_subcommand(
      "check",
      "Compare every surface (face source) and intersector with the exact reference. The rays are "
      "those of a scene, and rays aimed at vertices and edges. The exit code is 1 if a difference "
      "is unexplained. If sea.refraction = \"full\", some of the scene's rays are also compared as "
      "the water bends them (source bent): about 20,000, or one in 10 if that is more; brute_force "
      "has them only where it traces every ray. Ctrl-C ends the comparison and prints the table so "
      "far");
  arguments->scene.add_to(command);
  add_value(
      command, "--rays", arguments->rays, "N",
      "Least number of rays per surface and intersector, about half of them the scene's: whole "
      "pings are traced, so there may be many more (default: a million; brute_force "
      "gets as many as it can trace in half a minute)")
      ->transform(CLI::Validator(count_of_rays, "in [1 - 1e12]"));
  add_value(
      command, "--intersector", arguments->intersectors, "NAME,NAME",
      "Compare only these intersectors (default: all; also the bed heights and the face lists)")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_cache(command, arguments->cache);
  add_threads(command, arguments->threads);
  add_memory(command, arguments->memory);
  command.add_flag("--json", arguments->json, "Print the table and the times as one JSON object");
  command.add_flag("--quiet", arguments->quiet, "No progress; differences and errors remain");
  command.callback([&action, arguments] { action = [arguments] { check(*arguments); }; });
}

}  // namespace ensonify::engine::app
