#include <ensonify/engine/sonar/reception/artefacts.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <ensonify/engine/sonar/echo/echo.h>

namespace ensonify::engine {
namespace {

constexpr double max_stale_intervals = 100.0;  // in succession

/// A uniform number in (0, 1] for one ping or interval.
double draw(std::uint64_t seed, Artefact artefact, std::uint64_t number) {
  std::array<double, 1> random;
  artefact_stream(seed, artefact, number).uniform(random);
  return random[0];
}

}  // namespace

bool is_lost(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping) {
  return options.lost > 0.0 && draw(seed, Artefact::lost, ping) <= options.lost;
}

bool is_repeated(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping) {
  return options.repeated > 0.0 && ping > 0 &&
         draw(seed, Artefact::repeated, ping) <= options.repeated;
}

double reported_since_s(const ArtefactOptions& options, std::uint64_t seed, double t_s) {
  if (!(options.stale_navigation > 0.0 && options.stale_s > 0.0)) return t_s;
  // Time is divided into intervals of stale_s. A random choice makes some of them stale. The search
  // goes back from the interval of t_s over consecutive stale intervals.
  double since_s = t_s;
  for (double interval = std::floor(t_s / options.stale_s);
       draw(seed, Artefact::stale_navigation,
            static_cast<std::uint64_t>(static_cast<std::int64_t>(interval))) <=
           options.stale_navigation &&
       t_s - since_s < max_stale_intervals * options.stale_s;
       interval -= 1.0)
    since_s = interval * options.stale_s;
  return since_s;
}

std::size_t reporting_ping(const ArtefactOptions& options, std::uint64_t seed,
                           std::span<const Pose> poses, std::size_t ping) {
  while (ping > 0) {
    const double since_s = reported_since_s(options, seed, poses[ping].t_s);
    if (since_s == poses[ping].t_s) break;
    const auto first = std::ranges::lower_bound(poses, since_s, {}, &Pose::t_s);
    if (first->t_s == since_s || first == poses.begin())
      return static_cast<std::size_t>(first - poses.begin());
    ping = static_cast<std::size_t>(first - poses.begin()) - 1;
  }
  return ping;
}

}  // namespace ensonify::engine
