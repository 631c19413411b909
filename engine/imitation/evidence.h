#pragma once

#include <array>
#include <cstddef>
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
constexpr std::string_view name_of(Confidence how) {
  constexpr std::array<std::string_view, 4> names{"stated", "measured", "fitted", "assumed"};
  return names[static_cast<std::size_t>(how)];
}

/// The evidence for a value.
struct Evidence {
  Confidence how = Confidence::assumed;
  std::string why;        ///< a few words
  bool at_limit = false;  ///< the fit would have gone on, but no further values are tried
};

/// The evidence of a value that the fit keeps within two limits, with a note if it is at one.
inline Evidence within_limits(Evidence evidence, double value, double least, double most) {
  evidence.at_limit = value <= least || value >= most;
  if (evidence.at_limit)
    evidence.why += value <= least ? "; the smallest that is tried" : "; the largest that is tried";
  return evidence;
}

}  // namespace ensonify::engine
