#include <ensonify/engine/sonar/echo/ping_tracer.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {

PingTracer::PingTracer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
                       std::span<const MaterialInSonar> materials, const Refraction& refraction,
                       const std::vector<Label>* moving, const ObjectSurfaces& surfaces,
                       const std::function<void()>& stop_check)
    : range_m_(trace_range_m(sonar, medium.sound_speed_mps)),
      sound_speed_mps_(medium.sound_speed_mps),
      sectors_(sonar.sectors()),
      layouts_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      surfaces_(surfaces),
      tracer_(refraction, range_m_, medium.sound_speed_mps),
      former_(sonar, medium, seafloor, materials, moving, surfaces) {
  if (tracer_.bends()) layouts_.bend(*refraction.profile, medium.sound_speed_mps);
  const double wavelength_m = medium.sound_speed_mps / sonar.frequency_hz;
  if (sonar.steers()) {
    beams_.push_back(Beam::of_element(sonar, wavelength_m));
    steered_ = std::make_unique<Steered>(sonar, medium, former_.bins(), stop_check);
    for (int beam = 0; beam < sonar.beams; ++beam)
      lines_.push_back(
          {.beam = beam, .sine = steered_->beams.sine(static_cast<std::size_t>(beam))});
    fans_ = 1;
    return;
  }
  for (int beam = 0; beam < sonar.beams; ++beam) {
    if (stop_check) stop_check();
    beams_.emplace_back(sonar, wavelength_m, sonar.beam_offset_m(beam));
    for (std::size_t sector = 0; sector < sectors_.size(); ++sector)
      lines_.push_back({.sector = sector, .beam = beam, .fan = lines_.size()});
  }
  fans_ = lines_.size();
}

PingTracer::Steered::Steered(const Sonar& sonar, const Medium& medium, std::size_t bins,
                             const std::function<void()>& stop_check)
    : beams(sonar, medium.sound_speed_mps / sonar.frequency_hz, bins, stop_check),
      echo(sonar, medium, beams, bins) {}

void PingTracer::aim(const Pose& pose, double altitude_m, double nearest_bed_m,
                     std::span<const double> rise_rad, std::vector<FanAim>& fans) {
  double near_m = std::min(altitude_m, nearest_bed_m);  // of the bed or an object
  for (const std::vector<ObjectSurface>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects) near_m = nearest_flat_part_m(*objects, pose.position, near_m);
  for (std::size_t i = 0; i < sectors_.size(); ++i) {
    const Sector& sector = sectors_[i];
    FanAim& aim = fans.emplace_back();
    aim.altitude_m = altitude_m;
    aim.motion = receiver_motion(pose, sector, range_m_, sound_speed_mps_);
    aim.layout =
        layouts_.at(pose, sector, altitude_m, near_m,
                    std::abs(aim.motion.drift_along) + range_m_ * aim.motion.array_turn.norm(),
                    rise_rad.empty() ? 0.0 : rise_rad[i]);
    aim.fan = place_fan(*aim.layout, pose, sector, range_m_);
    aim.fan.bend = tracer_.bend();
  }
}

std::vector<FanAim> PingTracer::aim(const Pose& pose, double altitude_m) {
  std::vector<FanAim> fans;
  aim(pose, altitude_m, altitude_m, {}, fans);
  return fans;
}

void PingTracer::echo(std::span<const LinePlan> plans, const FanAim& aim, const FanHits& hits,
                      std::span<EchoLine> lines) {
  for (std::size_t i = 0; i < plans.size(); ++i) {
    lines[i].sector = plans[i].sector;
    lines[i].beam = plans[i].beam;
  }
  if (steered_) {
    former_.form_planes(beams_[0], aim, hits, steered_->planes);
    steered_->echo.form(steered_->planes, lines);
  } else {
    for (std::size_t i = 0; i < plans.size(); ++i)
      former_.form(beams_[static_cast<std::size_t>(plans[i].beam)], aim, hits, lines[i]);
  }
}

}  // namespace ensonify::engine
