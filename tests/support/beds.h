#pragma once

#include <array>
#include <vector>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/ping_tracer.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/scatter/backscatter.h>

namespace ensonify::tests {

/// A level square of two triangles about the origin.
inline engine::Seafloor level_bed(double depth_m, double half_extent_m = 2000.0) {
  const auto e = static_cast<float>(half_extent_m), z = static_cast<float>(-depth_m);
  engine::Seafloor bed;
  bed.mesh.positions = {{-e, -e, z}, {e, -e, z}, {e, e, z}, {-e, e, z}};
  bed.mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  bed.bed_faces = 2;
  bed.labels = {{1, 1, 0}};
  return bed;
}

/// Adds an upright box on the bed: its faces have another label, with instance 7.
inline void add_box(engine::Seafloor& bed, Eigen::Vector3f low, Eigen::Vector3f high) {
  const auto first = static_cast<std::uint32_t>(bed.mesh.positions.size());
  for (int i = 0; i < 8; ++i)
    bed.mesh.positions.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                                    i & 4 ? high.z() : low.z());
  bed.face_label.resize(bed.mesh.faces.size(), 0);
  constexpr std::array<std::array<std::uint32_t, 4>, 6> sides{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& [a, b, c, d] : sides) {
    bed.mesh.faces.push_back({first + a, first + b, first + c});
    bed.mesh.faces.push_back({first + a, first + c, first + d});
  }
  bed.labels.push_back({2, 2, 7});
  bed.face_label.resize(bed.mesh.faces.size(), static_cast<std::uint16_t>(bed.labels.size() - 1));
}

/// A sonar with the same gain in all vertical directions down to straight down, in the far field at
/// all ranges. The closed forms are of the bed on one side of the track.
inline engine::Sonar plain_sonar() {
  engine::Sonar sonar;
  sonar.focused = true;
  sonar.vertical.beamwidth_rad = 0.0;
  sonar.sector_high_rad = 90.0 * engine::degree;
  return sonar;
}

/// `count` materials that all scatter by one law.
inline std::vector<engine::MaterialInSonar> materials_of(std::size_t count,
                                                         const scatter::Backscatter& law) {
  return std::vector<engine::MaterialInSonar>(count, {scatter::BackscatterTable(law)});
}

/// The expected echo of a line over these faces. pose: the pose of the line's beam.
inline engine::EchoLine echo_line(engine::PingTracer& pinger, const engine::LinePlan& plan,
                                  const engine::Pose& pose, double altitude_m,
                                  const engine::Faces& faces, int bins) {
  engine::EchoLine line;
  line.bins.assign(static_cast<std::size_t>(bins));
  const std::vector<engine::FanAim> aims = pinger.aim(pose, altitude_m);
  const engine::FanAim& aim = aims[plan.sector];
  engine::TracedFaces traced = faces;
  pinger.echo({&plan, 1}, aim, pinger.tracer().trace(aim.fan, 0, traced), {&line, 1});
  return line;
}

/// The expected echoes of one ping, port and starboard, over a bed with Lambert's law.
inline std::array<engine::EchoLine, 2> ping_once(const engine::Sonar& sonar,
                                                 const engine::Seafloor& bed,
                                                 const engine::Pose& pose, double altitude_m,
                                                 const engine::Medium& medium = {},
                                                 std::string_view intersector_name = "embree") {
  const auto intersector = engine::make_intersector(intersector_name, bed.mesh);
  const std::vector<engine::MaterialInSonar> lambert = materials_of(3, scatter::Lambert(-27.0));
  engine::PingTracer pinger(sonar, medium, bed, lambert);
  std::array<engine::EchoLine, 2> lines;
  for (const engine::LinePlan& plan : pinger.lines())
    lines[plan.sector] =
        echo_line(pinger, plan, pose, altitude_m, {intersector.get(), bed.mesh}, sonar.bins);
  return lines;
}

/// The bin that contains a range.
inline std::size_t bin_at(const engine::Sonar& sonar, double range_m) {
  return static_cast<std::size_t>(range_m / sonar.bin_m());
}

inline bool is(const engine::EchoLine& line, std::size_t bin, engine::Region region) {
  return line.bins.region[bin] == static_cast<std::uint32_t>(region);
}

}  // namespace ensonify::tests
