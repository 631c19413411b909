// Compares bent rays with chords of a hundredth of a millimetre's sagitta through the reference
// tracer, over the seabeds of scenes and with measured casts. Takes a while: [.soak].

#include <algorithm>
#include <map>
#include <string>

#include "support/catch.h"
#include "support/data.h"
#include "support/paths.h"

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/tables/profile_reader.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/trace/check/bent_rays.h>
#include <ensonify/engine/trace/refraction/bent_ranges.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr std::size_t places = 3;  // along the track: about a million rays in total

AgreementCounts agreement_of(const Scene& scene, const scatter::SoundSpeedProfile& profile) {
  Simulator simulator(scene);
  const Seafloor& seafloor = simulator.seafloor();
  const refine::Bounds box = seafloor.bounds();
  const double mps = profile.mean_speed_mps(0.0, std::max(1.0, -seafloor.mean_bed_m));
  const double highest_m = box.highest.z(), deepest_m = -double(box.lowest.z());
  const auto exact = make_intersector("pluecker", seafloor.mesh);
  const BentReference reference({&profile, highest_m, mps}, seafloor.mesh, *exact);
  const auto embree = make_intersector("embree", seafloor.mesh);
  RefractedTracer tracer(profile, highest_m, deepest_m, mps);
  const std::vector<Pose> poses = simulator.track();
  AgreementCounts tally;
  std::uint64_t turn = 0;
  std::vector<RayFan> fans;
  for (std::size_t i = 1; i <= places; ++i)
    for (const RayFan& fan :
         SimulatorInternals::aim(simulator, poses[i * poses.size() / (places + 1)]))
      fans.push_back(fan);
  for (RayFan& fan : fans) {
    fan.bend = bend_of(profile, deepest_m, fan.range_m, mps);
    TracedFaces faces = Faces{embree.get(), seafloor.mesh};
    reference.compare(fan, reference.trace_some(fan, 1, turn), tracer, faces, tally);
  }
  const RefractionCounts& counts = tracer.counts();
  WARN(tally.rays << " rays, " << tally.count(Verdict::same) << " with the same answer, "
                  << tally.count(Verdict::tie) << " ties, " << tally.count(Verdict::end)
                  << " at the end of the range, " << tally.count(Verdict::edge)
                  << " within a millimetre of an edge, " << tally.count(Verdict::unexplained)
                  << " unexplained; times within " << tally.largest_dt_m / mps << " s; "
                  << counts.straightened << " of " << counts.rays << " in straightened space, "
                  << counts.chords << " chords");
  for (const Difference& d : tally.unexplained)
    WARN(d.found.t << " m to face " << d.found.face << ", not " << d.expected.t << " m to "
                   << d.expected.face);
  CHECK(tally.largest_dt_m < 1e-6 * mps);
  return tally;
}

}  // namespace

TEST_CASE("Bent rays over scenes' seabeds hit what their finest chords hit, at the same time",
          "[.soak]") {
  std::map<std::string, scatter::SoundSpeedProfile> profiles;
  profiles.emplace("thermocline",
                   scatter::SoundSpeedProfile({{0, 1520}, {11, 1520}, {15, 1490}, {120, 1491}}));
  for (const char* cast : {"castaway_portsmouth_1", "hypack_sfbay", "simrad_shallow_duct"})
    if (const auto file = tests::data_file(std::string("soundspeed/") + cast + ".csv"))
      profiles.emplace(cast, read_profile(*file));
    else
      WARN("no data folder: without " << cast);
  for (const char* name : {"ripples", "rocky", "wreck"}) {
    const auto wreck = tests::data_file("mesh_underwater/skytteren_wreck.ply");
    if (name == std::string("wreck") && !wreck) continue;
    const std::filesystem::path data =
        wreck ? wreck->parent_path().parent_path() : std::filesystem::path();
    Scene scene =
        read_scene(tests::source_folder() / "scenes" / (name + std::string(".toml")), {}, data);
    scene.run.surface = "static";
    for (const auto& [cast, profile] : profiles) {
      WARN(name << " under " << cast);
      const AgreementCounts tally = agreement_of(scene, profile);
      CHECK(tally.rays > 60000);
      CHECK(tally.count(Verdict::unexplained) == 0);
    }
  }
}
