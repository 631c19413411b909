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

void SteeredEcho::form(const FanPlanes& planes, std::span<EchoLine> lines) {
  add_planes(planes);
  add_labels(planes);
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

void SteeredEcho::add_planes(const FanPlanes& planes) {
  sums_.assign(beams_.size() * bins_, {});
  for (std::size_t plane = 0; plane < planes.planes; ++plane) {
    const std::size_t row = plane * planes.bins;
    const float *energy = &planes.energy[row], *lit = &planes.lit[row],
                *shadowed = &planes.shadowed[row];
    const auto number = static_cast<std::uint16_t>(plane);
    beams_.for_each_weight(
        &planes.sine[row], planes.bins, scratch_,
        [&](std::size_t beam, std::size_t from, std::size_t until, std::complex<float> field) {
          const float power = std::norm(field);
          Sums* sums = &sums_[beam * bins_];
          for (std::size_t bin = from; bin < until; ++bin) {
            Sums& sum = sums[bin];
            const float here = power * energy[bin], dark = power * shadowed[bin];
            sum.energy += here;
            sum.lit += power * lit[bin];
            sum.shadowed += dark;
            if (here > sum.most) sum.most = here, sum.plane = number;
            if (dark > sum.most_shadowed) sum.most_shadowed = dark, sum.shadowing_plane = number;
          }
        });
  }
}

/// The energy with the label of the strongest plane.
void SteeredEcho::add_labels(const FanPlanes& planes) {
  of_label_.assign(beams_.size() * bins_, 0.0f);
  for (std::size_t plane = 0; plane < planes.planes; ++plane) {
    const std::size_t row = plane * planes.bins;
    const float* energy = &planes.energy[row];
    const BinLayers& own = planes.lines[plane].bins;
    beams_.for_each_weight(
        &planes.sine[row], spread_.size(), scratch_,
        [&](std::size_t beam, std::size_t from, std::size_t until, std::complex<float> field) {
          const float power = std::norm(field);
          for (std::size_t bin = from; bin < until; ++bin) {
            const BinLayers& strongest = planes.lines[sums_[beam * bins_ + bin].plane].bins;
            if (own.instance[bin] == strongest.instance[bin] &&
                own.class_id[bin] == strongest.class_id[bin] &&
                own.sediment[bin] == strongest.sediment[bin])
              of_label_[beam * bins_ + bin] += power * energy[bin];
          }
        });
  }
}

void SteeredEcho::spread(std::size_t beam) {
  const std::size_t margin = pulse_.weights.size();
  energy_.assign(bins_ + 2 * margin, 0.0);
  for (std::size_t bin = 0; bin < bins_; ++bin)
    energy_[margin + bin] = double(sums_[beam * bins_ + bin].energy);
  spread_by_pulse(pulse_, &energy_[margin], spread_);
}

void SteeredEcho::add_glints(const FanPlanes& planes, std::size_t beam, EchoLine& line) {
  for (const FanPlanes::Glint& glint : planes.glints) {
    const auto bin = std::min(static_cast<std::size_t>(std::max(glint.range_m / bin_m_, 0.0)),
                              bins_ - 1);
    const std::complex<float> field = beams_.field(beam, bin, glint.sine - beams_.sine(beam));
    if (field == 0.0f) continue;
    steady_.add(glint.range_m, glint.field * std::complex<double>(field));
    if (bin >= spread_.size()) continue;
    const double power = std::norm(glint.field) * double(std::norm(field));
    const Sums& sums = sums_[beam * bins_ + bin];
    if (power <= double(sums.most)) continue;
    BinLayers& out = line.bins;
    out.x_m[bin] = static_cast<float>(glint.place.x());
    out.y_m[bin] = static_cast<float>(glint.place.y());
    out.z_m[bin] = static_cast<float>(glint.place.z());
    out.grazing_rad[bin] = static_cast<float>(0.5 * std::numbers::pi);
    out.sediment[bin] = glint.label.sediment;
    out.class_id[bin] = glint.label.class_id;
    out.instance[bin] = glint.label.instance;
    out.fraction[bin] = static_cast<float>(power / (power + double(sums.energy)));
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
    const Sums& sums = sums_[beam * bins_ + bin];
    const BinLayers& strongest = planes.lines[sums.plane].bins;
    const bool lit = sums.energy > 0.0f;
    if (lit && line.first_return < 0) line.first_return = static_cast<int>(bin);
    out.x_m[bin] = lit ? strongest.x_m[bin] : 0.0f;
    out.y_m[bin] = lit ? strongest.y_m[bin] : 0.0f;
    out.z_m[bin] = lit ? strongest.z_m[bin] : 0.0f;
    out.grazing_rad[bin] = lit ? strongest.grazing_rad[bin] : 0.0f;
    out.sediment[bin] = lit ? strongest.sediment[bin] : 0;
    out.class_id[bin] = lit ? strongest.class_id[bin] : 0;
    out.instance[bin] = lit ? strongest.instance[bin] : 0;
    out.layover[bin] = lit ? strongest.layover[bin] : 0;
    out.fraction[bin] = lit ? of_label_[beam * bins_ + bin] / sums.energy : 0.0f;
    const float seen = sums.lit + sums.shadowed;
    const float dark = sums.shadowed > 0.0f ? sums.shadowed / seen : 0.0f;
    out.shadow_fraction[bin] = dark;
    out.shadow_instance[bin] =
        dark > 0.0f ? planes.lines[sums.shadowing_plane].bins.shadow_instance[bin] : 0;
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
