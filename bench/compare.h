#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ensonify::bench {

/// What became of a speedup since an older report: a cell's over static Embree packets, a run's or
/// a dataset's over one thread.
struct Change {
  std::string name;
  double before = 0.0, now = 0.0;
  double noise =
      0.0;  ///< of now / before: both runs' spreads, half and relative, as independent ones add
  bool fell() const { return now < before * (1.0 - noise); }
};

/// Every case of whose speedup both reports tell. Throws std::runtime_error for what is no report
/// of this program.
std::vector<Change> compare(const nlohmann::ordered_json& before,
                            const nlohmann::ordered_json& now);

/// A table of them, and in its last line how many fell.
std::string table(const std::vector<Change>& changes);

}  // namespace ensonify::bench
