#include <ensonify/engine/trace/check/agreement.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <optional>

#include <ensonify/engine/trace/check/adversarial_rays.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

constexpr std::size_t round = 1024;  // how many items' results are held at once
constexpr std::uint64_t list_rays = 1024;
constexpr std::uint64_t fan_rays = 600;  // of an aimed fan, about
constexpr std::uint64_t plumb_list = 256;
constexpr std::size_t body_blocks = 4;  // every 4th block is repeated with bodies,
constexpr std::size_t body_pings = 4;   // its first pings only

std::uint64_t rays_of(std::span<const RayFan> fans) {
  std::uint64_t rays = 0;
  for (const RayFan& fan : fans) rays += rays_within_beam(*fan.grid);
  return rays;
}

class Comparison {
 public:
  Comparison(refine::Triangles triangles, const Intersector& reference,
             std::span<const Candidate> candidates, std::span<const PingBlock> blocks,
             const AgreementOptions& options)
      : bounds_(refine::bounds(triangles)),
        judge_(triangles, reference),
        reference_(reference),
        candidates_(candidates),
        blocks_(blocks),
        options_(options),
        aimed_(triangles, options.seed),
        bent_(options.water, triangles, reference),
        workers_(static_cast<std::size_t>(std::max(1, options.threads))) {
    plan();
    make(workers_.front());
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
  /// What one thread compares at a time: a block of pings, a fan or a list of rays.
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
    if (options_.water.profile) add(RaySource::bent, blocks_.size());
    if (options_.bodies) add(RaySource::bodies, parts_of(blocks_.size(), body_blocks));
    if (!options_.heights.empty())
      add(RaySource::plumb_lines, parts_of(options_.plumb_lines, plumb_list));
    for (const Item& item : items_) progress_.of += rays_of_item(item);
  }

  /// For aimed fans an estimate: they are made later.
  std::uint64_t rays_of_item(const Item& item) const {
    switch (item.source) {
      case RaySource::aimed_fans: return fan_rays;
      case RaySource::aimed_rays: return rays_of_list(item.number, list_rays, options_.aimed_rays);
      case RaySource::plumb_lines:
        return rays_of_list(item.number, plumb_list, options_.plumb_lines);
      default: break;
    }
    std::uint64_t rays = 0;
    for (const std::vector<RayFan>& ping : pings_of(item)) rays += rays_of(ping);
    return item.source == RaySource::bent ? rays / options_.bent_every : rays;
  }
  static std::uint64_t rays_of_list(std::size_t list, std::uint64_t each, std::uint64_t all) {
    return std::min(each, all - list * each);
  }
  std::span<const std::vector<RayFan>> pings_of(const Item& item) const {
    if (item.source != RaySource::bodies) return blocks_[item.number];
    const PingBlock& block = blocks_[item.number * body_blocks];
    return std::span(block).first(std::min(body_pings, block.size()));
  }

  void make(std::optional<CandidateWorker>& worker) {
    worker.emplace(judge_, reference_, candidates_, options_.heights, large_);
  }

  /// Returns one count for each candidate.
  std::vector<AgreementCounts> compare_item(const Item& item, std::optional<CandidateWorker>& made,
                                            refine::SpareThreads& spare) {
    if (!made) make(made);
    CandidateWorker& worker = *made;
    std::vector<AgreementCounts> tallies(
        item.source == RaySource::plumb_lines ? options_.heights.size() : candidates_.size());
    std::uint64_t rays = 0;
    switch (item.source) {
      case RaySource::scene: rays = compare_block(item, worker, spare, tallies); break;
      case RaySource::aimed_fans: {
        const RayFan fan = aimed_.aim(item.number, reference_);
        worker.compare_fan(fan, item.number, tallies);
        rays = rays_of({&fan, 1});
        break;
      }
      case RaySource::aimed_rays: {
        std::vector<Ray> list(rays_of_item(item));
        aimed_.aim(item.number, list);
        worker.compare_list(list, item.number, tallies);
        rays = list.size();
        break;
      }
      case RaySource::bent: rays = compare_bent(item, worker, tallies); break;
      case RaySource::bodies: rays = compare_bodies(item, worker, tallies); break;
      case RaySource::plumb_lines: {
        std::vector<Ray> list(rays_of_item(item));
        aimed_.aim_down(item.number, list);
        worker.compare_heights(list, options_.bed_faces, tallies);
        rays = list.size();
        break;
      }
      case RaySource::faces: break;
    }
    report(rays, tallies);
    return tallies;
  }

  /// As in a run: face sources start fresh, and later pings are announced to them.
  std::uint64_t compare_block(const Item& item, CandidateWorker& worker,
                              refine::SpareThreads& spare, std::span<AgreementCounts> tallies) {
    worker.reset();
    std::uint64_t rays = 0;
    const std::span<const std::vector<RayFan>> pings = pings_of(item);
    for (std::size_t ping = 0; ping < pings.size() && !stopped_; ++ping) {
      const auto look_ahead = [&](FaceSource& surface) {
        for (std::size_t next = ping + 1; next < pings.size() && spare.any(); ++next)
          if (!surface.announce(pings[next], spare)) return;
      };
      worker.compare_ping(pings[ping], item.number, look_ahead, tallies);
      rays += rays_of(pings[ping]);
    }
    return rays;
  }

  /// A share of the bent rays of the pings.
  std::uint64_t compare_bent(const Item& item, CandidateWorker& worker,
                             std::span<AgreementCounts> tallies) {
    worker.reset();
    // Different rays of each ping, and of each block.
    std::uint64_t turn = first_turn(item.number, options_.bent_every);
    for (const std::vector<RayFan>& ping : pings_of(item))
      if (!stopped_) worker.compare_bent(ping, bent_, options_.bent_every, turn, tallies);
    return rays_of_item(item);
  }

  /// Pings with bodies in the water, which are added, moved before every second ping, and removed.
  std::uint64_t compare_bodies(const Item& item, CandidateWorker& worker,
                               std::span<AgreementCounts> tallies) {
    const std::lock_guard lock(large_);
    worker.reset();
    std::uint64_t rays = 0;
    const std::span<const std::vector<RayFan>> pings = pings_of(item);
    for (std::size_t ping = 0; ping < pings.size() && !stopped_; ++ping) {
      if (ping % 2 == 0) worker.put_bodies(pings[ping], options_.seed, item.number, ping);
      worker.compare_with_bodies(pings[ping], item.number, bounds_, tallies);
      rays += rays_of(pings[ping]);
    }
    worker.remove_bodies();
    return rays;
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

  refine::Bounds bounds_;
  Judge judge_;
  const Intersector& reference_;
  std::span<const Candidate> candidates_;
  std::span<const PingBlock> blocks_;
  const AgreementOptions& options_;
  AdversarialRays aimed_;
  BentReference bent_;
  std::vector<Item> items_;
  std::mutex large_;  // see CandidateWorker
  std::vector<std::optional<CandidateWorker>> workers_;
  std::mutex progress_mutex_;
  AgreementProgress progress_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const PingBlock> blocks,
                                  const AgreementOptions& options) {
  return Comparison(triangles, reference, candidates, blocks, options).rows();
}

}  // namespace ensonify::engine
