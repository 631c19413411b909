#include <ensonify/engine/sonar/ping.h>

#include <ensonify/engine/random.h>

namespace ensonify::engine {

Pinger::Pinger(const Sonar& sonar, std::uint64_t sonar_number, const Medium& medium,
               const Seafloor& seafloor, std::span<const scatter::BackscatterTable> by_material)
    : range_m_(trace_range_m(sonar, medium.sound_speed_mps)),
      sound_speed_mps_(medium.sound_speed_mps),
      sonar_number_(sonar_number),
      apertures_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      former_(sonar, medium, seafloor, by_material) {}

std::span<const RayFan> Pinger::aim(const Pose& pose, double altitude_m) {
  aperture_ = &apertures_.at(altitude_m);
  for (const Side side : {Side::port, Side::starboard}) {
    const auto i = static_cast<std::size_t>(side);
    fans_[i] = place_fan(*aperture_, pose, side, range_m_);
    receptions_[i] = reception(pose, side, range_m_, sound_speed_mps_);
  }
  hits_.resize(aperture_->grid->rays());
  return fans_;
}

std::span<const Hit> Pinger::trace(const Intersector& intersector, Side side) {
  intersector.intersect(fans_[static_cast<std::size_t>(side)], hits_);
  return hits_;
}

void Pinger::echo(refine::Triangles triangles, Side side, EchoLine& line) {
  line.side = side;
  const auto i = static_cast<std::size_t>(side);
  former_.form(fans_[i], *aperture_, receptions_[i], triangles, hits_, line);
}

void Pinger::speckle(std::uint64_t seed, std::uint64_t ping_number, EchoLine& line) {
  factors_.resize(line.bins.intensity.size());
  Stream(seed, Purpose::speckle,
         {sonar_number_, ping_number, static_cast<std::uint64_t>(line.side)})
      .exponential(factors_);
  for (std::size_t i = 0; i < factors_.size(); ++i)
    line.bins.intensity[i] = static_cast<float>(line.bins.intensity_mean[i] * factors_[i]);
}

}  // namespace ensonify::engine
