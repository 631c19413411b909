#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "costs.h"
#include "grid.h"
#include "harness.h"
#include "pipeline.h"
#include "refinement.h"
#include "traces.h"

namespace ensonify::bench {

struct Results {
  std::vector<Cell> cells;
  std::vector<PipelineMeasurement> runs;
  std::vector<TraceMeasurement> traces;
  std::vector<RefinementMeasurement> refinements;
  std::vector<CostMeasurement> costs;
  std::optional<Harness> harness;  ///< if a cell was timed
  bool empty() const {
    return cells.empty() && runs.empty() && traces.empty() && refinements.empty() && costs.empty();
  }
};

/// The results as tables of text.
std::string table(const Results& results);

/// One sentence: the time that measuring adds to the fastest cell.
std::string words(const Harness& harness);

/// The grid's cells and the complete tasks, one line each.
std::string csv(const Results& results);

/// All results for programs, with the machine and the build.
nlohmann::ordered_json to_json(const Results& results);

}  // namespace ensonify::bench
