// Compares bent rays with chords of a hundredth of a millimetre's sagitta through the reference
// tracer, over the seabeds of scenes and with measured casts. Takes a while: [.soak].

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/data.h"
#include "support/paths.h"

#include <ensonify/engine/scene/profile_reader.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator_internals.h>
#include <ensonify/engine/trace/refraction/ray_bend.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>
#include <ensonify/scatter/sound_ray.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

/// A ray's first hit by short chords; then its arc is intersected with that face's plane.
class Reference {
 public:
  Reference(const scatter::SoundSpeedProfile& profile, refine::Triangles triangles,
            double highest_m, double reference_mps)
      : profile_(profile),
        triangles_(triangles),
        tracer_(make_intersector("pluecker", triangles)),
        top_m_(-highest_m),
        reference_mps_(reference_mps) {}

  Hit trace(const Vector3d& origin, const Vector3d& d, double range_m) const {
    scatter::SoundRay ray(profile_, -origin.z(), d.head<2>().norm(), -d.z());
    const Eigen::Vector2d level = d.head<2>().norm() > 0.0
                                      ? Eigen::Vector2d(d.head<2>().normalized())
                                      : Eigen::Vector2d(1, 0);
    const auto place = [&](const scatter::SoundRay& at) {
      return Vector3d(origin.x() + at.point().range_m * level.x(),
                      origin.y() + at.point().range_m * level.y(), -at.point().depth_m);
    };
    while (reference_mps_ * ray.point().time_s < range_m) {
      const scatter::SoundRay from = ray;
      const double curvature = std::abs(ray.curvature_per_m());
      double step_m = curvature > 0.0 ? std::sqrt(8e-5 / curvature) : range_m;
      step_m = std::min(step_m, range_m);
      const bool above = ray.point().depth_m < top_m_ - 2.0 && ray.point().down > 0.0;
      if (above) step_m = std::max(step_m, 0.5);  // no faces there
      ray.advance(std::min(step_m, ray.path_to_edge_m()));
      if (above && ray.point().depth_m < top_m_ - 1.0) continue;
      const Ray chord{place(from), place(ray) - place(from), 0.0, 1.0};
      if (chord.direction.norm() == 0.0) continue;
      Hit hit;
      tracer_->intersect({&chord, 1}, {&hit, 1});
      if (!hit) continue;
      const Vector3d a = triangles_.corner(hit.index, 0);
      const Vector3d normal = (triangles_.corner(hit.index, 1) - a)
                                  .cross(triangles_.corner(hit.index, 2) - a)
                                  .normalized();
      double low_m = 0.0, high_m = ray.point().path_m - from.point().path_m;
      const auto off_m = [&](double path_m) {
        scatter::SoundRay at = from;
        at.advance(path_m);
        return normal.dot(place(at) - a);
      };
      const double first = off_m(low_m);
      for (int i = 0; i < 60; ++i)
        ((off_m(0.5 * (low_m + high_m)) > 0.0) == (first > 0.0) ? low_m : high_m) =
            0.5 * (low_m + high_m);
      scatter::SoundRay at = from;
      at.advance(low_m);
      hit.t = reference_mps_ * at.point().time_s;
      return hit.t <= range_m ? hit : Hit{};
    }
    return {};
  }

 private:
  const scatter::SoundSpeedProfile& profile_;
  refine::Triangles triangles_;
  std::unique_ptr<Intersector> tracer_;
  double top_m_, reference_mps_;
};

constexpr std::size_t places = 3;  // along the track: about a million rays in total

struct Tally {
  std::size_t rays = 0, hits = 0, same = 0, near_edge = 0, unexplained = 0;
  double worst_s = 0.0;
};

Tally compare(const Scene& scene, const scatter::SoundSpeedProfile& profile) {
  Simulator simulator(scene);
  const Seafloor& seafloor = simulator.seafloor();
  const refine::Bounds box = seafloor.bounds();
  const double mps = profile.mean_speed_mps(0.0, std::max(1.0, -seafloor.mean_bed_m));
  const double highest_m = box.highest.z(), deepest_m = -double(box.lowest.z());
  const Reference reference(profile, seafloor.mesh, highest_m, mps);
  const auto embree = make_intersector("embree", seafloor.mesh);
  RefractedTracer tracer(profile, highest_m, deepest_m, mps);
  const std::vector<Pose> poses = simulator.track();
  Tally tally;
  std::vector<RayFan> fans;
  for (std::size_t i = 1; i <= places; ++i)
    for (const RayFan& fan :
         SimulatorInternals::aim(simulator, poses[i * poses.size() / (places + 1)]))
      fans.push_back(fan);
  for (RayFan& fan : fans) {
    fan.bend = bend_of(profile, deepest_m, fan.range_m, mps);
    std::vector<Hit> hits(fan.grid->rays());
    tracer.trace(fan, embree.get(), seafloor.mesh, 0, hits);
    for (std::size_t k = 0; k < fan.planes(); ++k)
      for (std::size_t j = 0; j < fan.elevations(); ++j) {
        if (!fan.grid->within_beam(k, j)) continue;
        ++tally.rays;
        const Vector3d d = fan.direction(fan.plane_direction(k), j).normalized();
        Hit& found = hits[k * fan.elevations() + j];
        if (found) tracer.incidence_of(k * fan.elevations() + j, found);
        const Hit expected = reference.trace(fan.origin, d, fan.range_m);
        tally.hits += static_cast<bool>(expected);
        if (found.face == expected.face) {
          ++tally.same;
          if (found) tally.worst_s = std::max(tally.worst_s, std::abs(found.t - expected.t) / mps);
          continue;
        }
        // A ray displaced by a millimetre hits the found face too, or both hits are at one place.
        const double t = std::min({found ? found.t : 1e9, expected ? expected.t : 1e9});
        const Vector3d across = d.unitOrthogonal(), other = d.cross(across);
        bool near_edge = (found && expected && std::abs(found.t - expected.t) < 1e-3) ||
                         std::abs(t - fan.range_m) < 1e-3;
        for (const Vector3d& way : {across, Vector3d(-across), other, Vector3d(-other)}) {
          const Hit beside =
              reference.trace(fan.origin, (d + 1e-3 / t * way).normalized(), fan.range_m);
          // A neighbour at a corner is the same place.
          near_edge = near_edge || beside.face == found.face ||
                      (found && beside && std::abs(beside.t - found.t) < 2e-3);
        }
        ++(near_edge ? tally.near_edge : tally.unexplained);
        if (!near_edge)
          WARN("plane " << k << ", ray " << j << ": " << found.t << " m to face " << found.face
                        << ", not " << expected.t << " m to " << expected.face);
      }
  }
  const RefractionCounts& counts = tracer.counts();
  WARN(tally.rays << " rays, " << tally.hits << " hits, " << tally.same << " of the same face, "
                  << tally.near_edge << " within a millimetre of an edge, " << tally.unexplained
                  << " unexplained; times within " << tally.worst_s << " s; " << counts.straightened
                  << " of " << counts.rays << " in straightened space, " << counts.chords << " chords");
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
      const Tally tally = compare(scene, profile);
      CHECK(tally.rays > 60000);
      CHECK(tally.unexplained == 0);
      CHECK(tally.worst_s < 1e-6);
    }
  }
}
