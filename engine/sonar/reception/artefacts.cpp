#include <ensonify/engine/sonar/reception/artefacts.h>

#include <array>
#include <cmath>

#include <ensonify/engine/random.h>

namespace ensonify::engine {
namespace {

// The first key of an artefact's random stream; disturbances.cpp and signal_chain.cpp have others.
enum Of : std::uint64_t { of_lost = 0, of_repeated = 1, of_navigation = 2 };

double draw(std::uint64_t seed, Of what, std::uint64_t number) {
  std::array<double, 1> random;
  RandomStream(seed, Purpose::artefact, {what, number, 0}).uniform(random);
  return random[0];
}

}  // namespace

bool is_lost(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping) {
  return options.lost > 0.0 && draw(seed, of_lost, ping) <= options.lost;
}

bool is_repeated(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping) {
  return options.repeated > 0.0 && ping > 0 && draw(seed, of_repeated, ping) <= options.repeated;
}

double reported_since_s(const ArtefactOptions& options, std::uint64_t seed, double t_s) {
  if (!(options.stale_navigation > 0.0 && options.stale_s > 0.0)) return t_s;
  // Time is divided into intervals of stale_s; some are stale, and several of these may follow one
  // another.
  double since_s = t_s;
  for (double stretch = std::floor(t_s / options.stale_s);
       draw(seed, of_navigation, static_cast<std::uint64_t>(static_cast<std::int64_t>(stretch))) <=
           options.stale_navigation &&
       t_s - since_s < 100.0 * options.stale_s;
       stretch -= 1.0)
    since_s = stretch * options.stale_s;
  return since_s;
}

void hold_stale(const ArtefactOptions& options, std::uint64_t seed, std::span<Pose> reports) {
  for (std::size_t i = 1; i < reports.size(); ++i) {
    const double t_s = reports[i].t_s;
    if (reported_since_s(options, seed, t_s) == t_s) continue;
    reports[i] = reports[i - 1];
    reports[i].t_s = t_s;
  }
}

}  // namespace ensonify::engine
