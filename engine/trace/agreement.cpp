#include <ensonify/engine/trace/agreement.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/adversarial_rays.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {

using Eigen::Vector3d;

namespace {

constexpr double float_rounding = 0x1p-24;
constexpr double float_steps = 8.0;  // roundings on the way to one answer
constexpr double edge_reach = 1e-6;  // of the range
constexpr std::size_t kept = 5;      // unexplained differences a row
constexpr std::size_t round = 4096;  // items whose results are held at once
constexpr std::array ray_sources{RaySource::scene, RaySource::aimed_fans, RaySource::aimed_rays};
constexpr std::uint64_t list_rays = 1024;
constexpr std::uint64_t fan_rays = 1500;  // about so many has an aimed fan

double distance_to_segment(const Vector3d& p, const Vector3d& q) {
  const double length2 = (q - p).squaredNorm();
  const double along = length2 > 0.0 ? std::clamp(-p.dot(q - p) / length2, 0.0, 1.0) : 0.0;
  return (p + along * (q - p)).norm();
}

double largest(const Vector3d& v) { return v.cwiseAbs().maxCoeff(); }

}  // namespace

/// Corners from the ray's origin; across is what is left of them seen along the ray.
struct Judge::Sight {
  const Ray& ray;
  std::array<Vector3d, 3> corners, across;
  double length;  // of the direction
  double longest_edge_m;
  double largest_m;   // M
  double rounding_m;  // of t, u and v; infinite exactly edge on
  double edge_m;      // from the ray's line to the nearest edge
  double outside_m;   // how far it is beyond the edges' lines, at most; not above 0 inside
  double plane_m;     // from the ray abeam of a corner to the face's plane
  bool inside;        // the line goes through the face, by plain arithmetic

  double metres(double t) const { return t * length; }
  bool coplanar(const Hit& hit) const {
    return rounding_m > longest_edge_m && plane_m <= reach_m(hit.t);
  }
  double tolerance_m() const { return std::min(rounding_m, longest_edge_m); }
  double reach_m(double t) const {
    return edge_reach * metres(t) + 4.0 * float_rounding * largest_m;
  }
  /// Of edges that meet sharply the ray may be near both, and yet far from where they meet.
  bool passes_edge(const Hit& hit) const { return (inside ? edge_m : outside_m) <= reach_m(hit.t); }
  bool meets_end(const Hit& hit) const {
    return metres(std::abs(hit.t - ray.t_min)) <= rounding_m ||
           metres(std::abs(hit.t - ray.t_max)) <= rounding_m;
  }
  /// Why one may see a hit on this face where the other sees none.
  Verdict excuse(const Hit& hit) const {
    if (coplanar(hit)) return Verdict::coplanar;
    if (meets_end(hit)) return Verdict::end;
    return passes_edge(hit) ? Verdict::edge : Verdict::unexplained;
  }
};

Judge::Sight Judge::look(const Ray& ray, std::uint32_t face) const {
  Sight s{.ray = ray, .length = ray.direction.stableNorm()};
  const Vector3d unit = ray.direction / s.length;
  double from_origin = 0.0;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    s.corners[i] = triangles_.corner(face, k) - ray.origin;
    s.across[i] = s.corners[i] - s.corners[i].dot(unit) * unit;
    from_origin = std::max(from_origin, largest(s.corners[i]));
  }
  const auto& [a, b, c] = s.corners;
  const double longest2 =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  s.longest_edge_m = std::sqrt(longest2);
  s.largest_m = largest(ray.origin) + from_origin;
  const Vector3d normal = (b - a).cross(c - a);
  s.plane_m = std::min({std::abs(normal.dot(s.across[0])), std::abs(normal.dot(s.across[1])),
                        std::abs(normal.dot(s.across[2]))}) /
              normal.norm();
  s.rounding_m = float_steps * float_rounding * s.largest_m * longest2 / std::abs(normal.dot(unit));
  s.edge_m = std::min({distance_to_segment(s.across[0], s.across[1]),
                       distance_to_segment(s.across[1], s.across[2]),
                       distance_to_segment(s.across[2], s.across[0])});
  const double ab = unit.dot(a.cross(b)), bc = unit.dot(b.cross(c)), ca = unit.dot(c.cross(a));
  s.inside = (ab > 0.0 && bc > 0.0 && ca > 0.0) || (ab < 0.0 && bc < 0.0 && ca < 0.0);
  const double turn = ab + bc + ca > 0.0 ? 1.0 : -1.0;
  const auto beyond_m = [&](double side, const Vector3d& p, const Vector3d& q) {
    return (q - p).isZero(0.0) ? p.norm() : -turn * side / (q - p).norm();
  };
  s.outside_m =
      std::max({beyond_m(ab, s.across[0], s.across[1]), beyond_m(bc, s.across[1], s.across[2]),
                beyond_m(ca, s.across[2], s.across[0])});
  return s;
}

double Judge::tolerance_m(const Ray& ray, std::uint32_t face) const {
  return look(ray, face).tolerance_m();
}

/// Whether t, u and v tell of one point, on the face and within the ray's ends.
bool Judge::points_agree(const Sight& sight, const Hit& hit) {
  constexpr double slack = 1e-5;  // of barycentrics in float
  if (!(hit.t >= sight.ray.t_min && hit.t <= sight.ray.t_max)) return false;
  if (!(hit.u >= -slack && hit.v >= -slack && hit.u + hit.v <= 1.0 + slack)) return false;
  if (sight.coplanar(hit)) return true;
  const auto& [a, b, c] = sight.corners;
  const Vector3d on_face = a + hit.u * (b - a) + hit.v * (c - a);
  return (on_face - hit.t * sight.ray.direction).norm() <= sight.tolerance_m();
}

Hit Judge::ask(const Ray& ray) const {
  Hit hit;
  reference_.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

/// Whether rays nudged to eight sides all meet faces that come together where this one passes.
bool Judge::surface_all_around(const Sight& sight, const Hit& hit) const {
  const Vector3d unit = sight.ray.direction / sight.length;
  const Vector3d right = unit.unitOrthogonal(), up = unit.cross(right);
  const double range_m = sight.metres(hit.t), away_m = 2.0 * sight.reach_m(hit.t);
  for (int i = 0; i < 8; ++i) {
    const double turn = i * std::numbers::pi / 4.0;
    const Vector3d nudge = away_m * (std::cos(turn) * right + std::sin(turn) * up);
    const Hit around =
        ask({sight.ray.origin + nudge, unit, std::max(0.0, range_m - sight.longest_edge_m)});
    if (!around) return false;
    const Sight other = look(sight.ray, around.face);
    if (around.t > range_m + sight.longest_edge_m + other.longest_edge_m) return false;
    if (around.face == hit.face) continue;
    if (other.edge_m > 2.0 * away_m) return false;
    // It comes together with this one only if it comes near the place where that is met: an edge that
    // the ray passes far behind a ridge, where both lie in the plane of the grid, is none of it.
    const Vector3d at = range_m * unit;
    const auto& [a, b, c] = other.corners;
    const double apart_m =
        std::min({distance_to_segment(a - at, b - at), distance_to_segment(b - at, c - at),
                  distance_to_segment(c - at, a - at)});
    if (apart_m > 2.0 * away_m + 0.01 * other.longest_edge_m) return false;
  }
  return true;
}

/// What it means that a face was passed which the reference says is met.
Verdict Judge::judge_passed(const Sight& sight, const Hit& hit) const {
  const Verdict excuse = sight.excuse(hit);
  return excuse == Verdict::edge && surface_all_around(sight, hit) ? Verdict::leak : excuse;
}

Verdict Judge::judge_same_face(const Sight& sight, const Hit& expected, const Hit& found) const {
  if (!points_agree(sight, found)) return Verdict::unexplained;
  const double apart_m = sight.metres(std::abs(found.t - expected.t));
  if (apart_m <= sight.tolerance_m()) return Verdict::same;
  return sight.coplanar(found) ? Verdict::coplanar : Verdict::unexplained;
}

Verdict Judge::judge(const Ray& ray, const Hit& expected, const Hit& found) const {
  if (!expected && !found) return Verdict::same;
  if (found && found.face >= triangles_.faces.size()) return Verdict::unexplained;
  const std::optional<Sight> there = found ? std::optional(look(ray, found.face)) : std::nullopt;
  if (there && expected.face == found.face) return judge_same_face(*there, expected, found);
  if (there && !(points_agree(*there, found) &&
                 (there->inside || there->passes_edge(found) || there->coplanar(found))))
    return Verdict::unexplained;

  // Along the ray, every face that the reference meets before what was found must have an excuse.
  Verdict worst = Verdict::tie;
  Ray rest = ray;
  for (Hit met = expected; met; met = rest.t_min <= rest.t_max ? ask(rest) : Hit{}) {
    const Sight sight = look(ray, met.face);
    if (there) {
      const double ahead_m = sight.metres(found.t - met.t);
      const double near_m = sight.tolerance_m() + there->tolerance_m();
      if (std::abs(ahead_m) <= near_m)
        return there->coplanar(found) ? std::max(worst, Verdict::coplanar) : worst;
      if (ahead_m < 0.0) break;
    }
    worst = std::max(worst, judge_passed(sight, met));
    if (worst == Verdict::unexplained) return worst;
    rest.t_min = met.t + std::max(sight.tolerance_m() / sight.length, 1e-15 * met.t);
  }
  if (!there) return worst;
  // The reference does not meet what was found.
  return std::max(worst, there->excuse(found));
}

AgreementRow& AgreementRow::operator+=(const AgreementRow& other) {
  rays += other.rays;
  for (std::size_t i = 0; i < verdicts.size(); ++i) verdicts[i] += other.verdicts[i];
  largest_dt_m = std::max(largest_dt_m, other.largest_dt_m);
  largest_dt_relative = std::max(largest_dt_relative, other.largest_dt_relative);
  largest_dt_of_tolerance = std::max(largest_dt_of_tolerance, other.largest_dt_of_tolerance);
  for (const Difference& difference : other.unexplained)
    if (unexplained.size() < kept) unexplained.push_back(difference);
  return *this;
}

namespace {

/// What one worker asks with, and where it keeps the answers.
struct Worker {
  std::vector<std::unique_ptr<Surface>> surfaces;
  std::vector<Ray> rays, asked;
  std::vector<Hit> expected, found;
  std::vector<std::size_t> numbers;  // of the rays that are asked
};

class Comparison {
 public:
  Comparison(refine::Triangles triangles, const Intersector& reference,
             std::span<const Candidate> candidates, std::span<const RayFan> scene_fans,
             const AgreementOptions& options)
      : judge_(triangles, reference),
        reference_(reference),
        candidates_(candidates),
        scene_fans_(scene_fans),
        options_(options),
        aimed_(triangles, options.seed),
        aimed_fans_((options.aimed_fan_rays + fan_rays - 1) / fan_rays),
        lists_((options.aimed_rays + list_rays - 1) / list_rays),
        workers_(static_cast<std::size_t>(std::max(1, options.threads))) {
    for (const RayFan& fan : scene_fans) told_.of += rays_within_beam(*fan.grid);
    told_.of += aimed_fans_ * fan_rays + options.aimed_rays;
    make_surfaces(workers_.front());
    for (std::size_t i = 0; i < candidates.size(); ++i)
      takes_lists_.push_back(candidates[i].has_every_face && takes_lists(*workers_[0].surfaces[i]));
  }

  std::vector<AgreementRow> rows() {
    std::vector<AgreementRow> sums;
    for (const Candidate& candidate : candidates_)
      for (const RaySource source : ray_sources)
        sums.push_back({candidate.surface, candidate.intersector, source});
    // In rounds, whose parts are summed in order: threads cannot tell, and memory has a bound.
    const std::size_t items = scene_fans_.size() + aimed_fans_ + lists_;
    for (std::size_t begin = 0; begin < items && !stopped_; begin += round) {
      std::vector<std::vector<AgreementRow>> parts(std::min(round, items - begin));
      refine::parallel_for(parts.size(), options_.threads, [&](std::size_t part, int worker) {
        if (stopped_) return;
        parts[part] = compare_item(begin + part, workers_[static_cast<std::size_t>(worker)]);
      });
      for (std::size_t part = 0; part < parts.size(); ++part)
        for (std::size_t c = 0; c < parts[part].size(); ++c)
          sums[c * ray_sources.size() + static_cast<std::size_t>(source_of(begin + part))] +=
              parts[part][c];
    }
    std::erase_if(sums, [](const AgreementRow& row) { return row.rays == 0; });
    return sums;
  }

 private:
  void make_surfaces(Worker& worker) const {
    for (const Candidate& candidate : candidates_) worker.surfaces.push_back(candidate.make());
  }

  static bool takes_lists(Surface& surface) {
    const Ray ray;
    Hit hit;
    try {
      surface.prepare({}).intersect({&ray, 1}, {&hit, 1});
      return true;
    } catch (const std::invalid_argument&) {
      return false;  // a back-end for fans alone
    }
  }

  RaySource source_of(std::size_t item) const {
    if (item < scene_fans_.size()) return RaySource::scene;
    return item < scene_fans_.size() + aimed_fans_ ? RaySource::aimed_fans : RaySource::aimed_rays;
  }

  bool asks(std::size_t c, std::size_t item, RaySource source) const {
    if (source == RaySource::aimed_rays) return takes_lists_[c];
    return source == RaySource::scene || item % candidates_[c].every_aimed_fan == 0;
  }

  /// One row a candidate.
  std::vector<AgreementRow> compare_item(std::size_t item, Worker& worker) {
    if (worker.surfaces.empty()) make_surfaces(worker);
    const RaySource source = source_of(item);
    std::optional<RayFan> fan;
    if (source == RaySource::scene) fan = scene_fans_[item];
    if (source == RaySource::aimed_fans) fan = aimed_.aim(item - scene_fans_.size(), reference_);
    worker.numbers.clear();
    if (fan) {
      lay_out(*fan, worker);
      reference_.intersect(*fan, worker.expected);
    } else {
      const std::uint64_t list = item - scene_fans_.size() - aimed_fans_;
      worker.rays.resize(std::min(list_rays, options_.aimed_rays - list * list_rays));
      worker.expected.resize(worker.rays.size());
      aimed_.aim(list, worker.rays);
      for (std::size_t i = 0; i < worker.rays.size(); ++i) worker.numbers.push_back(i);
      reference_.intersect(worker.rays, worker.expected);
    }
    std::vector<AgreementRow> rows(candidates_.size());
    for (std::size_t c = 0; c < candidates_.size(); ++c)
      if (asks(c, item, source)) compare_candidate(c, item, fan, worker, rows[c]);
    tell(worker.numbers.size(), rows);
    return rows;
  }

  static void lay_out(const RayFan& fan, Worker& worker) {
    worker.rays.resize(fan.grid->rays());
    worker.expected.resize(fan.grid->rays());
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
        if (!fan.grid->within_beam(plane, elevation)) continue;
        const std::size_t number = plane * fan.elevations() + elevation;
        worker.rays[number] = fan.ray(plane, elevation);
        worker.numbers.push_back(number);
      }
  }

  void compare_candidate(std::size_t c, std::size_t item, const std::optional<RayFan>& fan,
                         Worker& worker, AgreementRow& row) const {
    const std::uint64_t every = candidates_[c].every;
    const Intersector& intersector =
        worker.surfaces[c]->prepare(fan ? std::span(&*fan, 1) : std::span<const RayFan>());
    if (fan && every == 1) {
      worker.found.resize(worker.rays.size());
      intersector.intersect(*fan, worker.found);
      for (const std::size_t number : worker.numbers)
        add(worker.rays[number], worker.expected[number], worker.found[number], row);
      return;
    }
    // Begins anywhere, so that every kind of ray has its turn.
    const std::size_t first = item * 0x9e3779b97f4a7c15 % every;
    worker.asked.clear();
    for (std::size_t i = first; i < worker.numbers.size(); i += every)
      worker.asked.push_back(worker.rays[worker.numbers[i]]);
    worker.found.resize(worker.asked.size());
    intersector.intersect(worker.asked, worker.found);
    for (std::size_t k = 0; k < worker.asked.size(); ++k)
      add(worker.asked[k], worker.expected[worker.numbers[first + k * every]], worker.found[k],
          row);
  }

  void add(const Ray& ray, const Hit& expected, const Hit& found, AgreementRow& row) const {
    const Verdict verdict = judge_.judge(ray, expected, found);
    ++row.rays;
    ++row.verdicts[static_cast<std::size_t>(verdict)];
    if (verdict == Verdict::unexplained && row.unexplained.size() < kept)
      row.unexplained.push_back({ray, expected, found});
    if (verdict != Verdict::same || !expected) return;
    const double dt = std::abs(found.t - expected.t);
    if (dt == 0.0) return;
    const double length = ray.direction.stableNorm(), dt_m = dt * length;
    row.largest_dt_m = std::max(row.largest_dt_m, dt_m);
    const double tolerance_m = judge_.tolerance_m(ray, expected.face);
    row.largest_dt_of_tolerance = std::max(row.largest_dt_of_tolerance, dt_m / tolerance_m);
    if (expected.t * length > tolerance_m)
      row.largest_dt_relative = std::max(row.largest_dt_relative, dt / expected.t);
  }

  void tell(std::uint64_t rays, std::span<const AgreementRow> rows) {
    const std::lock_guard lock(telling_);
    told_.rays = std::min(told_.rays + rays, told_.of);
    for (const AgreementRow& row : rows) {
      told_.unexplained += row.count(Verdict::unexplained);
      told_.leaks += row.count(Verdict::leak);
    }
    if (options_.progress && !options_.progress(told_)) stopped_ = true;
  }

  Judge judge_;
  const Intersector& reference_;
  std::span<const Candidate> candidates_;
  std::span<const RayFan> scene_fans_;
  const AgreementOptions& options_;
  AdversarialRays aimed_;
  std::uint64_t aimed_fans_, lists_;
  std::vector<bool> takes_lists_;  // one a candidate
  std::vector<Worker> workers_;
  std::mutex telling_;
  AgreementProgress told_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

std::uint64_t rays_within_beam(const FanGrid& grid) {
  std::uint64_t rays = 0;
  for (std::size_t plane = 0; plane < grid.planes.size(); ++plane)
    for (std::size_t elevation = 0; elevation < grid.elevation_rad.size(); ++elevation)
      rays += grid.within_beam(plane, elevation);
  return rays;
}

std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const RayFan> scene_fans,
                                  const AgreementOptions& options) {
  return Comparison(triangles, reference, candidates, scene_fans, options).rows();
}

}  // namespace ensonify::engine
