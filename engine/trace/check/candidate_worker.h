#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/trace/check/bent_rays.h>
#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/check/tetrahedron.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>

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
  /// Makes one worker's tracer of bent rays, as a run has it; null: bent rays are left out.
  std::function<std::unique_ptr<RefractedTracer>()> make_bent = {};
};

/// The first ray to compare of an item of work, where only every n-th ray is compared. It differs
/// between items, so that they compare different rays.
std::uint64_t first_turn(std::uint64_t number, std::uint64_t every);

/// A function for the height of the bed at (x, y); it returns NaN where there is no bed.
struct HeightCandidate {
  std::string surface, name;
  /// Makes one worker's instance.
  std::function<std::function<double(double x_m, double y_m)>()> make;
};

/// One thread's instances of all candidates. Each comparison adds one count per candidate to
/// `tallies`. `number` is the number of the item of work. It selects the first ray for candidates
/// that trace only every n-th ray.
class CandidateWorker {
 public:
  /// All must outlive this. `reference` is exact and answers lists of rays. A worker locks `large`
  /// while it holds memory that may grow with the whole mesh, so that only one worker at a time
  /// holds such memory.
  CandidateWorker(const Judge& judge, const Intersector& reference,
                  std::span<const Candidate> candidates, std::span<const HeightCandidate> heights,
                  std::mutex& large);

  /// The face sources forget earlier pings.
  void reset();

  /// The fans of one ping. `look_ahead` is called with each face source when it has its faces.
  void compare_ping(std::span<const RayFan> fans, std::uint64_t number,
                    const std::function<void(FaceSource&)>& look_ahead,
                    std::span<AgreementCounts> tallies);
  /// Some of the bent rays of the fans of one ping, as in BentReference::trace_some().
  void compare_bent(std::span<const RayFan> fans, const BentReference& reference,
                    std::uint64_t every, std::uint64_t& turn, std::span<AgreementCounts> tallies);
  /// One fan, with temporary face sources, so that the memory of a wide fan is freed.
  void compare_fan(const RayFan& fan, std::uint64_t number, std::span<AgreementCounts> tallies);
  /// Candidates that take no lists are left out.
  void compare_list(std::span<const Ray> rays, std::uint64_t number,
                    std::span<AgreementCounts> tallies);

  /// Puts tetrahedra at random places in the water; each call replaces those of the last one. The
  /// caller locks `large` from the first call until remove_bodies() returns: face sources join
  /// copies of their faces with the bodies.
  void put_bodies(std::span<const RayFan> fans, std::uint64_t seed, std::uint64_t number,
                  std::uint64_t ping);
  /// The fans of one ping, with the bodies. The reference has them and the faces near the fans in
  /// a separate tree. `bounds` are the mesh's.
  void compare_with_bodies(std::span<const RayFan> fans, std::uint64_t number,
                           const refine::Bounds& bounds, std::span<AgreementCounts> tallies);
  void remove_bodies();

  /// Rays straight down; one count per height candidate. The bed's faces have the lowest numbers.
  void compare_heights(std::span<const Ray> rays, std::size_t bed_faces,
                       std::span<AgreementCounts> tallies);

 private:
  /// Hits of all fans of a ping, by ray number.
  using PingHits = std::vector<std::vector<Hit>>;

  void find_expected(const Intersector& reference, std::span<const RayFan> fans);
  Faces prepare(std::size_t c, FaceSource& surface, std::span<const RayFan> fans,
                FanComparison& comparison);
  void compare_candidate(std::size_t c, const Faces& faces, std::span<const RayFan> fans,
                         std::uint64_t number, FanComparison& comparison, AgreementCounts& tally);
  void choose(const RayFan& fan, std::span<const Hit> expected, std::uint64_t every,
              std::uint64_t number);

  const Judge& judge_;
  const Intersector& reference_;
  std::mutex& large_;
  std::span<const Candidate> candidates_;
  // By candidate.
  std::vector<std::unique_ptr<FacesWithBodies>> surfaces_;
  std::vector<FanComparison> comparisons_;
  std::vector<bool> takes_lists_;
  std::vector<std::size_t> twins_;  // the same intersector with static faces, or itself
  std::vector<std::unique_ptr<RefractedTracer>> bent_tracers_;
  std::vector<PingHits> hits_;  // of candidates that others are compared with
  std::vector<std::function<double(double, double)>> heights_;  // by height candidate
  std::vector<Tetrahedron> bodies_;
  // Memory.
  PingHits expected_;
  std::vector<Ray> chosen_;
  std::vector<Hit> expected_of_chosen_;
};

}  // namespace ensonify::engine
