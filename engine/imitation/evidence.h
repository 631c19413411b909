#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace ensonify::engine {

/// Where the value of a key of an imitation comes from, the most certain first.
enum class Confidence {
  stated,    ///< the recording's file has it
  measured,  ///< the samples or the navigation show it directly
  fitted,    ///< chosen so that the imitation has the recording's statistics
  assumed    ///< a usual value, because the recording does not show it
};
constexpr std::string_view name_of(Confidence how) {
  constexpr std::array<std::string_view, 4> names{"stated", "measured", "fitted", "assumed"};
  return names[static_cast<std::size_t>(how)];
}

/// The evidence for a value.
struct Evidence {
  Confidence how = Confidence::assumed;
  std::string why;        ///< a few words
  bool at_limit = false;  ///< the fit reached the last value that it tries
};

/// The evidence for a value from `least` to `most`; with a note if the value is at a limit.
inline Evidence within_limits(Evidence evidence, double value, double least, double most) {
  evidence.at_limit = value <= least || value >= most;
  if (evidence.at_limit)
    evidence.why += value <= least ? "; the smallest that is tried" : "; the largest that is tried";
  return evidence;
}

}  // namespace ensonify::engine
