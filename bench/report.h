#pragma once

#include <string>
#include <vector>

#include "measure.h"
#include "traces.h"

namespace ensonify::bench {

/// Tables to read, pings' ratios against the first row.
std::string table(const std::vector<Measurement>& results,
                  const std::vector<TraceMeasurement>& traces);

/// The same for programs, with the machine and the build.
std::string json(const std::vector<Measurement>& results,
                 const std::vector<TraceMeasurement>& traces);

}  // namespace ensonify::bench
