#pragma once

#include <cfenv>

namespace ensonify::refine {

/// While an object of this class exists, its thread rounds to nearest, keeps denormal numbers and
/// has no traps, whatever the caller has set. The destructor restores the caller's settings.
/// Otherwise those settings would change results, and a trap would end the program. A thread that
/// is started meanwhile gets the same settings.
class StandardFloats {
 public:
  StandardFloats() {
    std::feholdexcept(&before_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~StandardFloats() { std::fesetenv(&before_); }
  StandardFloats(const StandardFloats&) = delete;
  StandardFloats& operator=(const StandardFloats&) = delete;

 private:
  std::fenv_t before_;
};

}  // namespace ensonify::refine
