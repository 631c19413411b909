#include <ensonify/engine/simulator/internals.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include <Eigen/Geometry>

#include <ensonify/engine/simulator/state.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/engine/trace/check/ping_comparison.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {
namespace {

struct NumberedMesh {
  refine::TriangleMesh mesh;
  std::vector<std::uint32_t> numbers;  // of the faces
};

/// For a seafloor whose bed is a grid: all objects, and the part of the bed that lies, seen from
/// above, within the range of the fans, and under the vehicle.
NumberedMesh mesh_near(const Seafloor& seafloor, const Eigen::Vector3d& vehicle,
                       std::span<const RayFan> fans) {
  Eigen::AlignedBox2d box(vehicle.head<2>());
  for (const RayFan& fan : fans) {
    const Eigen::Vector2d place = fan.origin.head<2>();
    const Eigen::Vector2d reach = Eigen::Vector2d::Constant(fan.range_m * fan.bend.lengthening);
    box.extend(place - reach);
    box.extend(place + reach);
  }
  const refine::HeightGrid& grid = *seafloor.grid;
  const auto cells = [](std::span<const float> lines, double low_m, double high_m) {
    const auto first = std::ranges::lower_bound(lines, low_m) - lines.begin();
    const auto end = std::ranges::upper_bound(lines, high_m) - lines.begin();
    return std::array{std::max(0, static_cast<int>(first) - 1),
                      std::min(static_cast<int>(lines.size()) - 1, static_cast<int>(end))};
  };
  const auto columns = cells(grid.x(), box.min().x(), box.max().x());
  const auto rows = cells(grid.y(), box.min().y(), box.max().y());
  NumberedMesh near;
  near.mesh =
      seafloor.with_objects(grid.mesh(columns[0], columns[1], rows[0], rows[1], &near.numbers));
  for (auto face = static_cast<std::uint32_t>(seafloor.bed_faces); face < seafloor.faces; ++face)
    near.numbers.push_back(face);
  return near;
}

}  // namespace

void SimulatorInternals::announce(Simulator& simulator, std::span<const Pose> poses,
                                  std::span<const std::size_t> pings, refine::SpareThreads& spare) {
  simulator.own_->announced = {poses, pings};
  simulator.own_->spare = &spare;
}

const UsualPing& SimulatorInternals::usual_ping(const Simulator& simulator) {
  return simulator.shared_->usual_ping;
}

void SimulatorInternals::reset(Simulator& simulator) { simulator.own_->face_source.reset(); }

std::span<const RayFan> SimulatorInternals::aim(Simulator& simulator, const Pose& pose) {
  simulator.aim(pose, simulator.own_->aim);
  return simulator.own_->aim.fans_only;
}

std::vector<std::vector<Hit>> SimulatorInternals::hits(Simulator& simulator, const Pose& pose) {
  const std::span<const RayFan> fans = aim(simulator, pose);
  const Intersector& intersector = *simulator.own_->face_source.prepare(fans).intersector;
  std::vector<std::vector<Hit>> all;
  for (const RayFan& fan : fans) intersector.intersect(fan, all.emplace_back(fan.grid->rays()));
  return all;
}

AgreementCounts SimulatorInternals::verify(Simulator& simulator, const Pose& pose) {
  const Simulator::SharedState& shared = *simulator.shared_;
  const Seafloor& seafloor = shared.seafloor;
  const std::span<const RayFan> fans = aim(simulator, pose);
  CheckedMesh mesh{seafloor.mesh, shared.bounds, seafloor.bed_faces};
  NumberedMesh near;
  if (const auto& progressive = seafloor.progressive) {
    progressive->verify_all();
    mesh.triangles = {progressive->points, progressive->faces, progressive->source_face};
  } else if (seafloor.grid) {
    near = mesh_near(seafloor, pose.position, fans);
    if (seafloor.in_tiles()) {
      const refine::Bounds of_near = refine::bounds(near.mesh);
      mesh.bounds.lowest.z() = of_near.lowest.z();
      mesh.bounds.highest.z() = of_near.highest.z();
    }
    mesh.triangles = {near.mesh.positions, near.mesh.faces, near.numbers};
  }
  AgreementCounts counts = compare_ping(simulator.own_->face_source.fixed(), mesh, fans,
                                        intersector_kind(shared.parts.intersector).precision);
  counts += compare_height(mesh, pose.position.x(), pose.position.y(),
                           simulator.own_->bed.height_m(pose.position.x(), pose.position.y()));
  return counts;
}

TrackPoses SimulatorInternals::track_poses(const Simulator& simulator) {
  const Simulator::SharedState& shared = *simulator.shared_;
  if (shared.recorded_track) return *shared.recorded_track;
  return shared.track_over(simulator.own_->bed);
}

const PreparedSeafloor& SimulatorInternals::prepared(const Simulator& simulator) {
  return *simulator.shared_->prepared;
}

std::shared_ptr<const Intersector> SimulatorInternals::whole(const Simulator& simulator) {
  return simulator.shared_->parts.whole;
}

std::string_view SimulatorInternals::code_path(const Simulator& simulator) {
  return simulator.shared_->code_path;
}

const Recorder& SimulatorInternals::recorder(const Simulator& simulator, std::size_t sonar) {
  return simulator.own_->prepared.at(sonar)->chain->recorder();
}

std::vector<FullScale> SimulatorInternals::full_scale_by_beam(const Simulator& simulator,
                                                              std::size_t sonar) {
  const SignalChain& chain = *simulator.own_->prepared.at(sonar)->chain;
  std::vector<FullScale> full_scale;
  for (int beam = 0; beam < simulator.sonars()[sonar].beams; ++beam)
    full_scale.push_back(chain.full_scale(beam));
  return full_scale;
}

void SimulatorInternals::count_object_visibility(Simulator& simulator) {
  simulator.own_->count_object_visibility(*simulator.shared_);
}

std::span<const ObjectVisibility> SimulatorInternals::object_visibility(const Simulator& simulator,
                                                                        std::size_t sonar) {
  if (simulator.own_->visibility_counters.empty()) return {};
  return simulator.own_->visibility_counters.at(sonar).visibilities();
}

Refraction SimulatorInternals::refraction(const Simulator& simulator) {
  const Simulator::SharedState& shared = *simulator.shared_;
  return shared.refraction(*shared.sonars.front(), simulator.own_->heights);
}

RefractionCounts SimulatorInternals::refraction_counts(const Simulator& simulator) {
  RefractionCounts sum;
  for (const PingTracer& sonar : simulator.own_->tracers) sum += sonar.tracer().refraction_counts();
  return sum;
}

const StageTimes& SimulatorInternals::times(const Simulator& simulator) {
  return simulator.own_->times;
}

}  // namespace ensonify::engine
