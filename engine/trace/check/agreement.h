#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>

namespace ensonify::engine {

/// What is compared: a face source with an intersector. The candidate with static faces comes
/// before the others with the same intersector, whose answers are also compared with its own.
struct Candidate {
  std::string surface, intersector;  ///< names for the table
  /// Makes one worker's instance.
  std::function<std::unique_ptr<FacesWithBodies>()> make;
  Precision precision = Precision::in_float;  ///< of the intersector
  /// It has all faces for any fan, so lists of rays may be traced too.
  bool has_every_face = true;
  std::uint64_t every = 1;  ///< traces every n-th ray; if n > 1, as a list
};

/// A function for the height of the bed at (x, y); it returns NaN where there is no bed.
struct HeightCandidate {
  std::string surface, name;
  /// Makes one worker's instance.
  std::function<std::function<double(double x_m, double y_m)>()> make;
};

/// Where a comparison's rays come from.
enum class RaySource { scene, aimed_fans, aimed_rays, bodies, plumb_lines, faces };
inline constexpr std::array ray_source_names{"scene",  "aimed_fans",  "aimed_rays",
                                             "bodies", "plumb_lines", "faces"};

/// One line of the table.
struct AgreementRow : AgreementCounts {
  std::string surface, intersector;
  RaySource source = RaySource::scene;
  Precision precision = Precision::exact;
};

/// The largest share of a row's rays that may get a verdict, or be `coarse` or `unlike_static`.
struct Limit {
  std::string_view name;
  /// Which count; if null, the count of `verdict`.
  std::uint64_t AgreementCounts::*count = nullptr;
  Verdict verdict = Verdict::same;
  double share;
  std::uint64_t of(const AgreementCounts& tally) const {
    return count ? tally.*count : tally.count(verdict);
  }
};
/// The limits for rays as in runs (scene, bodies), or for rays aimed at weak places.
std::span<const Limit> limits(RaySource source, Precision precision);
bool exceeds(const Limit& limit, const AgreementCounts& tally);
/// The names of the limits that a row exceeds.
std::vector<std::string_view> exceeded_limits(const AgreementRow& row);

/// How many of a fan's rays are compared.
std::uint64_t rays_within_beam(const FanGrid& grid);

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
  int threads = 1;                ///< does not change the result
  /// Called with the progress, from one thread at a time. If it returns false, the comparison ends
  /// and its rows cover the rays traced so far.
  std::function<bool(const AgreementProgress&)> progress = {};
};

/// Traces the same rays with every candidate and with the reference: the scene's pings in blocks,
/// as a run traces them, and rays aimed at the mesh's weak places. Returns one row for each
/// candidate and each source of rays that it traced; a candidate that takes no lists of rays has
/// no row for those. Throws std::invalid_argument for an empty mesh, and what intersectors throw.
std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const PingBlock> blocks,
                                  const AgreementOptions& options);

/// The mesh that one ping is checked against: a progressive mesh's points, faces and face numbers.
struct CheckedMesh {
  refine::Triangles triangles;
  refine::Bounds bounds;
  std::size_t bed_faces;  ///< faces with lower numbers are the bed's
};

/// Compares one ping of a face source with the reference. The reference is built only over the
/// faces that the fans can touch, so no tree of the whole mesh is needed.
AgreementCounts compare_ping(FaceSource& surface, const CheckedMesh& mesh,
                             std::span<const RayFan> fans, Precision precision);
/// Compares the height of the bed at (x, y) in the same way; counts one ray.
AgreementCounts compare_height(const CheckedMesh& mesh, double x_m, double y_m, double height_m);

}  // namespace ensonify::engine
