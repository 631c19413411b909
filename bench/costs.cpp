#include "costs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/sonar/echo/visibility_counter.h>
#include <ensonify/engine/sonar/reception/signal_chain.h>
#include <ensonify/scatter/backscatter.h>

#include "clock.h"
#include "scenes.h"
#include "temporary_folder.h"

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
  without(), with();  // warm up
  std::vector<double> off, on, ratios;
  for (int round = 0; round < rounds; ++round) {
    off.push_back(timed_ms(without));
    on.push_back(timed_ms(with));
    ratios.push_back(on.back() / off.back());
  }
  return {std::move(name), faces, spread_of(off), spread_of(on), spread_of(ratios).median};
}

/// Compares a mesh with its labels and the same mesh with a single label.
void measure_labels(std::vector<CostMeasurement>& results, std::string_view filter,
                    const fs::path& data, int rounds, int pings) {
  const std::string name = "labels/wreck/2M";
  const fs::path wreck = data / "mesh_underwater/skytteren_wreck.ply";
  if (name.find(filter) == std::string::npos || !fs::exists(wreck)) return;
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
  Seafloor bare = labelled;  // both sides of faces scatter, as for the wreck
  bare.face_label.clear();
  bare.labels.resize(1);
  bare.labels[0].two_sided = true;

  Sonar sonar;
  sonar.range_m = 180.0;
  sonar.bins = 1800;
  const auto tracer = make_intersector("embree", labelled.mesh);
  const std::vector<MaterialInSonar> lambert(labelled.materials.size(),
                                             {scatter::BackscatterTable(scatter::Lambert(-27.0))});
  PingTracer with(sonar, {}, labelled, lambert), without(sonar, {}, bare, lambert);
  TracedFaces faces = Faces{tracer.get(), labelled.mesh};
  VisibilityCounter views(labelled);
  EchoLine line;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  const auto turn = [&](PingTracer& pinger, VisibilityCounter* looking) {
    for (int i = 0; i < pings; ++i) {
      const Pose pose{.position = {-30.0 + 60.0 * i / pings, -20.0, -45.0},
                      .heading_rad = 1.5707963};
      const std::vector<FanAim> aims = pinger.aim(pose, 45.0);
      for (const LinePlan& plan : pinger.lines()) {
        const FanAim& aim = aims[plan.fan];
        const FanHits& hits = pinger.tracer().trace(aim.fan, plan.fan, faces);
        if (looking)
          looking->look(aim.fan, labelled.mesh, *hits.runs, static_cast<std::uint64_t>(i));
        pinger.echo({&plan, 1}, aim, hits, {&line, 1});
      }
    }
  };
  results.push_back(in_turns(
      name, labelled.faces, rounds, [&] { turn(without, nullptr); }, [&] { turn(with, &views); },
      pings));
}

void measure_refraction(std::vector<CostMeasurement>& results, std::string_view filter, int rounds,
                        int pings) {
  const TemporaryFolder folder;
  const fs::path cast = folder.path() / "cast.csv";
  for (const auto& [bed, faces] : {std::pair{"ripples", 2e6}, std::pair{"fractal", 2e6}})
    for (const char* surface : {"static", "footprint", "refined"}) {
      std::vector<std::pair<const char*, RefractionMode>> modes{
          {"time-only", RefractionMode::time_only}, {"full", RefractionMode::full}};
      std::erase_if(modes, [&, bed = bed](const auto& mode) {
        return fmt::format("refraction/{}/2M/{}/{}", bed, surface, mode.first).find(filter) ==
               std::string::npos;
      });
      if (modes.empty()) continue;
      // 30 m/s over 4 m, about half-way down to the bed.
      std::ofstream(cast) << "depth_m,soundspeed_mps\n0,1520\n12,1520\n16,1490\n60,1490.5\n";
      Scene scene = bed == std::string_view("ripples") ? ripples(faces) : fractal(faces);
      scene.run.surface = surface;
      scene.track.pings = pings;
      scene.sea.profile = {"cast.csv", cast};
      Simulator plain(scene);
      const std::vector<Pose> poses = plain.track();
      const auto turn = [&](Simulator& simulator) {
        for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping_numbered(poses[i], i);
      };
      for (const auto& [name, mode] : modes) {
        scene.sea.refraction = mode;
        Simulator bent(scene);
        results.push_back(in_turns(
            fmt::format("refraction/{}/2M/{}/{}", bed, surface, name), plain.seafloor().faces,
            rounds, [&] { turn(plain); }, [&] { turn(bent); }, pings));
      }
    }
}

/// The signal chain over 2 x 7,500 bins, from expected echo to samples: alone, then with and
/// without each effect.
void measure_signal(std::vector<CostMeasurement>& results, std::string_view filter, int rounds,
                    int pings) {
  Sonar plain;
  plain.bins = 7500;
  const ChainOptions usual;
  struct Effect {
    const char* name;
    std::function<void(Sonar&, ChainOptions&)> apply;
  };
  const Effect effects[] = {
      {"speckle and noise", [](Sonar&, ChainOptions&) {}},
      {"lfm over 2.5 bins", [](Sonar& s, ChainOptions&) { s.pulse.kind = PulseKind::lfm; }},
      {"4 looks", [](Sonar& s, ChainOptions&) { s.receiver.looks = 4; }},
      {"logarithmic curve",
       [](Sonar& s, ChainOptions&) { s.receiver.curve = TransferCurve::logarithmic; }},
      {"output noise", [](Sonar& s, ChainOptions&) { s.receiver.output_noise_db = -60.0; }},
      {"surface", [](Sonar&, ChainOptions& o) { o.arrivals.surface = true; }},
      {"volume", [](Sonar&, ChainOptions& o) { o.arrivals.volume = true; }},
      {"multiples", [](Sonar&, ChainOptions& o) { o.arrivals.multiples = true; }},
      {"double bounce", [](Sonar&, ChainOptions& o) { o.arrivals.double_bounce = true; }},
      {"second time around", [](Sonar&, ChainOptions& o) { o.arrivals.second_time_around = true; }},
      {"burst", [](Sonar&, ChainOptions& o) { o.arrivals.burst_m = 0.3; }},
      {"cross-talk", [](Sonar&, ChainOptions& o) { o.arrivals.crosstalk_db = -40.0; }},
      {"interference", [](Sonar&, ChainOptions& o) { o.artefacts.interference_db = 30.0; }},
      {"gain steps",
       [](Sonar&, ChainOptions& o) {
         o.artefacts.gain_step_db = 3.0;
         o.artefacts.gain_step_s = 0.3;
       }},
      {"automatic gain", [](Sonar&, ChainOptions& o) { o.artefacts.automatic_gain = 0.5; }},
      {"fish", [](Sonar&, ChainOptions& o) { o.artefacts.fish_per_hectare = 200.0; }},
      {"wake", [](Sonar&, ChainOptions& o) { o.artefacts.wake_db = -10.0; }},
      {"shimmer", [](Sonar&, ChainOptions& o) { o.artefacts.shimmer_db = 1.5; }},
  };
  const auto compare = [&](const std::string& name, const Sonar& sonar,
                           const ChainOptions& with_options, const ChainOptions& without_options) {
    if (name.find(filter) == std::string::npos) return;
    const SignalChain with(sonar, with_options), without(plain, without_options);
    SignalChain::Scratch scratch;
    EchoLine lines[2];
    for (const Sector& sector : sidescan_sectors) {
      EchoLine& line = lines[sector.number];
      line.sector = sector.number;
      line.bins.assign(7500);
      const double outwards = sector.out;
      line.walls = {{.middle = {outwards * 25.0, 0.0, -9.0},  // for the double bounce
                     .normal = {-outwards, 0.0, 0.0},
                     .length_m = 5.0,
                     .height_m = 2.0,
                     .reflected = 0.5}};
      for (std::size_t i = 1000; i < 7500; ++i) {  // a level bed 10 m down
        const double r = (static_cast<double>(i) + 0.5) * plain.bin_m();
        const double over_m = std::sqrt(r * r - 100.0);
        line.bins.intensity_mean[i] = 1e8f;
        line.bins.range_m[i] = static_cast<float>(r);
        line.bins.x_m[i] = static_cast<float>(outwards * over_m);
        line.bins.z_m[i] = -20.0f;
        line.bins.region[i] = static_cast<std::uint32_t>(Region::seabed);
      }
    }
    const auto receive = [&](const SignalChain& chain, int i) {
      const LineContext context{.ping = static_cast<std::uint64_t>(i),
                                .t_s = 0.1 * i,
                                .array = {{0.0, 0.2 * i, -10.0}, {0.0, 1.0, 0.0}}};
      chain.receive(std::array{context, context}, lines, scratch);
    };
    const auto turn = [&](const SignalChain& chain) {
      for (int i = 0; i < pings; ++i) receive(chain, i);
    };
    const auto samples = [&](const SignalChain& chain) {
      std::vector<std::uint32_t> all;
      for (int i = 0; i < std::min(pings, 10); ++i) {
        receive(chain, i);
        for (const EchoLine& line : lines)
          all.insert(all.end(), line.bins.sample.begin(), line.bins.sample.end());
      }
      return all;
    };
    if (samples(with) == samples(without))
      throw std::logic_error(name + " changes nothing, so there is no cost to measure");
    results.push_back(in_turns(
        name, 0, rounds, [&] { turn(without); }, [&] { turn(with); }, pings));
  };
  Sonar all_sonar = plain;
  ChainOptions all = usual, quiet = usual;
  quiet.speckle = false;
  for (const Effect& effect : effects) {
    Sonar sonar = plain;
    ChainOptions options = usual;
    effect.apply(sonar, options);
    const bool first = &effect == &effects[0];
    compare(std::string("signal/") + effect.name, sonar, options, first ? quiet : usual);
    effect.apply(all_sonar, all);
  }
  all_sonar.receiver.looks = 1;  // more looks would multiply the echoes
  compare("signal/all arrivals and artefacts", all_sonar, all, usual);
  compare("signal/all, and speckle", all_sonar, all, quiet);
}

}  // namespace

std::vector<CostMeasurement> measure_costs(std::string_view filter, const fs::path& data,
                                           int rounds, int pings) {
  std::vector<CostMeasurement> results;
  measure_labels(results, filter, data, rounds, pings);
  measure_refraction(results, filter, rounds, pings);
  measure_signal(results, filter, rounds, pings);
  return results;
}

}  // namespace ensonify::bench
