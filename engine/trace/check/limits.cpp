#include <ensonify/engine/trace/check/limits.h>

#include <algorithm>

namespace ensonify::engine {
namespace {

// A row with fewer rays is treated as one with this many, because a share of few rays is mostly
// chance. The 600 rays or so of an aimed fan pass the same faces, so that one class may have a
// large part of them; 10,000 rays are some 16 fans. One ray is always allowed where the limit is
// above 0. With the largest share of edges in a scene, 8e-6, two or more of 10,000 rays are edges
// in 3 of 1000 rows.
constexpr std::uint64_t few_rays = 10000;

/// Limits with these shares, for the first counts of `all`.
template <std::size_t size>
constexpr std::array<Limit, size> table(const double (&shares)[size]) {
  constexpr std::array all{
      Limit{.name = "tie", .verdict = Verdict::tie, .share = 0.0},
      Limit{.name = "end", .verdict = Verdict::end, .share = 0.0},
      Limit{.name = "edge", .verdict = Verdict::edge, .share = 0.0},
      Limit{.name = "leak", .verdict = Verdict::leak, .share = 0.0},
      Limit{.name = "coplanar", .verdict = Verdict::coplanar, .share = 0.0},
      Limit{.name = "coarse", .count = &AgreementCounts::coarse, .share = 0.0},
      Limit{.name = "unlike_static", .count = &AgreementCounts::unlike_static, .share = 0.0}};
  std::array<Limit, size> some{};
  for (std::size_t i = 0; i < size; ++i) {
    some[i] = all[i];
    some[i].share = shares[i];
  }
  return some;
}

}  // namespace

// Correct back-ends had at most these shares at 2e5 rays on ripples, clutter, mines and rocky. In
// float, on a scene's own rays and with bodies: tie 4e-5, edge 8e-6, coarse 8e-5; on aimed rays:
// tie 0.31, end 0.07, edge 0.05, leak 0.0015, coplanar 0.05, coarse 0.14, unlike_static 0.011. In
// double, on a scene's own rays: nothing; on aimed rays: tie 0.05, end 2e-5, edge 1.5e-4. All
// others were 0. The limits leave a margin, from twice to some hundred times, for other scenes;
// aimed rays meet edges, corners and their own ends on purpose. Overlaps have no limit: where two
// faces lie in one plane, as the tops of boxes in a heap, rounding decides for every ray. Bent rays
// have the same limits with every intersector, because few of them are traced by it. Of the 1.2
// million bent rays of refracted_agreement_test.cpp, at most 5e-4 of a scene's rays were ties, and
// at most 1e-5 were edges.
std::span<const Limit> limits(RaySource source, Precision precision) {
  // tie, end, edge, leak, coplanar, coarse, unlike_static
  static constexpr auto scene_in_double = table({1e-4, 1e-4, 1e-5, 0.0, 1e-5});
  static constexpr auto aimed_in_double = table({0.5, 0.01, 0.01, 0.0, 0.01});
  static constexpr auto scene_in_float = table({1e-3, 1e-4, 1e-4, 1e-5, 1e-4, 0.05, 1e-3});
  static constexpr auto aimed_in_float = table({0.6, 0.2, 0.2, 0.005, 0.2, 0.4, 0.1});
  static constexpr auto of_bent_rays = table({5e-3, 5e-3, 5e-3});
  if (source == RaySource::bent) return of_bent_rays;
  if (precision == Precision::exact) return {};
  const bool aimed = source == RaySource::aimed_fans || source == RaySource::aimed_rays;
  if (precision == Precision::in_double)
    return aimed ? std::span<const Limit>(aimed_in_double) : scene_in_double;
  return aimed ? std::span<const Limit>(aimed_in_float) : scene_in_float;
}

double most_allowed(const Limit& limit, std::uint64_t rays) {
  if (limit.share == 0.0) return 0.0;
  return std::max(1.0, limit.share * static_cast<double>(std::max(rays, few_rays)));
}

bool exceeds(const Limit& limit, const AgreementCounts& tally) {
  return static_cast<double>(limit.of(tally)) > most_allowed(limit, tally.rays);
}

std::vector<std::string_view> exceeded_limits(const AgreementRow& row) {
  std::vector<std::string_view> names;
  for (const Limit& limit : limits(row.source, row.precision))
    if (exceeds(limit, row)) names.push_back(limit.name);
  return names;
}

}  // namespace ensonify::engine
