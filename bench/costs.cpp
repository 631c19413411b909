#include "costs.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/object_views.h>
#include <ensonify/engine/sonar/ping.h>
#include <ensonify/scatter/backscatter.h>

#include "clock.h"
#include "scenes.h"

namespace ensonify::bench {
namespace {

namespace fs = std::filesystem;
using namespace engine;

CostMeasurement in_turns(std::string name, std::size_t faces, int rounds,
                         const std::function<void()>& without, const std::function<void()>& with,
                         int pings) {
  const auto timed_ms = [&](const std::function<void()>& turn) {
    const double start_s = thread_s();
    turn();
    return 1e3 * (thread_s() - start_s) / pings;
  };
  without(), with();  // warm
  std::vector<double> off, on, ratios;
  for (int round = 0; round < rounds; ++round) {
    off.push_back(timed_ms(without));
    on.push_back(timed_ms(with));
    ratios.push_back(on.back() / off.back());
  }
  return {std::move(name), faces, spread_of(off), spread_of(on), spread_of(ratios).median};
}

/// The same mesh with its labels, and as if it were all one thing.
void measure_labels(std::vector<CostMeasurement>& results, std::string_view filter, int rounds,
                    int pings) {
  const std::string name = "labels/wreck/2M";
  const char* data = std::getenv("ENSONIFY_DATA");
  const fs::path wreck = fs::path(data ? data : "") / "mesh_underwater/skytteren_wreck.ply";
  if (name.find(filter) == std::string::npos || !data || !fs::exists(wreck)) return;
  SeafloorOptions bed;
  bed.extent_east_m = bed.extent_north_m = 300.0;
  bed.cell_m = 0.31;
  bed.depth_m = 90.0;
  bed.seabed.patches.resize(2);
  bed.seabed.patches[0].area.share = 0.4;
  bed.seabed.patches[1] = {.material = "sandy gravel"};
  bed.seabed.patches[1].area.share = 0.2;
  bed.seabed.boulders.resize(1);
  const std::vector<ObjectOptions> objects{{.mesh = {"wreck.ply", wreck}, .north_m = 60.0}};
  const Seafloor labelled = make_seafloor(bed, 1, objects);
  Seafloor bare = labelled;  // which answers from both sides, as the wreck does
  bare.face_label.clear();
  bare.labels.resize(1);
  bare.labels[0].two_sided = true;

  Sonar sonar;
  sonar.range_m = 180.0;
  sonar.bins = 1800;
  const auto tracer = make_intersector("embree", labelled.mesh);
  const std::vector<scatter::BackscatterTable> lambert(
      labelled.materials.size(), scatter::BackscatterTable(scatter::Lambert(-27.0)));
  Pinger with(sonar, 0, {}, labelled, lambert), without(sonar, 0, {}, bare, lambert);
  ObjectViews views(labelled);
  EchoLine line;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  const auto turn = [&](Pinger& pinger, ObjectViews* looking) {
    for (int i = 0; i < pings; ++i) {
      const Pose pose{.position = {-30.0 + 60.0 * i / pings, -20.0, -45.0},
                      .heading_rad = 1.5707963};
      pinger.aim(pose, 45.0);
      for (const Side side : {Side::port, Side::starboard}) {
        const std::span<const Hit> hits = pinger.trace(*tracer, labelled.mesh, side);
        if (looking)
          looking->look(pinger.fan(side), labelled.mesh, hits, static_cast<std::uint64_t>(i));
        pinger.echo(labelled.mesh, side, line);
      }
    }
  };
  results.push_back(in_turns(
      name, labelled.faces, rounds, [&] { turn(without, nullptr); }, [&] { turn(with, &views); },
      pings));
}

void measure_refraction(std::vector<CostMeasurement>& results, std::string_view filter, int rounds,
                        int pings) {
  const fs::path cast =
      fs::temp_directory_path() / fmt::format("ensonify-bench-{}.csv", ::getpid());
  for (const auto& [bed, faces] : {std::pair{"ripples", 2e6}, std::pair{"fractal", 2e6}})
    for (const char* surface : {"static", "footprint"}) {
      std::vector<std::pair<const char*, RefractionMode>> modes{
          {"time-only", RefractionMode::time_only}, {"full", RefractionMode::full}};
      std::erase_if(modes, [&](const auto& mode) {
        return fmt::format("refraction/{}/2M/{}/{}", bed, surface, mode.first).find(filter) ==
               std::string::npos;
      });
      if (modes.empty()) continue;
      // 30 m/s over 4 m, half-way to the bed's depth.
      std::ofstream(cast) << "depth_m,soundspeed_mps\n0,1520\n12,1520\n16,1490\n60,1490.5\n";
      Scene scene = bed == std::string_view("ripples") ? ripples(faces) : fractal(faces);
      scene.run.surface = surface;
      scene.track.pings = pings;
      scene.sea.profile = {"cast.csv", cast};
      Simulator plain(scene);
      const std::vector<Pose> poses = plain.track();
      const auto turn = [&](Simulator& simulator) {
        for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping(poses[i], i);
      };
      for (const auto& [name, mode] : modes) {
        scene.sea.refraction = mode;
        Simulator bent(scene);
        results.push_back(in_turns(
            fmt::format("refraction/{}/2M/{}/{}", bed, surface, name), plain.seafloor().faces,
            rounds, [&] { turn(plain); }, [&] { turn(bent); }, pings));
      }
    }
  std::error_code ignored;
  fs::remove(cast, ignored);
}

}  // namespace

std::vector<CostMeasurement> measure_costs(std::string_view filter, int rounds, int pings) {
  std::vector<CostMeasurement> results;
  measure_labels(results, filter, rounds, pings);
  measure_refraction(results, filter, rounds, pings);
  return results;
}

}  // namespace ensonify::bench
