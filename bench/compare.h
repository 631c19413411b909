#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ensonify::bench {

/// A change of a speedup since an older report. The speedup of a cell is relative to static Embree
/// packets; the speedup of a run or a dataset is relative to one thread.
struct Change {
  std::string name;
  double before = 0.0, now = 0.0;
  /// Relative noise of now / before: half the spreads of both reports, added as independent errors.
  double noise = 0.0;
  bool fell() const { return now < before * (1.0 - noise); }
};

struct Comparison {
  std::vector<Change> changes;  ///< of every case whose speedup is in both reports
  /// Cases of one report that the other does not have, or has without a valid speedup.
  std::vector<std::string> only_before, only_now;
};
/// Throws std::runtime_error for JSON that is not a report of this program.
Comparison compare(const nlohmann::ordered_json& before, const nlohmann::ordered_json& now);

/// A table of the changes. Its last lines have the number of speedups that fell, and the cases that
/// only one report has.
std::string table(const Comparison& comparison);

}  // namespace ensonify::bench
