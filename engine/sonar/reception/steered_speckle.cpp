#include <ensonify/engine/sonar/reception/steered_speckle.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/sonar/echo/steered_kernel.h>
#include <ensonify/engine/sonar/reception/signal_kernel.h>

namespace ensonify::engine {

SteeredSpeckle::SteeredSpeckle(const Sonar& sonar, double sound_speed_mps, std::uint64_t seed,
                               double reference_heading_rad,
                               const std::vector<scatter::GroundTexture>& by_material,
                               const std::function<void()>& stop_check)
    : beams_(sonar, sound_speed_mps / sonar.frequency_hz, static_cast<std::size_t>(sonar.bins),
             stop_check),
      scatterers_(Scatterers::of_planes(
          sonar, sound_speed_mps, seed, reference_heading_rad, by_material,
          sonar.sine_step(sound_speed_mps / sonar.frequency_hz),
          0.5 * std::cos(0.5 * sonar.field_of_view_rad))),  // planes farther aside are few
      bins_(static_cast<std::size_t>(sonar.bins)),
      room_(whole_groups(bins_)) {}

/// Sums the scatterers of each plane.
void SteeredSpeckle::gather(const FanPlanes& planes, int looks, Scratch& scratch) const {
  const RayFan& fan = *planes.fan;
  const std::size_t of_look = planes.planes * planes.bins;
  for (auto* fields : {&scratch.plane_re, &scratch.plane_im})
    fields->assign(of_look * static_cast<std::size_t>(looks), 0.0f);
  scratch.power.resize(room_);
  for (std::size_t plane = 0; plane < planes.planes; ++plane) {
    const float* energy = planes.energy_of(plane);
    if (std::all_of(energy, energy + bins_, [](float e) { return e == 0.0f; })) continue;
    std::copy_n(energy, bins_, scratch.power.begin());
    const FanGrid::Plane& its = fan.grid->planes[plane];
    const std::size_t table = scatterers_.table_of(its.cos_azimuth);
    // Seen from above, a plane's scatterers lie on lines that are perpendicular to it.
    const ArrayFrame frame{
        fan.origin, its.cos_azimuth * fan.array_axis - its.sin_azimuth * fan.middle, -fan.pole};
    scatterers_.place(frame, planes.lines[plane].bins, scratch.cells, table);
    for (int look = 0; look < looks; ++look) {
      const std::size_t at = static_cast<std::size_t>(look) * of_look + plane * planes.bins;
      scatterers_.gather(scratch.cells, look, scratch.power, &scratch.plane_re[at],
                         &scratch.plane_im[at], table);
    }
  }
}

void SteeredSpeckle::sum(const FanPlanes& planes, int looks, std::size_t reach,
                         Scratch& scratch) const {
  gather(planes, looks, scratch);
  const std::size_t all = begin_of(0, 1, reach), of_look = planes.planes * planes.bins;
  scratch.re.assign(all * static_cast<std::size_t>(looks), 0.0f);
  scratch.im.assign(all * static_cast<std::size_t>(looks), 0.0f);
  scratch.variance.assign(all, 0.0f);
  for (std::size_t bin = 0; bin < room_; bin += steered_block) {
    const auto returns_something = [&](std::size_t plane) {
      const float* energy = planes.energy_of(plane) + bin;
      return std::any_of(energy, energy + steered_block, [](float e) { return e != 0.0f; });
    };
    beams_.for_each_range(planes.sine.data(), planes.planes, planes.bins, bin, scratch.ranges,
                          returns_something,
                          [&](std::size_t beam, std::size_t first, std::size_t last) {
                            for (int look = 0; look < looks; ++look) {
                              const std::size_t from = static_cast<std::size_t>(look) * of_look,
                                                to = begin_of(beam, look, reach) + reach;
                              receive_fields({first, last, planes.bins, bin, planes.sine.data()},
                                             beams_.fields_of(beam),
                                             {.plane_re = &scratch.plane_re[from],
                                              .plane_im = &scratch.plane_im[from],
                                              .sum_re = &scratch.re[to],
                                              .sum_im = &scratch.im[to]});
                            }
                          });
  }
  for (std::size_t beam = 0; beam < beams_.size(); ++beam)
    std::copy_n(&planes.received[beam * planes.bins], bins_,
                &scratch.variance[begin_of(beam, 0, reach) + reach]);
}

}  // namespace ensonify::engine
