#include <ensonify/engine/trace/check/agreement.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>

#include <ensonify/engine/random.h>
#include <ensonify/engine/trace/check/adversarial_rays.h>
#include <ensonify/engine/trace/check/near_faces.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t round = 1024;  // how many items' results are held at once
constexpr std::uint64_t list_rays = 1024;
constexpr std::uint64_t fan_rays = 600;  // of an aimed fan, about
constexpr std::uint64_t plumb_list = 256;
constexpr std::size_t body_blocks = 4;  // every 4th block is repeated with bodies,
constexpr std::size_t body_pings = 4;   // its first pings only
constexpr int tetrahedra = 3;           // per ping, of four bodies each

/// Hits of all fans of a ping, by ray number.
using PingHits = std::vector<std::vector<Hit>>;

/// One worker's face sources and buffers.
struct Worker {
  bool ready = false;
  std::vector<std::unique_ptr<FacesWithBodies>> surfaces;
  std::vector<FanComparison> comparisons;  // by candidate
  std::vector<std::function<double(double, double)>> heights;
  PingHits expected;
  std::vector<PingHits> hits;  // of candidates that others are compared with
  std::vector<Ray> rays, asked;
  std::vector<Hit> expected_of_asked, static_of_asked;
};

/// A tetrahedron in the water, made of one body per triangle, so that each triangle has its own
/// body number.
struct Tetrahedron {
  std::array<refine::TriangleMesh, 4> faces;
  Eigen::Isometry3d place;

  /// At a random place on a ray of the fan, before the ray's hit.
  Tetrahedron(const RayFan& fan, std::span<const Hit> hits, const RandomStream& stream) {
    std::array<double, 6> drawn;
    stream.uniform(drawn);
    const auto pick = [&](double u, std::size_t of) {
      return std::min(static_cast<std::size_t>(u * static_cast<double>(of)), of - 1);
    };
    const std::size_t plane = fan.planes() / 2, elevation = pick(drawn[0], fan.elevations());
    const Hit& hit = hits[plane * fan.elevations() + elevation];
    const double range_m = (0.2 + 0.75 * drawn[1]) * (hit ? hit.t : fan.range_m);
    const Ray ray = fan.ray(plane, elevation);
    place = Eigen::Translation3d(ray.origin + range_m * ray.direction) *
            Eigen::AngleAxisd(6.0 * drawn[2], Vector3d(drawn[3], drawn[4], drawn[5]).normalized());
    const auto size_m = static_cast<float>(0.02 * fan.range_m);
    const std::array<Eigen::Vector3f, 4> corners{
        Eigen::Vector3f(size_m, size_m, size_m), Eigen::Vector3f(size_m, -size_m, -size_m),
        Eigen::Vector3f(-size_m, size_m, -size_m), Eigen::Vector3f(-size_m, -size_m, size_m)};
    for (std::size_t i = 0; i < 4; ++i)
      faces[i] = {.positions = {corners[i], corners[(i + 1) % 4], corners[(i + 2) % 4]},
                  .faces = {{0, 1, 2}}};
  }
};

/// The first of the bed's faces that a vertical ray meets; it ignores other faces.
Hit bed_below(Ray ray, std::size_t bed_faces, const Intersector& reference) {
  for (;;) {
    Hit hit;
    reference.intersect({&ray, 1}, {&hit, 1});
    if (!hit || hit.face < bed_faces) return hit;
    // At equal distance the bed's face is reported, because its number is lower.
    ray.t_min = std::nextafter(hit.t, std::numeric_limits<double>::infinity());
  }
}

/// Judges a height (NaN for none) against the bed's hit.
void judge_height(const Judge& judge, const Ray& ray, const Hit& bed, double height_m,
                  AgreementCounts& counts) {
  Hit found = bed;
  found.t = ray.origin.z() - height_m;
  if (std::isnan(height_m)) found = {};
  if (!bed && !std::isnan(height_m)) found.face = 0;  // any face
  Verdict verdict = bed || found ? Verdict::unexplained : Verdict::same;
  if (bed && found) {
    const double dt_m = std::abs(found.t - bed.t);
    const double tolerance_m = judge.tolerance_m(ray, bed.face, Precision::in_double);
    if (dt_m <= tolerance_m) verdict = Verdict::same;
    if (verdict == Verdict::same && dt_m > 0.0) {
      counts.largest_dt_m = std::max(counts.largest_dt_m, dt_m);
      counts.largest_dt_relative = std::max(counts.largest_dt_relative, dt_m / bed.t);
      counts.largest_dt_of_tolerance = std::max(counts.largest_dt_of_tolerance, dt_m / tolerance_m);
    }
  }
  counts.add(verdict, {ray, bed, found});
}

class Comparison {
 public:
  Comparison(refine::Triangles triangles, const Intersector& reference,
             std::span<const Candidate> candidates, std::span<const PingBlock> blocks,
             const AgreementOptions& options)
      : triangles_(triangles),
        bounds_(refine::bounds(triangles)),
        judge_(triangles, reference),
        reference_(reference),
        candidates_(candidates),
        blocks_(blocks),
        options_(options),
        aimed_(triangles, options.seed),
        workers_(static_cast<std::size_t>(std::max(1, options.threads))) {
    plan();
    make_surfaces(workers_.front());
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      takes_lists_.push_back(candidates[c].has_every_face && takes_lists(*workers_[0].surfaces[c]));
      const auto same = std::ranges::find(candidates.first(c), candidates[c].intersector,
                                          &Candidate::intersector);
      const auto twin = static_cast<std::size_t>(same - candidates.begin());
      twin_.push_back(twin < c && candidates[twin].has_every_face ? twin : c);
    }
  }

  std::vector<AgreementRow> rows() {
    std::vector<AgreementRow> sums;
    for (const Candidate& candidate : candidates_)
      for (std::size_t source = 0; source < ray_source_names.size(); ++source)
        sums.push_back({{},
                        candidate.surface,
                        candidate.intersector,
                        static_cast<RaySource>(source),
                        candidate.precision});
    std::vector<AgreementRow> heights;
    for (const HeightCandidate& candidate : options_.heights)
      heights.push_back(
          {{}, candidate.surface, candidate.name, RaySource::plumb_lines, Precision::in_double});
    // In rounds whose parts are summed in order: bounded memory, same sums with any threads.
    for (std::size_t begin = 0; begin < items_.size() && !stopped_; begin += round) {
      std::vector<std::vector<AgreementCounts>> parts(std::min(round, items_.size() - begin));
      refine::SpareThreads spare;
      refine::parallel_for(
          parts.size(), options_.threads,
          [&](std::size_t part, int worker) {
            if (!stopped_)
              parts[part] = compare_item(items_[begin + part],
                                         workers_[static_cast<std::size_t>(worker)], spare);
          },
          &spare);
      for (std::size_t part = 0; part < parts.size(); ++part) {
        const RaySource source = items_[begin + part].source;
        for (std::size_t c = 0; c < parts[part].size(); ++c)
          (source == RaySource::plumb_lines
               ? heights[c]
               : sums[c * ray_source_names.size() + static_cast<std::size_t>(source)]) +=
              parts[part][c];
      }
    }
    sums.insert(sums.end(), heights.begin(), heights.end());
    std::erase_if(sums, [](const AgreementRow& row) { return row.rays == 0; });
    return sums;
  }

 private:
  struct Item {
    RaySource source;
    std::size_t number;
  };

  void plan() {
    const auto add = [&](RaySource source, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) items_.push_back({source, i});
    };
    const auto parts_of = [](std::uint64_t all, std::uint64_t part) {
      return static_cast<std::size_t>((all + part - 1) / part);
    };
    add(RaySource::scene, blocks_.size());
    add(RaySource::aimed_fans, parts_of(options_.aimed_fan_rays, fan_rays));
    add(RaySource::aimed_rays, parts_of(options_.aimed_rays, list_rays));
    if (options_.bodies) add(RaySource::bodies, parts_of(blocks_.size(), body_blocks));
    if (!options_.heights.empty())
      add(RaySource::plumb_lines, parts_of(options_.plumb_lines, plumb_list));
    for (const Item& item : items_) progress_.of += rays_of(item);
  }

  /// For aimed fans an estimate: they are made later.
  std::uint64_t rays_of(const Item& item) const {
    switch (item.source) {
      case RaySource::aimed_fans: return fan_rays;
      case RaySource::aimed_rays: return rays_of_list(item.number, list_rays, options_.aimed_rays);
      case RaySource::plumb_lines:
        return rays_of_list(item.number, plumb_list, options_.plumb_lines);
      default: break;
    }
    std::uint64_t rays = 0;
    for (const std::vector<RayFan>& ping : pings_of(item)) rays += rays_of(ping);
    return rays;
  }
  static std::uint64_t rays_of_list(std::size_t list, std::uint64_t each, std::uint64_t all) {
    return std::min(each, all - list * each);
  }
  std::span<const std::vector<RayFan>> pings_of(const Item& item) const {
    if (item.source == RaySource::scene) return blocks_[item.number];
    const PingBlock& block = blocks_[item.number * body_blocks];
    return std::span(block).first(std::min(body_pings, block.size()));
  }

  void make_surfaces(Worker& worker) const {
    for (const Candidate& candidate : candidates_) {
      worker.surfaces.push_back(candidate.make());
      worker.comparisons.emplace_back(judge_, candidate.precision);
    }
    for (const HeightCandidate& candidate : options_.heights)
      worker.heights.push_back(candidate.make());
    worker.hits.resize(candidates_.size());
    worker.ready = true;
  }

  static bool takes_lists(FaceSource& surface) {
    const Ray ray;
    Hit hit;
    try {
      surface.prepare({}).intersect({&ray, 1}, {&hit, 1});
      return true;
    } catch (const std::invalid_argument&) {
      return false;  // a back-end for fans only
    }
  }

  /// Returns one count for each candidate.
  std::vector<AgreementCounts> compare_item(const Item& item, Worker& worker,
                                            refine::SpareThreads& spare) {
    if (!worker.ready) make_surfaces(worker);
    std::vector<AgreementCounts> tallies(candidates_.size());
    std::uint64_t rays = 0;
    switch (item.source) {
      case RaySource::scene: rays = compare_block(item, worker, spare, tallies); break;
      case RaySource::aimed_fans: {
        const RayFan fan = aimed_.aim(item.number, reference_);
        rays = compare_ping(
            {&fan, 1}, item.number, worker, tallies, [](FaceSource&) {}, true);
        break;
      }
      case RaySource::aimed_rays: rays = compare_list(item, worker, tallies); break;
      case RaySource::bodies: rays = compare_bodies(item, worker, tallies); break;
      case RaySource::plumb_lines: rays = compare_heights(item, worker, tallies); break;
      case RaySource::faces: break;
    }
    report(rays, tallies);
    return tallies;
  }

  /// As in a run: face sources start fresh, and later pings are announced to them.
  std::uint64_t compare_block(const Item& item, Worker& worker, refine::SpareThreads& spare,
                              std::vector<AgreementCounts>& tallies) {
    for (const auto& surface : worker.surfaces) surface->reset();
    std::uint64_t rays = 0;
    const std::span<const std::vector<RayFan>> pings = pings_of(item);
    for (std::size_t ping = 0; ping < pings.size() && !stopped_; ++ping) {
      const auto look_ahead = [&](FaceSource& surface) {
        for (std::size_t next = ping + 1; next < pings.size() && spare.any(); ++next)
          if (!surface.expect(pings[next], spare)) return;
      };
      rays += compare_ping(pings[ping], item.number, worker, tallies, look_ahead);
    }
    return rays;
  }

  /// `afresh`: with temporary face sources, so that the memory of a wide fan is freed.
  template <class LookAhead>
  std::uint64_t compare_ping(std::span<const RayFan> fans, std::size_t number, Worker& worker,
                             std::vector<AgreementCounts>& tallies, const LookAhead& look_ahead,
                             bool afresh = false) {
    ask(reference_, fans, worker.expected);
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      std::unique_ptr<FacesWithBodies> own;
      if (afresh && !candidates_[c].has_every_face) own = candidates_[c].make();
      FacesWithBodies& surface = own ? *own : *worker.surfaces[c];
      const Intersector& intersector = surface.prepare(fans);
      look_ahead(surface);
      compare_candidate(c, intersector, surface.triangles(), fans, number, worker,
                        worker.comparisons[c], tallies[c]);
    }
    return rays_of(fans);
  }

  static std::uint64_t rays_of(std::span<const RayFan> fans) {
    std::uint64_t rays = 0;
    for (const RayFan& fan : fans) rays += rays_within_beam(*fan.grid);
    return rays;
  }

  static void ask(const Intersector& reference, std::span<const RayFan> fans, PingHits& hits) {
    hits.resize(fans.size());
    for (std::size_t i = 0; i < fans.size(); ++i) {
      hits[i].resize(fans[i].grid->rays());
      reference.intersect(fans[i], hits[i]);
    }
  }

  void compare_candidate(std::size_t c, const Intersector& intersector, refine::Triangles triangles,
                         std::span<const RayFan> fans, std::size_t number, Worker& worker,
                         FanComparison& comparison, AgreementCounts& tally) const {
    PingHits& own_hits = worker.hits[c];
    own_hits.resize(fans.size());
    for (std::size_t i = 0; i < fans.size(); ++i) {
      const bool has_twin = twin_[c] != c;
      const std::span<const Hit> of_static =
          has_twin ? std::span<const Hit>(worker.hits[twin_[c]][i]) : std::span<const Hit>();
      if (candidates_[c].every == 1)
        comparison.fan(intersector, triangles, fans[i], worker.expected[i], of_static, tally);
      else
        compare_some(c, intersector, triangles, fans[i], number, worker.expected[i], of_static,
                     worker, comparison, tally);
      if (candidates_[c].has_every_face)
        own_hits[i].assign(comparison.found().begin(), comparison.found().end());
    }
  }

  /// Compares every n-th ray; the first one varies, so that all kinds of rays are compared.
  void compare_some(std::size_t c, const Intersector& intersector, refine::Triangles triangles,
                    const RayFan& fan, std::size_t number, std::span<const Hit> expected,
                    std::span<const Hit> of_static, Worker& worker, FanComparison& comparison,
                    AgreementCounts& tally) const {
    const std::uint64_t every = candidates_[c].every;
    worker.asked.clear();
    worker.expected_of_asked.clear();
    std::uint64_t turn = number * 0x9e3779b97f4a7c15 % every;
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t j = 0; j < fan.elevations(); ++j)
        if (fan.grid->within_beam(plane, j) && turn++ % every == 0) {
          worker.asked.push_back(fan.ray(plane, j));
          worker.expected_of_asked.push_back(expected[plane * fan.elevations() + j]);
        }
    comparison.list(intersector, triangles, worker.asked, worker.expected_of_asked, of_static,
                    tally);
  }

  std::uint64_t compare_list(const Item& item, Worker& worker,
                             std::vector<AgreementCounts>& tallies) const {
    worker.rays.resize(rays_of_list(item.number, list_rays, options_.aimed_rays));
    aimed_.aim(item.number, worker.rays);
    worker.expected.resize(1);
    worker.expected[0].resize(worker.rays.size());
    reference_.intersect(worker.rays, worker.expected[0]);
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!takes_lists_[c]) continue;
      const std::uint64_t every = candidates_[c].every;
      worker.asked.clear();
      worker.expected_of_asked.clear();
      for (std::size_t i = item.number * 0x9e3779b97f4a7c15 % every; i < worker.rays.size();
           i += every) {
        worker.asked.push_back(worker.rays[i]);
        worker.expected_of_asked.push_back(worker.expected[0][i]);
      }
      const Intersector& intersector = worker.surfaces[c]->prepare({});
      worker.comparisons[c].list(intersector, worker.surfaces[c]->triangles(), worker.asked,
                                 worker.expected_of_asked, {}, tallies[c]);
    }
    return worker.rays.size();
  }

  /// Pings with tetrahedra in the water, which are added, moved before every second ping, and
  /// removed. The reference has them and the faces near the fans in a separate tree.
  std::uint64_t compare_bodies(const Item& item, Worker& worker,
                               std::vector<AgreementCounts>& tallies) {
    std::uint64_t rays = 0;
    for (const auto& surface : worker.surfaces) surface->reset();
    const std::span<const std::vector<RayFan>> pings = pings_of(item);
    std::vector<Tetrahedron> there;
    for (std::size_t ping = 0; ping < pings.size() && !stopped_; ++ping) {
      const std::span<const RayFan> fans = pings[ping];
      NearFaces near(triangles_, fans);
      if (ping % 2 == 0) {
        ask(reference_, fans, worker.expected);
        const bool first = there.empty();
        there.clear();
        for (std::uint64_t i = 0; i < tetrahedra; ++i)
          there.emplace_back(fans[i % fans.size()], worker.expected[i % fans.size()],
                             RandomStream(options_.seed, Purpose::agreement,
                                          {3, item.number, ping * tetrahedra + i}));
        for (const auto& surface : worker.surfaces) put(there, first, *surface);
      }
      auto number = static_cast<std::uint32_t>(triangles_.faces.size());
      for (const Tetrahedron& body : there)
        for (const refine::TriangleMesh& face : body.faces) {
          std::array<Eigen::Vector3f, 3> corners;
          for (std::size_t k = 0; k < 3; ++k)
            corners[k] = (body.place * face.positions[k].cast<double>()).cast<float>();
          near.add(corners, number++);
        }
      const auto reference = make_intersector("pluecker", near.triangles());
      const Judge judge(near.triangles(), *reference, bounds_);
      ask(*reference, fans, worker.expected);
      for (std::size_t c = 0; c < candidates_.size(); ++c) {
        FanComparison comparison(judge, candidates_[c].precision);
        FacesWithBodies& surface = *worker.surfaces[c];
        const Intersector& intersector = surface.prepare(fans);
        compare_candidate(c, intersector, surface.triangles(), fans, item.number, worker,
                          comparison, tallies[c]);
      }
      rays += rays_of(fans);
    }
    for (const auto& surface : worker.surfaces)
      for (std::size_t body = surface->bodies(); body-- > 0;) surface->remove(body);
    return rays;
  }

  static void put(std::span<const Tetrahedron> bodies, bool first, FacesWithBodies& surface) {
    std::size_t number = 0;
    for (const Tetrahedron& body : bodies)
      for (const refine::TriangleMesh& face : body.faces) {
        if (!first && number % 3 == 1) surface.remove(number);  // then add() gets this number
        if (first || number % 3 == 1)
          surface.add(face, body.place);
        else
          surface.move(number, body.place);
        ++number;
      }
  }

  std::uint64_t compare_heights(const Item& item, Worker& worker,
                                std::vector<AgreementCounts>& tallies) const {
    tallies.resize(worker.heights.size());
    worker.rays.resize(rays_of_list(item.number, plumb_list, options_.plumb_lines));
    aimed_.aim_down(item.number, worker.rays);
    for (const Ray& ray : worker.rays) {
      const Hit bed = bed_below(ray, options_.bed_faces, reference_);
      for (std::size_t c = 0; c < worker.heights.size(); ++c)
        judge_height(judge_, ray, bed, worker.heights[c](ray.origin.x(), ray.origin.y()),
                     tallies[c]);
    }
    return worker.rays.size();
  }

  void report(std::uint64_t rays, std::span<const AgreementCounts> tallies) {
    const std::lock_guard lock(progress_mutex_);
    progress_.rays = std::min(progress_.rays + rays, progress_.of);
    for (const AgreementCounts& tally : tallies) {
      progress_.unexplained += tally.count(Verdict::unexplained);
      progress_.leaks += tally.count(Verdict::leak);
    }
    if (options_.progress && !options_.progress(progress_)) stopped_ = true;
  }

  refine::Triangles triangles_;
  refine::Bounds bounds_;
  Judge judge_;
  const Intersector& reference_;
  std::span<const Candidate> candidates_;
  std::span<const PingBlock> blocks_;
  const AgreementOptions& options_;
  AdversarialRays aimed_;
  std::vector<Item> items_;
  std::vector<bool> takes_lists_;  // by candidate
  // By candidate: the one with static faces and the same intersector; itself if there is none.
  std::vector<std::size_t> twin_;
  std::vector<Worker> workers_;
  std::mutex progress_mutex_;
  AgreementProgress progress_;
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

// Sound back-ends needed at most these shares at 2e5 rays on ripples, clutter, mines and rocky. In
// float, on a scene's own rays and with bodies: tie 4e-5, edge 8e-6, coarse 8e-5; on aimed rays:
// tie 0.31, end 0.07, edge 0.05, leak 0.0015, coplanar 0.05, coarse 0.14, unlike_static 0.011. In
// double, on a scene's own rays: nothing; on aimed rays: tie 0.05, end 2e-5, edge 1.5e-4. All
// others were 0. The limits leave a margin, from twice to some hundred times, for other scenes;
// aimed rays meet edges, corners and their own ends on purpose.
std::span<const Limit> limits(RaySource source, Precision precision) {
  static constexpr std::array scene_in_double{
      Limit{"tie", nullptr, Verdict::tie, 1e-4},
      Limit{"end", nullptr, Verdict::end, 1e-4},
      Limit{"edge", nullptr, Verdict::edge, 1e-5},
      Limit{"leak", nullptr, Verdict::leak, 0.0},
      Limit{"coplanar", nullptr, Verdict::coplanar, 1e-5},
  };
  static constexpr std::array aimed_in_double{
      Limit{"tie", nullptr, Verdict::tie, 0.5},
      Limit{"end", nullptr, Verdict::end, 0.01},
      Limit{"edge", nullptr, Verdict::edge, 0.01},
      Limit{"leak", nullptr, Verdict::leak, 0.0},
      Limit{"coplanar", nullptr, Verdict::coplanar, 0.01},
  };
  static constexpr std::array scene_in_float{
      Limit{"tie", nullptr, Verdict::tie, 1e-3},
      Limit{"end", nullptr, Verdict::end, 1e-4},
      Limit{"edge", nullptr, Verdict::edge, 1e-4},
      Limit{"leak", nullptr, Verdict::leak, 1e-5},
      Limit{"coplanar", nullptr, Verdict::coplanar, 1e-4},
      Limit{"coarse", &AgreementCounts::coarse, Verdict::same, 0.05},
      Limit{"unlike_static", &AgreementCounts::unlike_static, Verdict::same, 1e-3},
  };
  static constexpr std::array aimed_in_float{
      Limit{"tie", nullptr, Verdict::tie, 0.6},
      Limit{"end", nullptr, Verdict::end, 0.2},
      Limit{"edge", nullptr, Verdict::edge, 0.2},
      Limit{"leak", nullptr, Verdict::leak, 0.005},
      Limit{"coplanar", nullptr, Verdict::coplanar, 0.2},
      Limit{"coarse", &AgreementCounts::coarse, Verdict::same, 0.4},
      Limit{"unlike_static", &AgreementCounts::unlike_static, Verdict::same, 0.1},
  };
  if (precision == Precision::exact) return {};
  const bool aimed = source == RaySource::aimed_fans || source == RaySource::aimed_rays;
  if (precision == Precision::in_double)
    return aimed ? std::span<const Limit>(aimed_in_double) : scene_in_double;
  return aimed ? std::span<const Limit>(aimed_in_float) : scene_in_float;
}

bool exceeds(const Limit& limit, const AgreementCounts& tally) {
  return static_cast<double>(limit.of(tally)) > limit.share * static_cast<double>(tally.rays);
}

std::vector<std::string_view> exceeded_limits(const AgreementRow& row) {
  std::vector<std::string_view> names;
  for (const Limit& limit : limits(row.source, row.precision))
    if (exceeds(limit, row)) names.push_back(limit.name);
  return names;
}

std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const PingBlock> blocks,
                                  const AgreementOptions& options) {
  return Comparison(triangles, reference, candidates, blocks, options).rows();
}

AgreementCounts compare_ping(FaceSource& surface, const CheckedMesh& mesh,
                             std::span<const RayFan> fans, Precision precision) {
  const NearFaces near(mesh.triangles, fans);
  const auto reference = make_intersector("pluecker", near.triangles());
  const Judge judge(near.triangles(), *reference, mesh.bounds);
  FanComparison comparison(judge, precision);
  const Intersector& intersector = surface.prepare(fans);
  AgreementCounts counts;
  std::vector<Hit> expected;
  for (const RayFan& fan : fans) {
    expected.resize(fan.grid->rays());
    reference->intersect(fan, expected);
    comparison.fan(intersector, surface.triangles(), fan, expected, {}, counts);
  }
  return counts;
}

AgreementCounts compare_height(const CheckedMesh& mesh, double x_m, double y_m, double height_m) {
  // A fan of one ray.
  FanGrid grid(FanLayout{.sector_high_rad = 1.0, .truncation_rad = 1.0, .main_lobe_rad = 1.0});
  grid.sin_truncation = 0.0;
  grid.planes = {{0.0, 1.0, 1.0}};
  grid.elevation_rad = grid.sin_elevation = {0.0};
  grid.cos_elevation = {1.0};
  const RayFan fan{
      .grid = std::make_shared<const FanGrid>(std::move(grid)),
      .origin = {x_m, y_m, double(mesh.bounds.highest.z()) + 1.0},
      .array_axis = Vector3d::UnitX(),
      .middle = -Vector3d::UnitZ(),
      .pole = Vector3d::UnitY(),
      .range_m = double(mesh.bounds.highest.z()) - double(mesh.bounds.lowest.z()) + 2.0};
  const NearFaces near(mesh.triangles, {&fan, 1});
  const auto reference = make_intersector("pluecker", near.triangles());
  const Ray down = fan.ray(0, 0);
  AgreementCounts counts;
  judge_height(Judge(near.triangles(), *reference, mesh.bounds), down,
               bed_below(down, mesh.bed_faces, *reference), height_m, counts);
  return counts;
}

}  // namespace ensonify::engine
