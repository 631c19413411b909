#include <ensonify/engine/trace/check/fan_comparison.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {
namespace {

constexpr std::size_t kept = 5;  // unexplained differences per count
constexpr std::size_t no_run = static_cast<std::size_t>(-1);

}  // namespace

void AgreementCounts::add(Verdict verdict, const Difference& difference) {
  ++rays;
  ++verdicts[static_cast<std::size_t>(verdict)];
  if (verdict == Verdict::unexplained && unexplained.size() < kept)
    unexplained.push_back(difference);
}

AgreementCounts& AgreementCounts::operator+=(const AgreementCounts& other) {
  rays += other.rays;
  for (std::size_t i = 0; i < verdicts.size(); ++i) verdicts[i] += other.verdicts[i];
  largest_dt_m = std::max(largest_dt_m, other.largest_dt_m);
  largest_dt_relative = std::max(largest_dt_relative, other.largest_dt_relative);
  largest_dt_of_tolerance = std::max(largest_dt_of_tolerance, other.largest_dt_of_tolerance);
  coarse += other.coarse;
  overlap += other.overlap;
  unlike_static += other.unlike_static;
  wrong_index += other.wrong_index;
  wrong_run += other.wrong_run;
  for (const Difference& difference : other.unexplained)
    if (unexplained.size() < kept) unexplained.push_back(difference);
  return *this;
}

Faces FanComparison::prepare(FaceSource& surface, std::span<const RayFan> fans) {
  TracedFaces faces = surface.prepare_runs(fans);
  runs_.resize(fans.size());
  for (std::size_t i = 0; i < fans.size(); ++i) {
    runs_[i].listed = list_runs(faces, fans[i], i, runs_[i].runs);
    if (runs_[i].listed) check_indices(triangles_of(faces), runs_[i]);
  }
  return surface.prepare(fans);
}

void FanComparison::check_indices(refine::Triangles triangles, Runs& of) const {
  of.wrong_index.resize(of.runs.size());
  for (std::size_t run = 0; run < of.runs.size(); ++run)
    of.wrong_index[run] = !leads_to_face(triangles, of.runs.index[run], of.runs.face[run]);
}

void FanComparison::fan(std::size_t number_of_fan, const Faces& faces, const RayFan& fan,
                        const ExpectedHits& expected, AgreementCounts& tally) {
  found_.resize(fan.grid->rays());
  faces.intersector->intersect(fan, found_);
  Runs& of = runs_[number_of_fan];
  if (!of.listed) {
    of.runs.take(fan, faces.triangles, found_);
    check_indices(faces.triangles, of);
  }
  const FanRuns& runs = of.runs;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    run_of_.assign(fan.elevations(), no_run);
    for (std::size_t run = runs.first[plane]; run < runs.first[plane + 1]; ++run)
      for (std::size_t j = runs.begin[run];
           j < std::min<std::size_t>(runs.end[run], run_of_.size()); ++j)
        run_of_[j] = run;
    for (std::size_t j = 0; j < fan.elevations(); ++j) {
      const std::size_t number = plane * fan.elevations() + j;
      const Hit& hit = found_[number];
      if (!fan.grid->within_beam(plane, j) && !hit && run_of_[j] == no_run) continue;
      const Ray ray = fan.ray(plane, j);
      const bool run = run_agrees(fan, j, of, run_of_[j], ray, expected.by_reference[number], hit);
      add(faces, ray, number, expected, run, tally);
    }
  }
}

void FanComparison::list(const Faces& faces, std::span<const Ray> rays,
                         const ExpectedHits& expected, AgreementCounts& tally) {
  found_.resize(rays.size());
  faces.intersector->intersect(rays, found_);
  for (std::size_t i = 0; i < rays.size(); ++i) add(faces, rays[i], i, expected, true, tally);
}

/// Whether the index leads to the face's number and to the mesh's corners, in order and to the bit.
bool FanComparison::leads_to_face(refine::Triangles triangles, std::uint32_t index,
                                  std::uint32_t face) const {
  const std::uint32_t there = judge_->index_of(face);
  if (there == Hit::none || index >= triangles.faces.size() || triangles.number(index) != face)
    return false;
  for (int k = 0; k < 3; ++k)
    if (triangles.corner(index, k) != judge_->triangles().corner(there, k)) return false;
  return true;
}

/// Whether the run has the hit's face, and its plane is where the reference has the hit. At the end
/// of the range rounding decides whether there is a run.
bool FanComparison::run_agrees(const RayFan& fan, std::size_t elevation, const Runs& of,
                               std::size_t run, const Ray& ray, const Hit& expected,
                               const Hit& hit) const {
  const auto tolerance_m = [&](std::uint32_t face) {
    return judge_->index_of(face) == Hit::none
               ? 0.0
               : judge_->tolerance_m(ray, face, Precision::in_double);
  };
  if (run == no_run) return !hit || std::abs(hit.t - fan.range_m) <= tolerance_m(hit.face);
  const FanRuns& runs = of.runs;
  const double range_m =
      runs.distance[run] / (runs.level[run] * fan.grid->cos_elevation[elevation] +
                            runs.pole[run] * fan.grid->sin_elevation[elevation]);
  if (!hit) return std::abs(range_m - fan.range_m) <= tolerance_m(runs.face[run]);
  if (runs.face[run] != hit.face || of.wrong_index[run]) return false;
  if (expected.face != hit.face) return true;  // judge() decides that case
  // If the ray lies in the face's plane, the quotient is NaN or meaningless.
  return judge_->is_coarse(ray, hit.face, Precision::in_double) ||
         std::abs(range_m - expected.t) <= tolerance_m(hit.face);
}

/// Counts the ray with this number. `run`: whether its run agrees with its hit.
void FanComparison::add(const Faces& faces, const Ray& ray, std::size_t number,
                        const ExpectedHits& hits, bool run, AgreementCounts& tally) const {
  const Hit &expected = hits.by_reference[number], &hit = found_[number];
  const bool index = !hit || leads_to_face(faces.triangles, hit.index, hit.face);
  const bool like = hits.on_static.empty() || same_bits(hits.on_static[number], hit);
  tally.wrong_index += !index;
  tally.wrong_run += !run;
  tally.unlike_static += !like;
  const bool sound = index && run && (like || precision_ == Precision::in_float);
  const Verdict verdict =
      sound ? judge_->judge(ray, expected, hit, precision_) : Verdict::unexplained;
  tally.add(verdict, {ray, expected, hit});
  if (expected && precision_ == Precision::in_float)
    tally.coarse += judge_->is_coarse(ray, expected.face, precision_);
  if (verdict == Verdict::tie && expected && hit)
    tally.overlap += judge_->is_overlap(ray, expected, hit, precision_);
  if (verdict != Verdict::same || !expected) return;
  const double dt = std::abs(hit.t - expected.t);
  if (dt == 0.0) return;
  const double length = ray.direction.stableNorm(), dt_m = dt * length;
  tally.largest_dt_m = std::max(tally.largest_dt_m, dt_m);
  const double tolerance_m = judge_->tolerance_m(ray, expected.face, precision_);
  tally.largest_dt_of_tolerance = std::max(tally.largest_dt_of_tolerance, dt_m / tolerance_m);
  if (expected.t * length > tolerance_m)
    tally.largest_dt_relative = std::max(tally.largest_dt_relative, dt / expected.t);
}

}  // namespace ensonify::engine
