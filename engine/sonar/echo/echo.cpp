#include <ensonify/engine/sonar/echo/echo.h>

#include <array>
#include <string_view>
#include <utility>

namespace ensonify::engine {

std::string Artefacts::text() const {
  using enum Artefact;
  static constexpr std::array<std::pair<Artefact, std::string_view>, 11> names{
      {{lost, "lost"},
       {repeated, "repeated"},
       {stale_navigation, "stale_navigation"},
       {interference, "interference"},
       {gain_step, "gain_step"},
       {automatic_gain, "automatic_gain"},
       {fish, "fish"},
       {wake, "wake"},
       {shimmer, "shimmer"},
       {transmit_burst, "transmit_burst"},
       {crosstalk, "crosstalk"}}};
  std::string text;
  for (const auto& [artefact, name] : names)
    if (has(artefact)) text.append(text.empty() ? "" : "+").append(name);
  return text;
}

}  // namespace ensonify::engine
