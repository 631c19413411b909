#include "measure.h"

#include <algorithm>

#include <ensonify/engine/simulate.h>

#include "clock.h"

namespace ensonify::bench {
namespace {

struct Running {
  engine::Simulator simulator;
  std::vector<engine::Pose> poses;
  std::vector<double> ping_ms;  // a round
};

}  // namespace

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double median = values.size() % 2 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  return {median, values.front(), values.back()};
}

std::vector<Measurement> measure(const std::vector<Case>& cases, int rounds, int pings) {
  std::vector<Measurement> results;
  std::vector<Running> running;
  for (const Case& one : cases) {
    Measurement& result = results.emplace_back();
    result.name = one.name;
    engine::Scene scene = one.scene;
    scene.track.pings = pings;
    const double start_s = wall_s();
    engine::Simulator simulator(scene);
    result.prepare_s = wall_s() - start_s;
    result.faces = simulator.seafloor().faces;
    result.code_path = simulator.code_path();
    std::vector<engine::Pose> poses = simulator.track();
    for (const engine::EchoLine& line : simulator.ping(poses.front(), 0))  // warms up, too
      result.rays_per_ping += static_cast<double>(line.rays);
    running.push_back({std::move(simulator), std::move(poses), {}});
  }

  std::vector<engine::StageTimes> before;
  for (const Running& one : running) before.push_back(one.simulator.times());
  for (int round = 0; round < rounds; ++round)
    for (Running& one : running) {
      const double start_s = wall_s();
      for (std::size_t i = 0; i < one.poses.size(); ++i) one.simulator.ping(one.poses[i], i);
      one.ping_ms.push_back(1e3 * (wall_s() - start_s) / pings);
    }

  for (std::size_t i = 0; i < running.size(); ++i) {
    const engine::StageTimes& times = running[i].simulator.times();
    const double to_ms = 1e3 / (static_cast<double>(rounds) * pings);
    results[i].ping_ms = spread_of(running[i].ping_ms);
    results[i].surface_ms = (times.surface_s - before[i].surface_s) * to_ms;
    results[i].trace_ms = (times.trace_s - before[i].trace_s) * to_ms;
    results[i].echo_ms = (times.echo_s - before[i].echo_s) * to_ms;
    results[i].speckle_ms = (times.speckle_s - before[i].speckle_s) * to_ms;
  }
  return results;
}

}  // namespace ensonify::bench
