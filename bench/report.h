#pragma once

#include <string>
#include <vector>

#include "costs.h"
#include "measure.h"
#include "refinement.h"
#include "traces.h"

namespace ensonify::bench {

struct Results {
  std::vector<Measurement> pings;
  std::vector<TraceMeasurement> traces;
  std::vector<RefinementMeasurement> refinements;
  std::vector<CostMeasurement> costs;
};

/// Tables to read, pings' ratios against the first row.
std::string table(const Results& results);

/// The same for programs, with the machine and the build.
std::string json(const Results& results);

}  // namespace ensonify::bench
