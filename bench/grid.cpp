#include "grid.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/trace/embree/embree.h>
#include <ensonify/refine/height_grid.h>

#include "clock.h"
#include "harness.h"
#include "scenes.h"

namespace ensonify::bench {
namespace {

using namespace engine;

constexpr double cell_s = 2.5;     // a slow cell gets fewer turns
constexpr int turns_of_grid = 24;  // and a fast cell no more than this
constexpr int turns_of_quick = 8;
constexpr int apart_turns = 7;  // has no factor in common with the numbers of turns

struct Scheme {
  const char *surface, *intersector;
  int query_pings = 1;
  // Embree with the machine's best instructions, not with the instructions that give the same bits
  // on every machine.
  bool best_instructions = false;
  double max_faces = 1e9;  // a larger cell takes too long
};

/// All other candidates are compared with the faster of the first two, because the machine's best
/// instructions are not the faster ones over every bed.
constexpr std::size_t references = 2;
std::vector<Scheme> schemes() {
  std::vector<Scheme> all{{"static", "embree", 1, true},
                          {"static", "embree"},
                          {"static", "embree-single"},
                          {"static", "pluecker", 1, false, 3e6},
                          {"static", "fan_scan", 1, false, 3e6}};
  for (const char* surface : {"refined", "footprint"})
    for (const char* intersector : {"embree", "fan_scan"})
      for (const int query_pings : {1, turn_pings})
        all.push_back({surface, intersector, query_pings});
  return all;
}

std::string best_instruction_set() {
  const std::span<const std::string_view> sets = instruction_sets();
  const bool wide = std::ranges::find(sets, "avx512") != sets.end();
  return wide ? "avx512" : "";
}

/// A cell under measurement.
struct Running {
  Cell cell;
  std::unique_ptr<Simulator> simulator;
  std::vector<double> ping_ms, speedup;
  StageTimes stages;
  double spent_s = 0.0;
};

class BedMeasurement {
 public:
  BedMeasurement(const Bed& bed, const Size& size, Scene scene, const GridOptions& options)
      : bed_(bed), size_(size), scene_(std::move(scene)), options_(options) {}

  std::vector<Cell> cells() {
    const std::vector<Scheme> all = schemes();
    for (const Scheme& scheme : all) {
      const std::string name = name_of(scheme);
      if (name.find(options_.pattern) != std::string::npos && size_.faces <= scheme.max_faces)
        wanted_.push_back(scheme);
    }
    if (wanted_.empty()) return {};
    for (std::size_t i = 0; i < references; ++i)
      if (i == wanted_.size() || name_of(wanted_[i]) != name_of(all[i]))
        wanted_.insert(wanted_.begin() + static_cast<std::ptrdiff_t>(i), all[i]);
    for (const Scheme& scheme : wanted_) prepare(scheme);
    check();
    time();
    std::vector<Cell> cells;
    for (Running& one : running_) {
      finish(one);
      cells.push_back(std::move(one.cell));
    }
    return cells;
  }

 private:
  std::string name_of(const Scheme& scheme) const {
    return fmt::format("ping/{}/{}/{}/{}{}{}", bed_.name, size_.name, scheme.surface,
                       scheme.intersector, scheme.best_instructions ? "-best" : "",
                       scheme.query_pings > 1 ? fmt::format("/{}", scheme.query_pings) : "");
  }

  void prepare(const Scheme& scheme) {
    Running& one = running_.emplace_back();
    Cell& cell = one.cell;
    cell.name = name_of(scheme);
    if (options_.progress) options_.progress(cell.name);
    cell.bed = bed_.name;
    cell.size = size_.name;
    cell.surface = scheme.surface;
    cell.intersector = std::string(scheme.intersector) + (scheme.best_instructions ? "-best" : "");
    cell.query_pings = scheme.query_pings;
    Scene scene = scene_;
    scene.run.surface = scheme.surface;
    scene.run.intersector = scheme.intersector;
    scene.run.tree_pings = scheme.query_pings;
    if (scheme.best_instructions) scene.run.intersection.instruction_set = best_instruction_set();
    const double start_s = wall_s();
    one.simulator = std::make_unique<Simulator>(scene, Preparation{.cache = options_.cache});
    cell.prepare_s = wall_s() - start_s;
    const Seafloor& seafloor = one.simulator->seafloor();
    cell.faces = seafloor.faces;
    cell.code_path = SimulatorInternals::code_path(*one.simulator);
    if (seafloor.progressive) {
      const std::filesystem::path& file =
          SimulatorInternals::prepared(*one.simulator).origin.cache_file;
      if (!file.empty()) cell.progressive_mb = 1e-6 * static_cast<double>(file_size(file));
    } else {
      constexpr double mb_each = 12e-6;  // three floats or three indices
      cell.mesh_mb = mb_each * static_cast<double>(seafloor.mesh.positions.size() +
                                                   seafloor.mesh.faces.size());
      if (seafloor.grid)
        cell.mesh_mb +=
            1e-6 * refine::HeightGrid::bytes_of(seafloor.grid->columns(), seafloor.grid->rows());
    }
    if (poses_.empty()) poses_ = one.simulator->track();
    const double first_s = thread_s();
    for (const EchoLine& line : one.simulator->ping_numbered(poses_.front(), 0))
      cell.rays += static_cast<double>(line.rays);
    cell.first_ping_ms = 1e3 * (thread_s() - first_s);
  }

  /// Compares the rays of one ping, traced as the timed pings trace them, with the exact reference.
  void check() {
    const Pose& pose = poses_[poses_.size() / 2];
    for (Running& one : running_) {
      const AgreementCounts counts = SimulatorInternals::verify(*one.simulator, pose);
      one.cell.checked_rays = counts.rays;
      one.cell.verdicts = counts.verdicts;
      one.cell.wrong_numbers = counts.wrong_index + counts.wrong_run;
    }
  }

  bool is_reference(const Running& one) const {
    return &one - running_.data() < static_cast<std::ptrdiff_t>(references) && one.cell.agrees();
  }

  void time() {
    const int turns = options_.quick ? turns_of_quick : turns_of_grid;
    if (options_.progress)
      options_.progress(fmt::format("ping/{}/{}: {} turns", bed_.name, size_.name, turns));
    const std::size_t last = poses_.size() - turn_pings - 1;
    for (int turn = 0; turn < turns; ++turn) {
      // A slow cell has the first turns only: they too are spread over the track.
      const int place = turn * apart_turns % turns;
      const std::size_t begin =
          last * static_cast<std::size_t>(place) / static_cast<std::size_t>(turns);
      for (Running& one : running_) {
        const double enough_s = cell_s * (options_.quick ? 0.3 : 1.0);
        if (!one.cell.agrees() || (!is_reference(one) && one.spent_s > enough_s)) continue;
        one.ping_ms.push_back(take_turn(one, begin));
      }
    }
    const Running* fastest = nullptr;
    for (const Running& one : running_)
      if (is_reference(one) &&
          (!fastest || spread_of(one.ping_ms).median < spread_of(fastest->ping_ms).median))
        fastest = &one;
    for (Running& one : running_) {
      if (!fastest) one.ping_ms.clear();
      for (std::size_t turn = 0; turn < one.ping_ms.size(); ++turn)
        one.speedup.push_back(fastest->ping_ms[turn] / one.ping_ms[turn]);
    }
  }

  /// The first ping after the leap is not timed; it leaves the state that a track's next ping
  /// finds.
  double take_turn(Running& one, std::size_t begin) {
    Simulator& simulator = *one.simulator;
    SimulatorInternals::reset(simulator);
    simulator.ping_numbered(poses_[begin], begin);
    const StageTimes before = SimulatorInternals::times(simulator);
    const double took_s = turn_s([&](int i) {
      const std::size_t ping = begin + 1 + static_cast<std::size_t>(i);
      simulator.ping_numbered(poses_[ping], ping);
    });
    one.stages += SimulatorInternals::times(simulator) - before;
    one.spent_s += took_s;
    return 1e3 * took_s / turn_pings;
  }

  void finish(Running& one) {
    Cell& cell = one.cell;
    if (one.ping_ms.empty()) return;
    cell.ping_ms = spread_of(one.ping_ms);
    cell.speedup = spread_of(one.speedup);
    const StageTimes& stages = one.stages;
    const double to_ms = 1e3 / static_cast<double>(one.ping_ms.size() * turn_pings);
    cell.surface_ms = stages.surface_s * to_ms;
    cell.trace_ms = stages.trace_s * to_ms;
    cell.echo_ms = stages.echo_s * to_ms;
    cell.stages_over_ping =
        (stages.surface_s + stages.trace_s + stages.echo_s + stages.receive_s) / one.spent_s;
  }

  const Bed& bed_;
  const Size& size_;
  Scene scene_;
  const GridOptions& options_;
  std::vector<Scheme> wanted_;
  std::vector<Running> running_;
  std::vector<Pose> poses_;
};

}  // namespace

bool Cell::agrees() const {
  return checked_rays > 0 && wrong_numbers == 0 &&
         verdicts[static_cast<std::size_t>(Verdict::unexplained)] == 0 &&
         verdicts[static_cast<std::size_t>(Verdict::leak)] == 0;
}

std::vector<Cell> measure_grid(const GridOptions& options) {
  std::vector<Cell> all;
  for (const Size& size : sizes)
    for (const Bed& bed : beds()) {
      if (options.quick && size.faces > 1e6) continue;
      std::optional<Scene> scene = bed.scene(size.faces, options.data);
      if (!scene) {
        if (options.progress)
          options.progress(fmt::format("ping/{}/{}: left out, its data are missing (--data)",
                                       bed.name, size.name));
        continue;
      }
      scene->track.pings = 200;
      for (Cell& cell : BedMeasurement(bed, size, std::move(*scene), options).cells())
        all.push_back(std::move(cell));
    }
  return all;
}

}  // namespace ensonify::bench
