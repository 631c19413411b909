#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/face_source.h>

namespace ensonify::engine {

/// One ray for which two intersectors give different hits.
struct Difference {
  Ray ray;
  Hit expected, found;
};

/// The counts of a comparison over some rays.
struct AgreementCounts {
  std::uint64_t rays = 0;
  std::array<std::uint64_t, verdict_names.size()> verdicts{};  ///< rays by Verdict
  // The largest difference in t over the rays with Verdict::same.
  double largest_dt_m = 0.0;
  double largest_dt_relative = 0.0;      ///< to t, without hits within rounding of the origin
  double largest_dt_of_tolerance = 0.0;  ///< relative to Judge::tolerance_m
  /// Hits whose tolerance is more than a tenth of the face's longest edge.
  std::uint64_t coarse = 0;
  std::uint64_t overlap = 0;        ///< ties that are Judge::is_overlap(): rounding decides
  std::uint64_t unlike_static = 0;  ///< rays whose bits differ from those with static faces
  /// Hits whose Hit::index leads to another face than Hit::face, or to other corners.
  std::uint64_t wrong_index = 0;
  /// Hits whose run in the echo has another face, or the face at another place.
  std::uint64_t wrong_run = 0;
  std::vector<Difference> unexplained;  ///< the first few

  std::uint64_t count(Verdict verdict) const { return verdicts[static_cast<std::size_t>(verdict)]; }
  void add(Verdict verdict, const Difference& difference);
  AgreementCounts& operator+=(const AgreementCounts& other);
};

/// Calls f(name, count) for the counts that a run's manifest has of its verification.
template <class Counts, class F>
void for_each_count(Counts& counts, F&& f) {
  f("rays", counts.rays);
  f("coarse", counts.coarse);
  f("overlap", counts.overlap);
  f("wrong_index", counts.wrong_index);
  f("wrong_run", counts.wrong_run);
  for (std::size_t i = 0; i < verdict_names.size(); ++i) f(verdict_names[i], counts.verdicts[i]);
}

/// The expected hits of some rays.
struct ExpectedHits {
  std::span<const Hit> by_reference;
  std::span<const Hit> on_static;  ///< the same intersector's on the static faces, or empty
};

/// Compares the answers of one intersector with the reference's and counts the verdicts. An answer
/// is also unexplained if Hit::index does not lead to the face; if the run that the echo gets does
/// not match the hit; and, unless the intersector computes in float, if its bits differ from those
/// of the answer with static faces. One thread at a time.
class FanComparison {
 public:
  /// The judge must outlive this.
  FanComparison(const Judge& judge, Precision precision) : judge_(&judge), precision_(precision) {}

  /// Prepares the face source for the fans of a ping, and keeps their runs as the echo gets them.
  /// Returns the faces for fan().
  Faces prepare(FaceSource& surface, std::span<const RayFan> fans);
  /// Compares all rays within the beam of fan `number`. A ray outside the beam must not hit, and
  /// counts only if it does. `expected` is by ray number. Afterwards found() returns the hits.
  void fan(std::size_t number, const Faces& faces, const RayFan& fan, const ExpectedHits& expected,
           AgreementCounts& tally);
  /// The same for a list of rays.
  void list(const Faces& faces, std::span<const Ray> rays, const ExpectedHits& expected,
            AgreementCounts& tally);
  std::span<const Hit> found() const { return found_; }

 private:
  /// The runs of a fan. If the face source gives no runs, they are made from the hits, as for the
  /// echo.
  struct Runs {
    FanRuns runs;
    bool listed;
    std::vector<bool> wrong_index;  // by run
  };
  bool leads_to_face(refine::Triangles triangles, std::uint32_t index, std::uint32_t face) const;
  void check_indices(refine::Triangles triangles, Runs& of) const;
  bool run_agrees(const RayFan& fan, std::size_t elevation, const Runs& of, std::size_t run,
                  const Ray& ray, const Hit& expected, const Hit& hit) const;
  void add(const Faces& faces, const Ray& ray, std::size_t number, const ExpectedHits& hits,
           bool run, AgreementCounts& tally) const;

  const Judge* judge_;
  Precision precision_;
  std::vector<Runs> runs_;           // by fan
  std::vector<std::size_t> run_of_;  // by ray of a plane; or none
  std::vector<Hit> found_;
};

}  // namespace ensonify::engine
