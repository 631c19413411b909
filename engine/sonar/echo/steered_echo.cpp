#include <ensonify/engine/sonar/echo/steered_echo.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/engine/sonar/echo/range_bins.h>

namespace ensonify::engine {

SteeredEcho::TruthRow SteeredEcho::truth_row(BinLayers& bins) {
  return {bins.x_m.data(),      bins.y_m.data(),
          bins.z_m.data(),      bins.grazing_rad.data(),
          bins.sediment.data(), bins.class_id.data(),
          bins.instance.data(), bins.layover.data(),
          bins.region.data(),   bins.shadow_instance.data()};
}

SteeredEcho::SteeredEcho(const Sonar& sonar, const Medium& medium, const SteeredBeams& beams,
                         std::size_t bins)
    : beams_(beams),
      bin_m_(sonar.bin_m()),
      bins_(whole_blocks(bins)),
      pulse_(pulse_kernel(sonar.pulse, medium.sound_speed_mps, sonar.bin_m())),
      steady_(sonar.pulse, medium.sound_speed_mps, sonar.bin_m(),
              static_cast<std::size_t>(sonar.bins)),
      spread_(static_cast<std::size_t>(sonar.bins)) {}

void SteeredEcho::form(FanPlanes& planes, std::span<EchoLine> lines) {
  add_planes(planes);
  plane_rows_.clear();
  for (std::size_t plane = 0; plane < planes.planes; ++plane)
    plane_rows_.push_back(truth_row(planes.lines[plane].bins));
  for (std::size_t beam = 0; beam < lines.size(); ++beam) {
    EchoLine& line = lines[beam];
    line.rays = beam == 0 ? planes.rays : 0;  // one fan serves all beams
    line.hits = beam == 0 ? planes.hits : 0;
    line.walls.clear();
    spread(&planes.received[beam * bins_]);
    write_truth(planes, beam, line);
    add_glints(planes, beam, line);
    for (std::size_t bin = 0; bin < spread_.size(); ++bin) {
      line.bins.intensity_mean[bin] = line.bins.intensity[bin] = static_cast<float>(spread_[bin]);
      line.bins.range_m[bin] = static_cast<float>((static_cast<double>(bin) + 0.5) * bin_m_);
    }
  }
}

BeamBins SteeredEcho::sums_of(FanPlanes& planes, std::size_t beam) {
  const std::size_t at = beam * bins_;
  return {.energy = &planes.received[at],
          .lit = &lit_[at],
          .shadowed = &shadowed_[at],
          .of_label = &of_label_[at],
          .most = &most_[at],
          .plane = &plane_[at],
          .shadowing_plane = &shadowing_plane_[at]};
}

void SteeredEcho::add_planes(FanPlanes& planes) {
  for (auto* sums : {&planes.received, &lit_, &shadowed_, &of_label_, &most_})
    sums->assign(beams_.size() * bins_, 0.0f);
  for (auto* numbers : {&plane_, &shadowing_plane_}) numbers->assign(beams_.size() * bins_, 0u);
  powers_.resize(std::max(powers_.size(), planes.planes * steered_block));
  const PlaneBins seen{planes.energy.data(), planes.labelled.data(), planes.lit.data(),
                       planes.shadowed.data(), planes.label.data()};
  for (std::size_t bin = 0; bin < bins_; bin += steered_block) {
    const auto sees_something = [&](std::size_t plane) {
      const std::size_t at = plane * bins_ + bin;
      for (const float* table : {seen.lit + at, seen.shadowed + at, seen.energy + at})
        if (std::any_of(table, table + steered_block, [](float value) { return value != 0.0f; }))
          return true;
      return false;
    };
    beams_.for_each_range(planes.sine.data(), planes.planes, bins_, bin, scratch_, sees_something,
                          [&](std::size_t beam, std::size_t first, std::size_t last) {
                            receive_planes({first, last, bins_, bin, planes.sine.data()}, seen,
                                           beams_.fields_of(beam), powers_.data(),
                                           sums_of(planes, beam));
                          });
  }
}

void SteeredEcho::spread(const float* energy) {
  const std::size_t margin = pulse_.weights.size();
  padded_.assign(bins_ + 2 * margin, 0.0);
  for (std::size_t bin = 0; bin < bins_; ++bin) padded_[margin + bin] = double(energy[bin]);
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
    out.fraction[bin] =
        static_cast<float>(power / (power + double(planes.received[beam * bins_ + bin])));
    out.region[bin] = static_cast<std::uint32_t>(Region::object);
  }
  steady_.write(line.glint_re, line.glint_im);
  for (std::size_t bin = 0; bin < line.glint_re.size(); ++bin) {
    const double re = double(line.glint_re[bin]), im = double(line.glint_im[bin]);
    spread_[bin] += re * re + im * im;
  }
}

void SteeredEcho::write_truth(const FanPlanes& planes, std::size_t beam, EchoLine& line) const {
  // The layers' addresses, because a loop over the vectors themselves is slower.
  const TruthRow out = truth_row(line.bins);
  float *const fraction = line.bins.fraction.data(), *const shadow_fraction =
                                                         line.bins.shadow_fraction.data();
  const std::size_t row = beam * bins_;
  const float* energy = &planes.received[row];
  line.first_return = -1;
  line.starved = 0;
  for (std::size_t bin = 0; bin < spread_.size(); ++bin) {
    const std::size_t at = row + bin;
    const bool lit = energy[bin] > 0.0f;
    if (lit && line.first_return < 0) line.first_return = static_cast<int>(bin);
    if (lit)
      out.copy(plane_rows_[plane_[at]], bin);
    else
      out.clear(bin);
    fraction[bin] = lit ? of_label_[at] / energy[bin] : 0.0f;
    const float dark = shadowed_[at] > 0.0f ? shadowed_[at] / (lit_[at] + shadowed_[at]) : 0.0f;
    shadow_fraction[bin] = dark;
    out.shadow_instance[bin] =
        dark > 0.0f ? plane_rows_[shadowing_plane_[at]].shadow_instance[bin] : 0;
    Region region = Region::no_data;
    if (line.first_return < 0)
      region = Region::water_column;
    else if (dark > 0.5f)
      region = Region::shadow;
    else if (lit)
      region = out.region[bin] == static_cast<std::uint32_t>(Region::object) ? Region::object
                                                                             : Region::seabed;
    else
      ++line.starved;
    out.region[bin] = static_cast<std::uint32_t>(region);
  }
  if (line.first_return < 0)
    std::ranges::fill(line.bins.region, static_cast<std::uint32_t>(Region::no_data));
  else
    line.starved -= fill_with_water(line.bins.region);
}

}  // namespace ensonify::engine
