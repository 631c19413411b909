#include <ensonify/engine/trace/check/candidate_worker.h>

#include <algorithm>
#include <stdexcept>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/trace/check/near_faces.h>
#include <ensonify/engine/trace/check/ping_comparison.h>

namespace ensonify::engine {
namespace {

constexpr std::uint64_t tetrahedra = 3;  // per ping, of four bodies each

bool takes_lists(FaceSource& surface) {
  const Ray ray;
  Hit hit;
  try {
    surface.prepare({}).intersector->intersect({&ray, 1}, {&hit, 1});
    return true;
  } catch (const std::invalid_argument&) {
    return false;  // a back-end for fans only
  }
}

}  // namespace

std::uint64_t first_turn(std::uint64_t number, std::uint64_t every) {
  return number * 0x9e3779b97f4a7c15 % every;
}

CandidateWorker::CandidateWorker(const Judge& judge, const Intersector& reference,
                                 std::span<const Candidate> candidates,
                                 std::span<const HeightCandidate> heights, std::mutex& large)
    : judge_(judge),
      reference_(reference),
      large_(large),
      candidates_(candidates),
      hits_(candidates.size()) {
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Candidate& candidate = candidates[c];
    surfaces_.push_back(candidate.make());
    comparisons_.emplace_back(judge, candidate.precision);
    takes_lists_.push_back(takes_lists(*surfaces_[c]));
    bent_tracers_.push_back(candidate.make_bent ? candidate.make_bent() : nullptr);
    const auto same =
        std::ranges::find(candidates.first(c), candidate.intersector, &Candidate::intersector);
    const auto twin = static_cast<std::size_t>(same - candidates.begin());
    twins_.push_back(twin < c && candidates[twin].has_every_face ? twin : c);
  }
  for (const HeightCandidate& candidate : heights) heights_.push_back(candidate.make());
}

void CandidateWorker::reset() {
  for (const auto& surface : surfaces_) surface->reset();
}

void CandidateWorker::compare_ping(std::span<const RayFan> fans, std::uint64_t number,
                                   const std::function<void(FaceSource&)>& look_ahead,
                                   std::span<AgreementCounts> tallies) {
  find_expected(reference_, fans);
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const Faces faces = prepare(c, *surfaces_[c], fans, comparisons_[c]);
    look_ahead(*surfaces_[c]);
    compare_candidate(c, faces, fans, number, comparisons_[c], tallies[c]);
  }
}

void CandidateWorker::compare_bent(std::span<const RayFan> fans, const BentReference& reference,
                                   std::uint64_t every, std::uint64_t& turn,
                                   std::span<AgreementCounts> tallies) {
  std::vector<std::vector<BentRay>> some;
  for (const RayFan& fan : fans) some.push_back(reference.trace_some(fan, every, turn));
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    if (!bent_tracers_[c]) continue;
    TracedFaces faces = surfaces_[c]->prepare_bed(fans);
    for (std::size_t i = 0; i < fans.size(); ++i)
      reference.compare(fans[i], some[i], *bent_tracers_[c], faces, tallies[c]);
  }
}

void CandidateWorker::compare_fan(const RayFan& fan, std::uint64_t number,
                                  std::span<AgreementCounts> tallies) {
  const std::span<const RayFan> fans(&fan, 1);
  find_expected(reference_, fans);
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const auto compare_on = [&](FaceSource& surface) {
      compare_candidate(c, prepare(c, surface, fans, comparisons_[c]), fans, number,
                        comparisons_[c], tallies[c]);
    };
    if (candidates_[c].has_every_face) {
      compare_on(*surfaces_[c]);
    } else {
      const std::lock_guard lock(large_);
      compare_on(*candidates_[c].make());
    }
  }
}

void CandidateWorker::find_expected(const Intersector& reference, std::span<const RayFan> fans) {
  expected_.resize(fans.size());
  for (std::size_t i = 0; i < fans.size(); ++i) {
    expected_[i].resize(fans[i].grid->rays());
    reference.intersect(fans[i], expected_[i]);
  }
}

/// Runs are listed only where all rays are compared.
Faces CandidateWorker::prepare(std::size_t c, FaceSource& surface, std::span<const RayFan> fans,
                               FanComparison& comparison) {
  return candidates_[c].every == 1 ? comparison.prepare(surface, fans) : surface.prepare(fans);
}

void CandidateWorker::compare_candidate(std::size_t c, const Faces& faces,
                                        std::span<const RayFan> fans, std::uint64_t number,
                                        FanComparison& comparison, AgreementCounts& tally) {
  const std::uint64_t every = candidates_[c].every;
  PingHits& own_hits = hits_[c];
  own_hits.resize(fans.size());
  for (std::size_t i = 0; i < fans.size(); ++i) {
    std::span<const Hit> on_static;
    if (twins_[c] != c) on_static = hits_[twins_[c]][i];
    if (every == 1) {
      comparison.fan(i, faces, fans[i], {expected_[i], on_static}, tally);
    } else {
      choose(fans[i], expected_[i], every, number);
      comparison.list(faces, chosen_, {expected_of_chosen_, on_static}, tally);
    }
    if (candidates_[c].has_every_face)
      own_hits[i].assign(comparison.found().begin(), comparison.found().end());
  }
}

/// Chooses every n-th ray; the first one varies, so that all kinds of rays are compared.
void CandidateWorker::choose(const RayFan& fan, std::span<const Hit> expected, std::uint64_t every,
                             std::uint64_t number) {
  chosen_.clear();
  expected_of_chosen_.clear();
  std::uint64_t turn = first_turn(number, every);
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t j = 0; j < fan.elevations(); ++j)
      if (fan.grid->within_beam(plane, j) && turn++ % every == 0) {
        chosen_.push_back(fan.ray(plane, j));
        expected_of_chosen_.push_back(expected[plane * fan.elevations() + j]);
      }
}

void CandidateWorker::compare_list(std::span<const Ray> rays, std::uint64_t number,
                                   std::span<AgreementCounts> tallies) {
  expected_.resize(1);
  expected_[0].resize(rays.size());
  reference_.intersect(rays, expected_[0]);
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    if (!candidates_[c].has_every_face || !takes_lists_[c]) continue;
    const std::uint64_t every = candidates_[c].every;
    chosen_.clear();
    expected_of_chosen_.clear();
    for (std::size_t i = first_turn(number, every); i < rays.size(); i += every) {
      chosen_.push_back(rays[i]);
      expected_of_chosen_.push_back(expected_[0][i]);
    }
    comparisons_[c].list(surfaces_[c]->prepare({}), chosen_, {expected_of_chosen_, {}}, tallies[c]);
  }
}

void CandidateWorker::put_bodies(std::span<const RayFan> fans, std::uint64_t seed,
                                 std::uint64_t number, std::uint64_t ping) {
  find_expected(reference_, fans);
  const bool first = bodies_.empty();
  bodies_.clear();
  for (std::uint64_t i = 0; i < tetrahedra; ++i)
    bodies_.emplace_back(
        fans[i % fans.size()], expected_[i % fans.size()],
        RandomStream(seed, Purpose::agreement, {3, number, ping * tetrahedra + i}));
  for (const auto& surface : surfaces_) (first ? add_bodies : replace_bodies)(bodies_, *surface);
}

void CandidateWorker::compare_with_bodies(std::span<const RayFan> fans, std::uint64_t number,
                                          const refine::Bounds& bounds,
                                          std::span<AgreementCounts> tallies) {
  const refine::Triangles mesh = judge_.triangles();
  NearFaces near(mesh, fans);
  append(bodies_, static_cast<std::uint32_t>(mesh.faces.size()), near);
  const auto reference = make_intersector(reference_intersector, near.triangles());
  const Judge judge(near.triangles(), *reference, bounds);
  find_expected(*reference, fans);
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    FanComparison comparison(judge, candidates_[c].precision);
    compare_candidate(c, prepare(c, *surfaces_[c], fans, comparison), fans, number, comparison,
                      tallies[c]);
  }
}

void CandidateWorker::remove_bodies() {
  bodies_.clear();
  for (const auto& surface : surfaces_) {
    for (std::size_t body = surface->bodies(); body-- > 0;) surface->remove(body);
    surface->prepare({});  // frees the joined faces
  }
}

void CandidateWorker::compare_heights(std::span<const Ray> rays, std::size_t bed_faces,
                                      std::span<AgreementCounts> tallies) {
  for (const Ray& ray : rays) {
    const Hit bed = bed_below(ray, bed_faces, reference_);
    for (std::size_t c = 0; c < heights_.size(); ++c)
      judge_height(judge_, ray, bed, heights_[c](ray.origin.x(), ray.origin.y()), tallies[c]);
  }
}

}  // namespace ensonify::engine
