#pragma once

#include <string>
#include <string_view>

namespace ensonify::engine {

/// How surely a key of an imitation is known.
enum class Confidence {
  stated,    ///< the recording's file has it
  measured,  ///< its samples or its navigation show it directly
  fitted,    ///< chosen so that the imitation's statistics become the recording's
  assumed    ///< the recording does not show it; a usual value
};
std::string_view name_of(Confidence how);

/// What a value rests on.
struct Evidence {
  Confidence how = Confidence::assumed;
  std::string why;  ///< a few words
};

}  // namespace ensonify::engine
