#include <ensonify/engine/ping_all.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <utility>

#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

/// A scene's pings while they are made: what their threads share.
class Pings {
 public:
  Pings(const Scene& scene, Simulator& simulator) : scene_(scene) {
    Flight flight = simulator.flight();
    poses_ = std::move(flight.poses);
    all_.warnings = std::move(flight.warnings);
    reported_ = reported_poses(scene.navigation, scene.seed, poses_);
    simulator.watch_objects();
    hold_stale(scene.artefacts, scene.seed, reported_);
    for (const Sonar& sonar : simulator.sonars()) all_.images.emplace_back(sonar, poses_.size());
  }

  ScenePings make(Simulator& simulator, int threads, const AfterBlock& after_block) {
    const auto block_pings = static_cast<std::size_t>(scene_.run.block_pings);
    const std::size_t blocks = (poses_.size() + block_pings - 1) / block_pings;
    threads = refine::thread_count(threads);
    std::vector<std::optional<Simulator>> others(static_cast<std::size_t>(threads));
    if (after_block) after_block(all_.images, 0, poses_.size());
    refine::parallel_for(blocks, threads, [&](std::size_t block, int worker) {
      std::optional<Simulator>& other = others[static_cast<std::size_t>(worker)];
      if (worker > 0 && !other) other = simulator.another();
      Simulator& mine = worker > 0 ? *other : simulator;
      const std::size_t begin = block * block_pings;
      const std::size_t end = std::min(begin + block_pings, poses_.size());
      mine.reset();
      for (std::size_t ping = begin; ping < end; ++ping) do_ping(mine, ping, block);
      const std::unique_lock alone(images_lock_);
      done_ += end - begin;
      if (after_block) after_block(all_.images, done_, poses_.size());
    });
    all_.rays = rays_;
    all_.hits = hits_;
    take_counts(simulator);
    for (const std::optional<Simulator>& other : others)
      if (other) take_counts(*other);
    return std::move(all_);
  }

 private:
  void take_counts(const Simulator& simulator) {
    all_.stages += simulator.times();
    all_.refraction += simulator.refraction_counts();
    all_.object_views.resize(all_.images.size());
    for (std::size_t i = 0; i < all_.images.size(); ++i) {
      const std::span<const ObjectView> views = simulator.object_views(i);
      all_.object_views[i].resize(views.size());
      for (std::size_t k = 0; k < views.size(); ++k) all_.object_views[i][k] += views[k];
    }
  }

  void do_ping(Simulator& simulator, std::size_t ping, std::size_t block) {
    const Pose& pose = poses_[ping];
    PingRecord record{.pose = pose,
                      .reported = reported_[ping],
                      .altitude_m = simulator.altitude_m(pose.position),
                      .block = static_cast<int>(block)};
    const ArtefactOptions& artefacts = scene_.artefacts;
    if (reported_since_s(artefacts, scene_.seed, pose.t_s) < pose.t_s)
      record.artefacts.add(Artefact::stale_navigation);
    // What is recorded again is what was recorded last; the truth beside it as well.
    const auto lost = [&](std::size_t number) { return is_lost(artefacts, scene_.seed, number); };
    std::size_t heard = ping;
    while (!lost(ping) && heard > 0 &&
           (is_repeated(artefacts, scene_.seed, heard) || (heard != ping && lost(heard))))
      --heard;
    if (heard != ping) record.artefacts.add(Artefact::repeated);
    if (lost(ping)) record.artefacts.add(Artefact::lost);
    if (lost(heard)) {  // the row stays empty
      const std::shared_lock rows_differ(images_lock_);
      for (Waterfall& image : all_.images) image.pings[ping] = record;
      return;
    }
    std::span<const EchoLine> lines = simulator.ping(poses_[heard], heard);
    const std::shared_lock rows_differ(images_lock_);
    for (Waterfall& image : all_.images) {
      const std::size_t sides = sides_of(image.sonar).size();
      image.set_row(ping, lines.first(sides), record);
      for (const EchoLine& line : lines.first(sides)) {
        rays_ += line.rays;
        hits_ += line.hits;
      }
      lines = lines.subspan(sides);
    }
  }

  const Scene& scene_;
  std::vector<Pose> poses_, reported_;
  ScenePings all_;
  std::shared_mutex images_lock_;  // shared: each thread writes its own rows; alone: all are read
  std::atomic<std::uint64_t> rays_ = 0, hits_ = 0;
  std::size_t done_ = 0;
};

}  // namespace

ScenePings ping_all(const Scene& scene, Simulator& simulator, int threads,
                    const AfterBlock& after_block) {
  return Pings(scene, simulator).make(simulator, threads, after_block);
}

}  // namespace ensonify::engine
