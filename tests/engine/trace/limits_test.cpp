#include "support/catch.h"

#include <ensonify/engine/trace/check/limits.h>

using namespace ensonify::engine;

namespace {

AgreementRow row_of(RaySource source, std::uint64_t rays, Verdict verdict, std::uint64_t count,
                    Precision precision = Precision::in_float) {
  AgreementRow row;
  row.source = source;
  row.precision = precision;
  row.rays = rays;
  row.verdicts[static_cast<std::size_t>(verdict)] = count;
  return row;
}

}  // namespace

TEST_CASE("from 1e5 rays on a limit is its share of them") {
  for (const RaySource source : {RaySource::scene, RaySource::aimed_rays, RaySource::bent})
    for (const Precision precision : {Precision::in_float, Precision::in_double})
      for (const Limit& limit : limits(source, precision))
        for (const std::uint64_t rays : {100000u, 1000000u}) {
          CAPTURE(std::string(limit.name), limit.share, rays);
          CHECK(most_allowed(limit, rays) == limit.share * static_cast<double>(rays));
        }
  CHECK(!exceeded_limits(row_of(RaySource::scene, 100000, Verdict::leak, 2)).empty());
  CHECK(exceeded_limits(row_of(RaySource::scene, 100000, Verdict::leak, 1)).empty());
}

TEST_CASE("few rays may have a ray of each class with a limit, or the share of 10,000") {
  const auto over = [](auto... of_row) { return !exceeded_limits(row_of(of_row...)).empty(); };
  CHECK(!over(RaySource::aimed_rays, 2u, Verdict::coplanar, 2u));
  CHECK(!over(RaySource::scene, 2624u, Verdict::leak, 1u));
  CHECK(over(RaySource::scene, 2624u, Verdict::leak, 2u));
  CHECK(!over(RaySource::scene, 2624u, Verdict::tie, 10u));
  CHECK(over(RaySource::scene, 2624u, Verdict::tie, 11u));
  CHECK(!over(RaySource::scene, 20000u, Verdict::tie, 20u));
  CHECK(over(RaySource::scene, 20000u, Verdict::tie, 21u));
}

TEST_CASE("ties of faces that overlap have no limit") {
  AgreementRow row = row_of(RaySource::scene, 100000, Verdict::tie, 5000);
  CHECK(exceeded_limits(row) == std::vector<std::string_view>{"tie"});
  row.overlap = 4950;
  CHECK(exceeded_limits(row).empty());
}

TEST_CASE(
    "however few the rays are, a back-end in double leaks none, and an exact one differs in none") {
  const AgreementRow leaks =
      row_of(RaySource::aimed_rays, 2, Verdict::leak, 1, Precision::in_double);
  CHECK(exceeded_limits(leaks) == std::vector<std::string_view>{"leak"});
  CHECK(limits(RaySource::aimed_rays, Precision::exact).empty());
}
