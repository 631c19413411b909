#include <ensonify/engine/sonar/echo/steered_echo.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/engine/sonar/echo/range_bins.h>

namespace ensonify::engine {

SteeredEcho::SteeredEcho(const Sonar& sonar, const Medium& medium, const SteeredBeams& beams,
                         std::size_t bins)
    : beams_(beams),
      bin_m_(sonar.bin_m()),
      bins_(bins),
      pulse_(pulse_kernel(sonar.pulse, medium.sound_speed_mps, sonar.bin_m())),
      steady_(sonar.pulse, medium.sound_speed_mps, sonar.bin_m(),
              static_cast<std::size_t>(sonar.bins)),
      spread_(static_cast<std::size_t>(sonar.bins)) {}

void SteeredEcho::form(FanPlanes& planes, std::span<EchoLine> lines) {
  add_planes(planes);
  planes.received = energy_;
  for (std::size_t beam = 0; beam < lines.size(); ++beam) {
    EchoLine& line = lines[beam];
    line.rays = beam == 0 ? planes.rays : 0;  // one fan serves all beams
    line.hits = beam == 0 ? planes.hits : 0;
    line.walls.clear();
    spread(beam);
    write_truth(planes, beam, line);
    add_glints(planes, beam, line);
    for (std::size_t bin = 0; bin < spread_.size(); ++bin) {
      line.bins.intensity_mean[bin] = line.bins.intensity[bin] = static_cast<float>(spread_[bin]);
      line.bins.range_m[bin] = static_cast<float>((static_cast<double>(bin) + 0.5) * bin_m_);
    }
  }
}

BeamBins SteeredEcho::sums_of(std::size_t beam, std::size_t from) {
  const std::size_t at = beam * bins_ + from;
  return {.energy = &energy_[at],
          .lit = &lit_[at],
          .shadowed = &shadowed_[at],
          .of_label = &of_label_[at],
          .most = &most_[at],
          .most_shadowed = &most_shadowed_[at],
          .label = &label_[at],
          .plane = &plane_[at],
          .shadowing_plane = &shadowing_plane_[at]};
}

void SteeredEcho::add_planes(const FanPlanes& planes) {
  for (auto* sums : {&energy_, &lit_, &shadowed_, &of_label_, &most_, &most_shadowed_})
    sums->assign(beams_.size() * bins_, 0.0f);
  for (auto* numbers : {&label_, &plane_, &shadowing_plane_})
    numbers->assign(beams_.size() * bins_, 0u);
  const auto for_each = [&](const auto& add) {
    for (std::size_t plane = 0; plane < planes.planes; ++plane) {
      const std::size_t row = plane * planes.bins;
      beams_.for_each_weight(
          &planes.sine[row], planes.bins, scratch_,
          [&](std::size_t beam, std::size_t from, std::size_t until, std::complex<float> field) {
            const std::size_t at = row + from;
            add(PlaneBins{&planes.energy[at], &planes.lit[at], &planes.shadowed[at],
                          &planes.label[at]},
                static_cast<std::uint32_t>(plane), std::norm(field), until - from,
                sums_of(beam, from));
          });
    }
  };
  for_each([](const PlaneBins& plane, std::uint32_t number, float power, std::size_t bins,
              const BeamBins& beam) { add_plane(plane, number, power, bins, beam); });
  for_each([](const PlaneBins& plane, std::uint32_t, float power, std::size_t bins,
              const BeamBins& beam) { add_same_label(plane, power, bins, beam); });
}

void SteeredEcho::spread(std::size_t beam) {
  const std::size_t margin = pulse_.weights.size();
  padded_.assign(bins_ + 2 * margin, 0.0);
  for (std::size_t bin = 0; bin < bins_; ++bin)
    padded_[margin + bin] = double(energy_[beam * bins_ + bin]);
  spread_by_pulse(pulse_, &padded_[margin], spread_);
}

void SteeredEcho::add_glints(const FanPlanes& planes, std::size_t beam, EchoLine& line) {
  for (const FanPlanes::Glint& glint : planes.glints) {
    const auto bin =
        std::min(static_cast<std::size_t>(std::max(glint.range_m / bin_m_, 0.0)), bins_ - 1);
    const std::complex<float> field = beams_.field(beam, bin, glint.sine - beams_.sine(beam));
    if (field == 0.0f) continue;
    steady_.add(glint.range_m, glint.field * std::complex<double>(field));
    if (bin >= spread_.size()) continue;
    const double power = std::norm(glint.field) * double(std::norm(field));
    if (power <= double(most_[beam * bins_ + bin])) continue;
    BinLayers& out = line.bins;
    out.x_m[bin] = static_cast<float>(glint.place.x());
    out.y_m[bin] = static_cast<float>(glint.place.y());
    out.z_m[bin] = static_cast<float>(glint.place.z());
    out.grazing_rad[bin] = static_cast<float>(0.5 * std::numbers::pi);
    out.sediment[bin] = glint.label.sediment;
    out.class_id[bin] = glint.label.class_id;
    out.instance[bin] = glint.label.instance;
    out.fraction[bin] = static_cast<float>(power / (power + double(energy_[beam * bins_ + bin])));
    out.region[bin] = static_cast<std::uint32_t>(Region::object);
  }
  steady_.write(line.glint_re, line.glint_im);
  for (std::size_t bin = 0; bin < line.glint_re.size(); ++bin) {
    const double re = double(line.glint_re[bin]), im = double(line.glint_im[bin]);
    spread_[bin] += re * re + im * im;
  }
}

void SteeredEcho::write_truth(const FanPlanes& planes, std::size_t beam, EchoLine& line) const {
  BinLayers& out = line.bins;
  line.first_return = -1;
  line.starved = 0;
  for (std::size_t bin = 0; bin < spread_.size(); ++bin) {
    const std::size_t at = beam * bins_ + bin;
    const BinLayers& strongest = planes.lines[plane_[at]].bins;
    const bool lit = energy_[at] > 0.0f;
    if (lit && line.first_return < 0) line.first_return = static_cast<int>(bin);
    out.x_m[bin] = lit ? strongest.x_m[bin] : 0.0f;
    out.y_m[bin] = lit ? strongest.y_m[bin] : 0.0f;
    out.z_m[bin] = lit ? strongest.z_m[bin] : 0.0f;
    out.grazing_rad[bin] = lit ? strongest.grazing_rad[bin] : 0.0f;
    out.sediment[bin] = lit ? strongest.sediment[bin] : 0;
    out.class_id[bin] = lit ? strongest.class_id[bin] : 0;
    out.instance[bin] = lit ? strongest.instance[bin] : 0;
    out.layover[bin] = lit ? strongest.layover[bin] : 0;
    out.fraction[bin] = lit ? of_label_[at] / energy_[at] : 0.0f;
    const float dark = shadowed_[at] > 0.0f ? shadowed_[at] / (lit_[at] + shadowed_[at]) : 0.0f;
    out.shadow_fraction[bin] = dark;
    out.shadow_instance[bin] =
        dark > 0.0f ? planes.lines[shadowing_plane_[at]].bins.shadow_instance[bin] : 0;
    Region region = Region::no_data;
    if (line.first_return < 0)
      region = Region::water_column;
    else if (dark > 0.5f)
      region = Region::shadow;
    else if (lit)
      region = strongest.region[bin] == static_cast<std::uint32_t>(Region::object) ? Region::object
                                                                                   : Region::seabed;
    else
      ++line.starved;
    out.region[bin] = static_cast<std::uint32_t>(region);
  }
  if (line.first_return < 0)
    std::ranges::fill(out.region, static_cast<std::uint32_t>(Region::no_data));
  else
    line.starved -= fill_with_water(out.region);
}

}  // namespace ensonify::engine
