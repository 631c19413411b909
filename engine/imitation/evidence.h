#pragma once

#include <string>
#include <string_view>

namespace ensonify::engine {

/// Where the value of an imitation's key comes from, the surest first.
enum class Confidence {
  stated,    ///< the recording's file has it
  measured,  ///< its samples or its navigation show it directly
  fitted,    ///< chosen so that the imitation's statistics become the recording's
  assumed    ///< the recording does not show it; a usual value
};
std::string_view name_of(Confidence how);

/// The evidence for a value.
struct Evidence {
  Confidence how = Confidence::assumed;
  std::string why;  ///< a few words
};

}  // namespace ensonify::engine
