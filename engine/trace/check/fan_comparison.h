#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/face_source.h>

namespace ensonify::engine {

/// One ray that two intersectors see differently.
struct Difference {
  Ray ray;
  Hit expected, found;
};

/// What was found over some rays.
struct AgreementCounts {
  std::uint64_t rays = 0;
  std::array<std::uint64_t, verdict_names.size()> verdicts{};  ///< rays by Verdict
  // Over the rays that are the same: the largest difference in t.
  double largest_dt_m = 0.0;
  double largest_dt_relative = 0.0;      ///< to t, but for hits within rounding of the origin
  double largest_dt_of_tolerance = 0.0;  ///< to Judge::tolerance_m
  std::uint64_t coarse =
      0;  ///< hits whose tolerance is more than a tenth of the face's longest edge
  std::uint64_t unlike_static = 0;  ///< rays whose bits differ from the static surface's
  std::uint64_t wrong_index =
      0;  ///< Hit::index leads to another face than Hit::face, or to other corners
  std::uint64_t wrong_run = 0;  ///< the echo's run there is of another face, or places it elsewhere
  std::vector<Difference> unexplained;  ///< the first few

  std::uint64_t count(Verdict verdict) const { return verdicts[static_cast<std::size_t>(verdict)]; }
  void add(Verdict verdict, const Difference& difference);
  AgreementCounts& operator+=(const AgreementCounts& other);
};

/// Holds the answers of one intersector on one surface against the reference's and adds them up. An
/// answer is unexplained, too, if Hit::index does not lead to the face; if the run that the echo
/// gets there is not that of the hit; and, unless the intersector computes in float, if the static
/// surface's has other bits. One thread at a time.
class FanComparison {
 public:
  /// The judge must outlive this.
  FanComparison(const Judge& judge, Precision precision) : judge_(&judge), precision_(precision) {}

  /// All rays of a fan within its beam; another counts if it hits, which it must not. `triangles`
  /// are those of the surface, `expected` the reference's hits by ray number, `of_static` the same
  /// intersector's on the static surface, or nothing. Afterwards found() are the hits.
  void fan(const Intersector& intersector, refine::Triangles triangles, const RayFan& fan,
           std::span<const Hit> expected, std::span<const Hit> of_static, AgreementCounts& tally);
  /// A list of rays, likewise.
  void list(const Intersector& intersector, refine::Triangles triangles, std::span<const Ray> rays,
            std::span<const Hit> expected, std::span<const Hit> of_static, AgreementCounts& tally);
  std::span<const Hit> found() const { return found_; }

 private:
  bool leads_to_face(refine::Triangles triangles, const Hit& hit) const;
  bool run_agrees(const RayFan& fan, std::size_t elevation, std::size_t run, const Ray& ray,
                  const Hit& expected, const Hit& hit) const;
  void add(const Ray& ray, const Hit& expected, const Hit& hit, bool sound,
           AgreementCounts& tally) const;

  const Judge* judge_;
  Precision precision_;
  FanRuns runs_;
  std::vector<std::size_t> run_of_;  // a plane's rays; or none
  std::vector<Hit> found_;
};

}  // namespace ensonify::engine
