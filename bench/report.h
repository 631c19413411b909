#pragma once

#include <string>
#include <vector>

#include "measure.h"

namespace ensonify::bench {

/// A table to read, ratios against the first row.
std::string table(const std::vector<Measurement>& results);

/// The same for programs, with the machine and the build.
std::string json(const std::vector<Measurement>& results);

}  // namespace ensonify::bench
