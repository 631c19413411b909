#include <ensonify/engine/simulator/ping_all.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/simulator/track_warnings.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/parallel_for.h>
#include <ensonify/refine/standard_floats.h>

namespace ensonify::engine {

TrackPings::TrackPings(const Scene& scene, const Simulator& simulator)
    : artefacts_(scene.artefacts),
      navigation_(scene.navigation),
      seed_(scene.seed),
      block_pings_(static_cast<std::size_t>(scene.run.block_pings)) {
  TrackPoses track_poses = SimulatorInternals::track_poses(simulator);
  poses_ = std::move(track_poses.poses);
  leg_starts_ = std::move(track_poses.leg_starts);
  middle_ = track_poses.middle;
  warnings_ = std::move(track_poses.warnings);
  const std::span<const Sonar> sonars = simulator.sonars();
  const Seafloor& seafloor = simulator.seafloor();
  for (const std::optional<std::string>& warning :
       {coarse_planes_warning(sonars, simulator.sound_speed_mps(), seafloor, poses_),
        beyond_bed_warning(sonars, scene.seafloor, seafloor, poses_),
        short_range_warning(simulator, poses_)})
    if (warning) warnings_.push_back(*warning);
  recorded_.resize(poses_.size());
  for (std::size_t ping = 0; ping < poses_.size(); ++ping) recorded_[ping] = recorded_at(ping);
}

// A repeated ping repeats what was recorded last, with the truth layers. The first ping that is not
// lost has nothing to repeat and is recorded itself.
std::size_t TrackPings::recorded_at(std::size_t ping) const {
  const auto lost = [&](std::size_t number) { return is_lost(artefacts_, seed_, number); };
  if (lost(ping)) return none;
  std::size_t then = ping;
  while (then > 0 && (is_repeated(artefacts_, seed_, then) || (then != ping && lost(then)))) --then;
  while (lost(then)) ++then;
  return then;
}

// A stale report keeps its values, and gets the time of the ping.
Pose TrackPings::reported_at(std::size_t ping) const {
  Pose report =
      reported_pose(navigation_, seed_, poses_, reporting_ping(artefacts_, seed_, poses_, ping));
  report.t_s = poses_[ping].t_s;
  return report;
}

// The shorter one of the times to the pings before and after, because a track may pause between its
// legs.
double TrackPings::interval_s(std::size_t ping) const {
  if (poses_.size() < 2) return 0.0;
  double shortest_s = std::numeric_limits<double>::infinity();
  if (ping > 0) shortest_s = poses_[ping].t_s - poses_[ping - 1].t_s;
  if (ping + 1 < poses_.size())
    shortest_s = std::min(shortest_s, poses_[ping + 1].t_s - poses_[ping].t_s);
  return shortest_s;
}

TrackPings::PingRecord TrackPings::record_ping(Simulator& simulator, std::size_t ping,
                                               refine::SpareThreads* spare) const {
  const Pose& pose = poses_[ping];
  PingRecord record{.row = {.pose = pose,
                            .reported = reported_at(ping),
                            .altitude_m = simulator.altitude_m(pose.position),
                            .block = static_cast<int>(block_of(ping)),
                            .recorded = recorded_[ping] != none,
                            .interval_s = interval_s(ping)}};
  if (ping > 0 && reported_since_s(artefacts_, seed_, pose.t_s) < pose.t_s)
    record.row.artefacts.add(Artefact::stale_navigation);
  const std::size_t then = recorded_[ping];
  if (is_lost(artefacts_, seed_, ping))
    record.row.artefacts.add(Artefact::lost);
  else if (then != ping)
    record.row.artefacts.add(Artefact::repeated);
  if (then == none) return record;  // its row stays empty
  if (spare) {
    const std::size_t last = std::min((block_of(ping) + 1) * block_pings_, poses_.size()) - 1;
    SimulatorInternals::announce(simulator, poses_,
                                 std::span(recorded_).first(last + 1).subspan(ping + 1), *spare);
  }
  record.lines = simulator.ping_numbered(poses_[then], then);
  return record;
}

bool TrackPings::verify(Simulator& simulator, std::size_t ping, AgreementCounts& counts) const {
  if (recorded_[ping] == none) return false;
  counts += SimulatorInternals::verify(simulator, poses_[recorded_[ping]]);
  return true;
}

namespace {

/// What a simulator has counted in its life.
struct Counted {
  explicit Counted(const Simulator& simulator)
      : refraction(SimulatorInternals::refraction_counts(simulator)),
        stages(SimulatorInternals::times(simulator)) {
    for (std::size_t i = 0; i < simulator.sonars().size(); ++i) {
      const std::span<const ObjectVisibility> views =
          SimulatorInternals::object_visibility(simulator, i);
      object_visibility.emplace_back(views.begin(), views.end());
    }
  }
  std::vector<std::vector<ObjectVisibility>> object_visibility;
  RefractionCounts refraction;
  StageTimes stages;
};

/// Adds what was counted between two moments of a simulator's life.
void add_counts(const Counted& before, const Counted& after, ScenePings& to) {
  to.stages += after.stages - before.stages;
  to.refraction += after.refraction - before.refraction;
  to.object_visibility.resize(after.object_visibility.size());
  for (std::size_t i = 0; i < after.object_visibility.size(); ++i) {
    const std::vector<ObjectVisibility>& now = after.object_visibility[i];
    std::vector<ObjectVisibility> then = before.object_visibility[i];
    then.resize(now.size());  // there are no counts before the simulator's first ping
    to.object_visibility[i].resize(now.size());
    for (std::size_t k = 0; k < now.size(); ++k) to.object_visibility[i][k] += now[k] - then[k];
  }
}

/// Room for the pings' rows of each sonar.
std::vector<Waterfall> images_for(const PingRange& pings, std::span<const Sonar> sonars) {
  std::vector<Waterfall> images;
  for (const Sonar& sonar : sonars) images.emplace_back(sonar, pings.count, pings.first);
  return images;
}

/// Sets the rows of a ping, counted in the images.
void set_ping(std::vector<Waterfall>& images, std::size_t ping, TrackPings::PingRecord record) {
  for (Waterfall& image : images) record.lines = image.set_ping(ping, record.lines, record.row);
}

/// A part while its pings are made.
struct OpenPart {
  OpenPart(const PingRange& its_range, std::span<const Sonar> sonars)
      : range(its_range), next(range.first), left(range.count) {
    pings.pings = range;
    pings.images = images_for(range, sonars);
  }
  PingRange range;
  std::size_t next;  // the first ping that no thread has taken
  std::size_t left;  // pings that are not done
  ScenePings pings;
};

/// Pings while they are made: what their threads share.
class Pings {
 public:
  Pings(const Scene& scene, Simulator& simulator, const TrackPings& track, const PartWork& work)
      : block_pings_(static_cast<std::size_t>(scene.run.block_pings)),
        simulator_(simulator),
        track_(track),
        work_(work),
        neighbour_pings_(neighbour_pings(scene.display, simulator.sonars())),
        verify_(std::min(work.verify_pings, track.count())) {
    SimulatorInternals::count_object_visibility(simulator);
  }

  void make(int threads) {
    threads = refine::thread_count(threads);
    clones_.resize(static_cast<std::size_t>(threads));
    if (work_.after_block) work_.after_block({}, 0);
    refine::parallel_for(
        clones_.size(), threads,
        [&](std::size_t, int worker) {
          try {
            do_blocks(static_cast<std::size_t>(worker));
          } catch (...) {
            stop_ = true;
            throw;
          }
        },
        &spare_);
  }

 private:
  struct Block {
    std::shared_ptr<OpenPart> part;
    PingRange pings;
  };

  std::optional<Block> next_block() {
    const std::lock_guard lock(parts_lock_);
    if (stop_) return std::nullopt;
    if (!newest_ || newest_->next == newest_->range.end()) {
      newest_.reset();
      const std::optional<PingRange> range = work_.next_part();
      if (!range) return std::nullopt;
      newest_ = std::make_shared<OpenPart>(*range, simulator_.sonars());
    }
    const std::size_t first = newest_->next;
    const std::size_t end =
        std::min((track_.block_of(first) + 1) * block_pings_, newest_->range.end());
    newest_->next = end;
    return Block{newest_, {first, end - first}};
  }

  void do_blocks(std::size_t worker) {
    while (std::optional<Block> block = next_block()) {
      std::optional<Simulator>& clone = clones_[worker];
      if (worker > 0 && !clone) clone = simulator_.clone_for_thread();
      Simulator& mine = worker > 0 ? *clone : simulator_;
      OpenPart& part = *block->part;
      const Counted before(mine);
      SimulatorInternals::reset(mine);
      for (std::size_t ping = block->pings.first; ping < block->pings.end(); ++ping)
        do_ping(mine, ping, part);
      if (!close(part, block->pings.count, before, mine)) continue;
      const std::shared_ptr<OpenPart> whole = std::move(block->part);
      whole->pings.neighbours = neighbours(mine, whole->range);
      work_.finished(whole->range, std::move(whole->pings), mine);
    }
  }

  /// Counts a block. Returns true if it was the last one of its part.
  bool close(OpenPart& part, std::size_t pings, const Counted& before, const Simulator& mine) {
    const std::unique_lock alone(images_lock_);
    add_counts(before, Counted(mine), part.pings);
    part.left -= pings;
    done_ += pings;
    if (work_.after_block) work_.after_block(part.pings.images, done_);
    return part.left == 0;
  }

  void do_ping(Simulator& simulator, std::size_t ping, OpenPart& part) {
    const TrackPings::PingRecord record = track_.record_ping(simulator, ping, &spare_);
    std::uint64_t rays = 0, hits = 0;
    {
      const std::shared_lock rows_differ(images_lock_);
      for (const EchoLine& line : record.lines) {
        rays += line.rays;
        hits += line.hits;
      }
      set_ping(part.pings.images, ping - part.range.first, record);
    }
    AgreementCounts counts;
    const bool verified = is_verified(ping) && track_.verify(simulator, ping, counts);
    const std::lock_guard alone(counts_lock_);
    part.pings.rays += rays;
    part.pings.hits += hits;
    if (!verified) return;
    ++part.pings.verified_pings;
    part.pings.verified += counts;
  }

  /// The pings before and after a part that the smoothing of its pictures reaches.
  std::vector<NeighbourRows> neighbours(Simulator& simulator, const PingRange& part) const {
    const auto made = [&](std::size_t first, std::size_t end) {
      const PingRange pings{first, end - first};
      std::vector<Waterfall> images = images_for(pings, simulator.sonars());
      SimulatorInternals::reset(simulator);
      for (std::size_t i = 0; i < pings.count; ++i)
        set_ping(images, i, track_.record_ping(simulator, first + i));
      return images;
    };
    std::vector<Waterfall> before =
        made(part.first - std::min(part.first, neighbour_pings_), part.first);
    std::vector<Waterfall> after =
        made(part.end(), std::min(part.end() + neighbour_pings_, track_.count()));
    std::vector<NeighbourRows> of_images;
    for (std::size_t i = 0; i < before.size(); ++i)
      of_images.push_back({std::move(before[i]), std::move(after[i])});
    return of_images;
  }

  /// The middle pings of equal parts of the track.
  bool is_verified(std::size_t ping) const {
    const std::size_t part = ping * verify_ / track_.count();
    return verify_ > 0 && ping == (2 * part + 1) * track_.count() / (2 * verify_);
  }

  std::size_t block_pings_;
  Simulator& simulator_;  // of worker 0
  const TrackPings& track_;
  const PartWork& work_;
  std::size_t neighbour_pings_;
  std::size_t verify_;
  std::vector<std::optional<Simulator>> clones_;  // by worker
  refine::SpareThreads spare_;
  std::mutex parts_lock_;  // of newest_
  std::shared_ptr<OpenPart> newest_;
  std::atomic<bool> stop_ = false;
  std::mutex counts_lock_;  // of the counts of parts
  // Shared: each thread writes other rows; alone: all rows are read.
  std::shared_mutex images_lock_;
  std::size_t done_ = 0;
};

std::string rays_for_threads(std::span<const Sonar> sonars, int threads) {
  return fmt::format(
      "the {:.2g} million rays of a ping{}, for {} thread{}", 1e-6 * rays_of(sonars),
      std::ranges::any_of(sonars, &Sonar::steers) ? " and the bins of its beams" : "", threads,
      threads == 1 ? "" : "s");
}

std::string fewer_rays(std::span<const Sonar> sonars) {
  return std::ranges::any_of(sonars, &Sonar::steers) ? "use fewer elevations, planes, beams or bins"
                                                     : "use fewer elevations or planes";
}

}  // namespace

void ping_parts(const Scene& scene, Simulator& simulator, const TrackPings& track, int threads,
                const PartWork& work) {
  with_memory_for("the pings", [&] { Pings(scene, simulator, track, work).make(threads); });
}

ScenePings ping_as_one(const Scene& scene, Simulator& simulator, const TrackPings& track,
                       int threads, const AfterBlock& after_block, std::size_t verify_pings) {
  ScenePings all;
  bool taken = false;
  ping_parts(scene, simulator, track, threads,
             {.next_part = [&]() -> std::optional<PingRange> {
                if (std::exchange(taken, true)) return std::nullopt;
                return PingRange{0, track.count()};
              },
              .finished = [&](const PingRange&, ScenePings pings,
                              const Simulator&) { all = std::move(pings); },
              .after_block =
                  [&](std::span<const Waterfall> images, std::size_t pings) {
                    if (after_block) after_block(images, pings, track.count());
                  },
              .verify_pings = verify_pings});
  return all;
}

ScenePings ping_all(const Scene& scene, Simulator& simulator, int threads,
                    const AfterBlock& after_block, const MemoryLimit& memory) {
  const refine::StandardFloats floats;
  const TrackPings track(scene, simulator);
  require_pings(memory, scene.run, simulator.sonars(),
                {.pings = track.count(), .images = track.count(), .threads = threads});
  return ping_as_one(scene, simulator, track, threads, after_block);
}

std::size_t neighbour_pings(const Display& display, std::span<const Sonar> sonars) {
  const std::size_t rows = smoothed_rows(display);
  std::size_t pings = 0;
  for (const Sonar& sonar : sonars) {
    const auto beams = static_cast<std::size_t>(sonar.beams);
    pings = std::max(pings, (rows + beams - 1) / beams);
  }
  return pings;
}

double image_bytes(std::span<const Sonar> sonars, std::size_t pings) {
  double bytes_a_bin = 0.0, bins = 0.0;
  BinLayers::for_each([&](std::string_view, auto layer) {
    bytes_a_bin += sizeof(typename std::decay_t<decltype(BinLayers{}.*layer)>::value_type);
  });
  for (const Sonar& sonar : sonars)
    bins += static_cast<double>(sonar.sectors().size()) * sonar.bins * sonar.beams;
  return bytes_a_bin * bins * static_cast<double>(pings);
}

double rays_of(std::span<const Sonar> sonars) {
  double rays = 0.0;
  for (const Sonar& sonar : sonars)
    rays += static_cast<double>(sonar.sectors().size()) *
            sonar.fan_planes(scatter::nominal_sound_speed_mps / sonar.frequency_hz) *
            sonar.elevations;
  return rays;
}

double ray_bytes(std::span<const Sonar> sonars, std::string_view intersector) {
  // Bytes per ray, measured.
  double bytes = rays_of(sonars) * (intersector_kind(intersector).builds_tree ? 43.0 : 130.0);
  for (const Sonar& sonar : sonars) {
    if (!sonar.steers()) continue;
    // The tables of planes x bins and of beams x bins, and the lines of both.
    constexpr double bytes_a_plane = 96.0, bytes_a_beam = 116.0;
    bytes +=
        sonar.bins *
        (bytes_a_plane * sonar.fan_planes(scatter::nominal_sound_speed_mps / sonar.frequency_hz) +
         bytes_a_beam * sonar.beams);
  }
  return bytes;
}

void require_rays(const MemoryLimit& memory, std::span<const Sonar> sonars,
                  std::string_view intersector, int threads) {
  memory.require(threads * ray_bytes(sonars, intersector), rays_for_threads(sonars, threads) + ",",
                 fewer_rays(sonars));
}

double require_pings(const MemoryLimit& memory, const RunOptions& options,
                     std::span<const Sonar> sonars, const PingWork& work) {
  const double of_images = image_bytes(sonars, work.images);
  memory.require(of_images, fmt::format("the images of {} pings", work.images),
                 "use fewer pings, fewer bins or a smaller output.pings_per_file");
  const auto block = static_cast<std::size_t>(options.block_pings);
  const std::size_t blocks = (work.pings + block - 1) / block;
  const auto threads =
      static_cast<int>(std::min<std::size_t>(refine::thread_count(work.threads), blocks));
  const double bytes = of_images + threads * ray_bytes(sonars, options.intersector);
  memory.require(bytes,
                 fmt::format("{}, and the images of {} pings,", rays_for_threads(sonars, threads),
                             work.images),
                 fewer_rays(sonars) + ", fewer threads, or run the sonars in several scenes");
  return bytes;
}

}  // namespace ensonify::engine
