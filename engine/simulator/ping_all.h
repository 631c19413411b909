#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/simulator/internals.h>

namespace ensonify::engine {

/// Consecutive pings of a track.
struct PingRange {
  std::size_t first = 0, count = 0;
  std::size_t end() const { return first + count; }
};

struct ScenePings {
  PingRange pings;
  std::vector<Waterfall> images;          ///< one per sonar
  std::vector<NeighbourRows> neighbours;  ///< of the images, as far as the display smooths
  std::vector<std::vector<ObjectVisibility>>
      object_visibility;  ///< by sonar, as SimulatorInternals::object_visibility()
  std::uint64_t rays = 0, hits = 0;
  RefractionCounts refraction;
  StageTimes stages;                 ///< summed over threads
  std::uint64_t verified_pings = 0;  ///< pings that were compared with the reference
  AgreementCounts verified;          ///< the result of the comparison
};

class TrackPings {
 public:
  /// Throws SceneError for a track that leaves the seafloor.
  TrackPings(const Scene& scene, const Simulator& simulator);

  std::size_t count() const { return poses_.size(); }
  std::span<const Pose> poses() const { return poses_; }
  /// As in TrackPoses.
  std::span<const std::size_t> leg_starts() const { return leg_starts_; }
  const std::optional<GeographicPlace>& middle() const { return middle_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  struct PingRecord {
    PingRow row;
    std::span<const EchoLine> lines;  ///< empty for a lost ping; valid until the next ping
  };
  /// A ping as a run records it. simulator: one of this seafloor. Any number of threads may call
  /// this, each with a separate simulator. Meanwhile spare threads prepare the faces of the block's
  /// next pings. Throws as Simulator::ping_numbered().
  PingRecord record_ping(Simulator& simulator, std::size_t ping,
                         refine::SpareThreads* spare = nullptr) const;

  std::size_t block_of(std::size_t ping) const { return ping / block_pings_; }
  /// Compares the ping with the reference as SimulatorInternals::verify(); false if nothing was
  /// recorded.
  bool verify(Simulator& simulator, std::size_t ping, AgreementCounts& counts) const;

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::size_t recorded_at(std::size_t ping) const;
  Pose reported_at(std::size_t ping) const;
  double interval_s(std::size_t ping) const;

  // Of each ping no more than its pose and a number is kept, because a track may have millions.
  ArtefactOptions artefacts_;
  NavigationOptions navigation_;
  std::uint64_t seed_;
  std::size_t block_pings_;
  std::vector<Pose> poses_;
  std::vector<std::size_t> leg_starts_;
  std::vector<std::size_t> recorded_;  // by ping: the ping whose echo is recorded, or none
  std::optional<GeographicPlace> middle_;
  std::vector<std::string> warnings_;
};

/// What the caller of ping_parts() provides.
struct PartWork {
  /// The next part to ping; none: no more. Called by one thread at a time.
  std::function<std::optional<PingRange>()> next_part;
  /// Takes a part whose pings are done. The thread that made the last ping calls it, with the
  /// Simulator of this thread, while other threads may ping other parts.
  std::function<void(const PingRange& part, ScenePings pings, const Simulator& simulator)> finished;
  /// Called once before the first block, and after every block by one thread while no other thread
  /// sets rows. Arguments: the images of the block's part (none before the first block), and how
  /// many pings are done. An exception from it ends the work.
  std::function<void(std::span<const Waterfall> images, std::size_t pings)> after_block = {};
  std::size_t verify_pings = 0;  ///< of the whole track, spread over it
};

/// Pings parts of a scene's track, in aligned blocks over threads (0: one per core of the machine),
/// by simulators that share the seafloor of this one. The images of a part exist from its first
/// ping until finished() returns; at most one part per thread and one more exist at a time. The
/// smoothing of a part's pictures needs the pings before and after the part. These pings are made
/// after the part and are not counted. Throws as
/// Simulator::ping_numbered(), and what PartWork throws.
void ping_parts(const Scene& scene, Simulator& simulator, const TrackPings& track, int threads,
                const PartWork& work);

/// PartWork::after_block, with the number of all pings as a further argument.
using AfterBlock =
    std::function<void(std::span<const Waterfall> images, std::size_t pings, std::size_t of)>;

/// Every ping of the track, as one part. Throws as ping_parts().
ScenePings ping_as_one(const Scene& scene, Simulator& simulator, const TrackPings& track,
                       int threads, const AfterBlock& after_block, std::size_t verify_pings = 0);

/// Every ping of a scene's track. Throws SceneError for a track that leaves the seafloor,
/// MemoryError for images or rays that do not fit, and as ping_parts().
ScenePings ping_all(const Scene& scene, Simulator& simulator, int threads,
                    const AfterBlock& after_block = {}, const MemoryLimit& memory = {});

/// The most pings on each side of a part that are its neighbours.
std::size_t neighbour_pings(const Display& display, std::span<const Sonar> sonars);

/// The bytes in memory of the sonars' images of this many pings; their files need more.
double image_bytes(std::span<const Sonar> sonars, std::size_t pings);
/// The rays of a ping of all these sonars.
double rays_of(std::span<const Sonar> sonars);
/// The least bytes that the rays of one ping of all these sonars take in each thread that pings,
/// and the bins of steered beams.
double ray_bytes(std::span<const Sonar> sonars, std::string_view intersector);
/// Throws MemoryError unless the rays of a ping of all these sonars fit, for each of the threads
/// that ping.
void require_rays(const MemoryLimit& memory, std::span<const Sonar> sonars,
                  std::string_view intersector, int threads = 1);

/// The pings that threads (0: one per core of the machine) make from a scene.
struct PingWork {
  std::size_t pings = 0;
  std::size_t images = 0;  ///< number of pings whose images are in memory at one time
  int threads = 0;
};
/// The sum of the bytes of the images, and of the rays of the threads that have a block of pings.
/// Throws MemoryError if they do not fit.
double require_pings(const MemoryLimit& memory, const RunOptions& options,
                     std::span<const Sonar> sonars, const PingWork& work);

}  // namespace ensonify::engine
