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

/// What is compared: one surface with one intersector on it. The candidate with a static surface
/// stands before the others with its intersector: their answers are compared with its own, too.
struct Candidate {
  std::string surface, intersector;                        ///< their names, for the table
  std::function<std::unique_ptr<FacesWithBodies>()> make;  ///< one worker's own
  Precision precision = Precision::in_float;               ///< of the intersector
  bool has_every_face = true;  ///< whatever the fans: so lists of rays may be asked too
  std::uint64_t every = 1;     ///< asked one ray of so many, if more than 1 as a list
};

/// What tells how high the bed is at a place (x, y), NaN where there is none.
struct HeightCandidate {
  std::string surface, name;
  std::function<std::function<double(double x_m, double y_m)>()> make;  ///< one worker's own
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

/// The largest share of a row's rays that may be of a class, or `coarse`, or `unlike_static`.
struct Limit {
  std::string_view name;
  std::uint64_t AgreementCounts::*count = nullptr;  ///< or null, and then
  Verdict verdict = Verdict::same;                  ///< of this one
  double share;
  std::uint64_t of(const AgreementCounts& tally) const {
    return count ? tally.*count : tally.count(verdict);
  }
};
/// Those for what runs ask (scene, bodies), and those for rays that are aimed at trouble.
std::span<const Limit> limits(RaySource source, Precision precision);
bool exceeds(const Limit& limit, const AgreementCounts& tally);
/// The names of those that a row exceeds.
std::vector<std::string_view> exceeded_limits(const AgreementRow& row);

/// Of a fan's rays, those that are compared.
std::uint64_t rays_within_beam(const FanGrid& grid);

/// How far a comparison is, and what it has found till then, in the answers of all candidates.
struct AgreementProgress {
  std::uint64_t rays = 0, of = 0;
  std::uint64_t unexplained = 0, leaks = 0;
};

/// Consecutive pings that one worker asks in turn: the fans of each.
using PingBlock = std::vector<std::vector<RayFan>>;

struct AgreementOptions {
  std::uint64_t seed = 1;
  std::uint64_t aimed_fan_rays = 0;  ///< about so many in fans whose tables go through the mesh
  std::uint64_t aimed_rays = 0;      ///< so many in lists (for both see adversarial_rays.h)
  bool bodies = false;  ///< the first pings of some blocks again, with bodies that move
  std::vector<HeightCandidate> heights = {};
  std::uint64_t plumb_lines = 0;  ///< so many places are asked of those
  std::size_t bed_faces = 0;      ///< the first faces of the mesh, which they look for
  int threads = 1;                ///< no number changes the result
  /// Told how far it is, from one thread at a time. Returning false ends the comparison: its rows
  /// are of the rays that were asked till then.
  std::function<bool(const AgreementProgress&)> progress = {};
};

/// Asks every candidate and the reference the same rays: the scene's pings in blocks as a run has
/// them, and rays aimed at the mesh's weak places. A row for each candidate and source of rays that
/// it was asked; one that refuses lists of rays has none for those. Throws std::invalid_argument
/// for an empty mesh, and what intersectors throw.
std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const PingBlock> blocks,
                                  const AgreementOptions& options);

/// A mesh for the checks of one ping: of a progressive mesh its points, faces and numbers.
struct CheckedMesh {
  refine::Triangles triangles;
  refine::Bounds bounds;
  std::size_t bed_faces;  ///< those with lower numbers are the bed's
};

/// Compares one ping of a surface as it is with the reference, which is built over those faces
/// alone that the fans can touch: so this needs no tree of the whole mesh.
AgreementCounts compare_ping(FaceSource& surface, const CheckedMesh& mesh,
                             std::span<const RayFan> fans, Precision precision);
/// Likewise the height of the bed at a place; counts one ray.
AgreementCounts compare_height(const CheckedMesh& mesh, double x_m, double y_m, double height_m);

}  // namespace ensonify::engine
