#include <ensonify/engine/trace/check/limits.h>

#include <algorithm>

namespace ensonify::engine {
namespace {

// A row with fewer rays is treated as one with this many, because a share of few rays is mostly
// chance. The 600 rays or so of an aimed fan pass the same faces, so that one class may have a
// large part of them; 10,000 rays are some 16 fans. One ray is always allowed where the limit is
// above 0: with the largest share of edges in a scene, 8e-6, 10,000 rays have two or more in 3 of
// 1000 rows.
constexpr std::uint64_t few_rays = 10000;

}  // namespace

// Sound back-ends needed at most these shares at 2e5 rays on ripples, clutter, mines and rocky. In
// float, on a scene's own rays and with bodies: tie 4e-5, edge 8e-6, coarse 8e-5; on aimed rays:
// tie 0.31, end 0.07, edge 0.05, leak 0.0015, coplanar 0.05, coarse 0.14, unlike_static 0.011. In
// double, on a scene's own rays: nothing; on aimed rays: tie 0.05, end 2e-5, edge 1.5e-4. All
// others were 0. The limits leave a margin, from twice to some hundred times, for other scenes;
// aimed rays meet edges, corners and their own ends on purpose. Overlaps have no limit: where two
// faces lie in one plane, as the tops of boxes in a heap, rounding decides for every ray. Bent rays
// have the same limits with every intersector, because few of them ask it: of 1.2 million
// (refracted_agreement_test.cpp) at most 5e-4 of a scene's were ties, 1e-5 edges.
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
  static constexpr std::array of_bent_rays{
      Limit{"tie", nullptr, Verdict::tie, 5e-3},
      Limit{"end", nullptr, Verdict::end, 5e-3},
      Limit{"edge", nullptr, Verdict::edge, 5e-3},
  };
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
