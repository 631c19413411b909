#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <ensonify/engine/trace/beam_ranges.h>
#include <ensonify/engine/trace/check/bent_rays.h>
#include <ensonify/engine/trace/check/candidate_worker.h>
#include <ensonify/engine/trace/check/limits.h>
#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// How far a comparison has come, and what it has found so far in all candidates' answers.
struct AgreementProgress {
  std::uint64_t rays = 0, of = 0;
  std::uint64_t unexplained = 0, leaks = 0;
};

/// Consecutive pings that one worker traces in order: the fans of each ping.
using PingBlock = std::vector<std::vector<RayFan>>;

struct AgreementOptions {
  std::uint64_t seed = 1;
  // About how many rays of each kind (see adversarial_rays.h).
  std::uint64_t aimed_fan_rays = 0;  ///< in fans aimed at the mesh
  std::uint64_t aimed_rays = 0;      ///< in lists
  bool bodies = false;  ///< repeats the first pings of some blocks, with bodies that move
  std::vector<HeightCandidate> heights = {};
  std::uint64_t plumb_lines = 0;  ///< how many places `heights` are compared at
  std::size_t bed_faces = 0;      ///< the bed's faces: those with the lowest numbers
  BentWater water = {};           ///< bends the rays of the blocks, if it has a profile
  std::uint64_t bent_every = 1;   ///< one in this many rays of the scene is compared as bent
  int threads = 1;                ///< does not change the result
  /// Called with the progress, from one thread at a time. If it returns false, the comparison ends
  /// and its rows cover the rays traced so far.
  std::function<bool(const AgreementProgress&)> progress = {};
};

/// Traces the same rays with every candidate and with the reference: the scene's pings in blocks,
/// as a run traces them, straight and bent, and rays aimed at the mesh's weak places. Returns one
/// row for each candidate and each source of rays that it traced. A candidate that takes no lists
/// of rays has no row for lists. Throws std::invalid_argument for an empty mesh, and what
/// intersectors throw.
std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const PingBlock> blocks,
                                  const AgreementOptions& options);

}  // namespace ensonify::engine
