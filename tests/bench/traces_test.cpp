// The benchmark's tracing cases.

#include "traces.h"

#include "support/catch.h"

using namespace ensonify::bench;

TEST_CASE("Tracing cases trace the bed", "[bench]") {
  const std::vector<TraceMeasurement> cases = measure_traces("trace/rippled/0.5M/", {}, 1, 2);
  REQUIRE(cases.size() >= 5);
  for (const TraceMeasurement& one : cases) {
    CAPTURE(one.name);
    const bool of_fans = one.name.ends_with("footprint/fan_scan");
    CHECK(one.faces >= (of_fans ? 1000u : 450'000u));
    CHECK(one.pair_us.median > 0.0);
    CHECK((of_fans ? one.query_us.median > 0.0 : one.query_us.median == 0.0));
  }
}
