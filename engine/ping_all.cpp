#include <ensonify/engine/ping_all.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/sonar/echo/plane_spacing.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
TrackPings::TrackPings(const Scene& scene, const Simulator& simulator)
    : artefacts_(scene.artefacts),
      seed_(scene.seed),
      block_pings_(static_cast<std::size_t>(scene.run.block_pings)) {
  TrackPoses track_poses = SimulatorInternals::track_poses(simulator);
  poses_ = std::move(track_poses.poses);
  warnings_ = std::move(track_poses.warnings);
  if (auto warning = coarse_planes_warning(simulator.sonars(), simulator.sound_speed_mps(),
                                           simulator.seafloor(), poses_))
    warnings_.push_back(std::move(*warning));
  reported_ = reported_poses(scene.navigation, scene.seed, poses_);
  hold_stale(scene.artefacts, scene.seed, reported_);
  for (std::size_t ping = 0; ping < poses_.size(); ++ping) {
    recorded_.push_back(recorded_at(ping));
    if (recorded_.back() != none) sent_.push_back(poses_[recorded_.back()]);
    sent_until_.push_back(sent_.size());
  }
}

// A repeated ping repeats what was recorded last, its truth layers included.
std::size_t TrackPings::recorded_at(std::size_t ping) const {
  const auto lost = [&](std::size_t number) { return is_lost(artefacts_, seed_, number); };
  if (lost(ping)) return none;
  std::size_t then = ping;
  while (then > 0 && (is_repeated(artefacts_, seed_, then) || (then != ping && lost(then)))) --then;
  return lost(then) ? none : then;
}

TrackPings::RecordedPing TrackPings::hear(Simulator& simulator, std::size_t ping,
                                          refine::SpareThreads* spare) const {
  const Pose& pose = poses_[ping];
  RecordedPing heard{.record = {.pose = pose,
                                .reported = reported_[ping],
                                .altitude_m = simulator.altitude_m(pose.position),
                                .block = static_cast<int>(block_of(ping))}};
  if (reported_since_s(artefacts_, seed_, pose.t_s) < pose.t_s)
    heard.record.artefacts.add(Artefact::stale_navigation);
  const std::size_t then = recorded_[ping];
  if (is_lost(artefacts_, seed_, ping))
    heard.record.artefacts.add(Artefact::lost);
  else if (then != ping)
    heard.record.artefacts.add(Artefact::repeated);
  if (then == none) return heard;  // its row stays empty
  if (spare) {
    const std::size_t last = std::min((block_of(ping) + 1) * block_pings_, poses_.size()) - 1;
    SimulatorInternals::expect(
        simulator, std::span(sent_).first(sent_until_[last]).subspan(sent_until_[ping]), *spare);
  }
  heard.lines = simulator.ping_numbered(poses_[then], then);
  return heard;
}

bool TrackPings::verify(Simulator& simulator, std::size_t ping, AgreementCounts& counts) const {
  if (recorded_[ping] == none) return false;
  counts += SimulatorInternals::verify(simulator, poses_[recorded_[ping]]);
  return true;
}

namespace {

/// A scene's pings while they are made: what their threads share.
class Pings {
 public:
  Pings(const Scene& scene, Simulator& simulator, const MemoryLimit& memory,
        std::size_t verify_pings)
      : scene_(scene), track_(scene, simulator), verify_(std::min(verify_pings, track_.count())) {
    require_images(memory, simulator.sonars(), track_.count());
    all_.warnings = track_.warnings();
    SimulatorInternals::count_object_visibility(simulator);
    for (const Sonar& sonar : simulator.sonars()) all_.images.emplace_back(sonar, track_.count());
  }

  ScenePings make(Simulator& simulator, int threads, const AfterBlock& after_block) {
    const auto block_pings = static_cast<std::size_t>(scene_.run.block_pings);
    const std::size_t blocks = (track_.count() + block_pings - 1) / block_pings;
    threads = refine::thread_count(threads);
    std::vector<std::optional<Simulator>> others(static_cast<std::size_t>(threads));
    if (after_block) after_block(all_.images, 0, track_.count());
    refine::SpareThreads spare;
    const auto do_block = [&](std::size_t block, int worker) {
      std::optional<Simulator>& other = others[static_cast<std::size_t>(worker)];
      if (worker > 0 && !other) other = simulator.clone_for_thread();
      Simulator& mine = worker > 0 ? *other : simulator;
      const std::size_t begin = block * block_pings;
      const std::size_t end = std::min(begin + block_pings, track_.count());
      SimulatorInternals::reset(mine);
      for (std::size_t ping = begin; ping < end; ++ping) do_ping(mine, ping, spare);
      const std::unique_lock alone(images_lock_);
      done_ += end - begin;
      if (after_block) after_block(all_.images, done_, track_.count());
    };
    refine::parallel_for(blocks, threads, do_block, &spare);
    all_.rays = rays_;
    all_.hits = hits_;
    take_counts(simulator);
    for (const std::optional<Simulator>& other : others)
      if (other) take_counts(*other);
    return std::move(all_);
  }

 private:
  void take_counts(const Simulator& simulator) {
    all_.stages += SimulatorInternals::times(simulator);
    all_.refraction += SimulatorInternals::refraction_counts(simulator);
    all_.object_visibility.resize(all_.images.size());
    for (std::size_t i = 0; i < all_.images.size(); ++i) {
      const std::span<const ObjectView> views = SimulatorInternals::object_visibility(simulator, i);
      all_.object_visibility[i].resize(views.size());
      for (std::size_t k = 0; k < views.size(); ++k) all_.object_visibility[i][k] += views[k];
    }
  }

  void do_ping(Simulator& simulator, std::size_t ping, refine::SpareThreads& spare) {
    TrackPings::RecordedPing heard = track_.hear(simulator, ping, &spare);
    const std::shared_lock rows_differ(images_lock_);
    for (Waterfall& image : all_.images) {
      const std::size_t sides = heard.lines.empty() ? 0 : sides_of(image.sonar).size();
      image.set_row(ping, heard.lines.first(sides), heard.record);
      for (const EchoLine& line : heard.lines.first(sides)) {
        rays_ += line.rays;
        hits_ += line.hits;
      }
      heard.lines = heard.lines.subspan(sides);
    }
    if (!is_verified(ping)) return;
    AgreementCounts counts;
    if (!track_.verify(simulator, ping, counts)) return;
    const std::lock_guard alone(verified_lock_);
    ++all_.verified_pings;
    all_.verified += counts;
  }

  /// The middle pings of equal parts of the track.
  bool is_verified(std::size_t ping) const {
    const std::size_t part = ping * verify_ / track_.count();
    return verify_ > 0 && ping == (2 * part + 1) * track_.count() / (2 * verify_);
  }

  const Scene& scene_;
  TrackPings track_;
  std::size_t verify_;
  ScenePings all_;
  std::mutex verified_lock_;
  std::shared_mutex images_lock_;  // shared: each thread writes its own rows; alone: all are read
  std::atomic<std::uint64_t> rays_ = 0, hits_ = 0;
  std::size_t done_ = 0;
};

}  // namespace

ScenePings ping_all(const Scene& scene, Simulator& simulator, int threads,
                    const AfterBlock& after_block, const MemoryLimit& memory,
                    std::size_t verify_pings) {
  return with_memory_for("the pings", [&] {
    return Pings(scene, simulator, memory, verify_pings).make(simulator, threads, after_block);
  });
}

double image_bytes(std::span<const Sonar> sonars, std::size_t pings) {
  double bytes_a_bin = 0.0, bins = 0.0;
  BinLayers::for_each([&](std::string_view, auto layer) {
    bytes_a_bin += sizeof(typename std::decay_t<decltype(BinLayers{}.*layer)>::value_type);
  });
  for (const Sonar& sonar : sonars)
    bins += static_cast<double>(sides_of(sonar).size()) * sonar.bins;
  return bytes_a_bin * bins * static_cast<double>(pings);
}

void require_images(const MemoryLimit& memory, std::span<const Sonar> sonars, std::size_t pings) {
  memory.require(image_bytes(sonars, pings), fmt::format("the images of {} pings", pings),
                 "take fewer pings, or fewer bins");
}

}  // namespace ensonify::engine
