#include <ensonify/engine/sonar/instrument/sonar.h>

#include <algorithm>
#include <cmath>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

Shading shading_of(ShadingKind kind, double side_lobe_db, int nbar,
                   const std::vector<double>& weights) {
  switch (kind) {
    case ShadingKind::uniform:
    case ShadingKind::same: break;
    case ShadingKind::hann: return Shading::hann();
    case ShadingKind::taylor: return Shading::taylor(side_lobe_db, nbar);
    case ShadingKind::chebyshev: return Shading::chebyshev(side_lobe_db);
    case ShadingKind::weights: return Shading::of_weights(weights);
  }
  return {};
}

}  // namespace

double Sonar::bearing_rad(int beam) const {
  if (beams == 1) return 0.0;
  const double edge = 0.5 * field_of_view_rad, place = 2.0 * beam / (beams - 1.0) - 1.0;
  return beam_steps == BeamSteps::angle ? place * edge : std::asin(place * std::sin(edge));
}

double Sonar::sine_step(double wavelength_m) const {
  return 2.0 * std::sin(receive_array(wavelength_m).null_rad(1)) / planes;
}

LineArray Sonar::transmit_array(double wavelength_m) const {
  if (steers()) {
    const double width_rad =
        transmit_beamwidth_rad > 0.0 ? transmit_beamwidth_rad : field_of_view_rad;
    return {0.5 * Shading().beam_width_x() * wavelength_m / std::sin(0.5 * width_rad),
            wavelength_m};
  }
  return {array_length_m, wavelength_m,
          shading_of(shading, shading_side_lobe_db, taylor_nbar, shading_weights)};
}

LineArray Sonar::receive_array(double wavelength_m) const {
  const bool same = receive_shading == ShadingKind::same;
  return {receive_length_m(), wavelength_m,
          shading_of(same ? shading : receive_shading, shading_side_lobe_db, taylor_nbar,
                     same ? shading_weights : receive_shading_weights)};
}

double Sonar::defocus(double at_m) const {
  if (focus_zones_m.empty()) return focused ? 0.0 : 1.0;
  double nearest = 1.0 - at_m / focus_zones_m.front();
  for (const double zone_m : focus_zones_m)
    if (const double its = 1.0 - at_m / zone_m; std::abs(its) < std::abs(nearest)) nearest = its;
  return nearest;
}

// Between two zones, |1 / r - 1 / z| is largest where it is equal for both: where 1 / r is halfway
// between their 1 / z.
double Sonar::most_defocused_m(double nearest_m) const {
  double worst_m = nearest_m;
  const auto include = [&](double at_m) {
    if (at_m > nearest_m && at_m <= range_m &&
        std::abs(defocus(at_m)) / at_m > std::abs(defocus(worst_m)) / worst_m)
      worst_m = at_m;
  };
  for (const double a : focus_zones_m) {
    include(range_m);
    for (const double b : focus_zones_m) include(2.0 / (1.0 / a + 1.0 / b));
  }
  return worst_m;
}

// If a bed is turned from level by an angle, its nearest place is turned from straight down by the
// same angle. Two places of the bed at one range are at equal angles on both sides of the nearest
// place. A bed that is turned to the other side needs a smaller fan.
double Sonar::sector_end_rad() const {
  if (sector_high_rad) return *sector_high_rad;
  constexpr double straight_down = 90.0 * degree, turned = 10.0 * degree;
  constexpr double farthest = 135.0 * degree, widest = 145.0 * degree, step = 0.5 * degree;
  const double most_db = 0.1, most_share = scatter::from_db(most_db) - 1.0;
  const auto heard = [&](double depression_rad) {
    return std::ranges::any_of(sectors(), [&](const Sector& sector) {
      if (sector.element) return false;
      const double here = vertical.power(depression_rad, sector);
      const double across = vertical.power(2.0 * (straight_down + turned) - depression_rad, sector);
      return here * here > most_share * across * across;
    });
  };
  double end_rad = farthest;
  while (end_rad > straight_down + turned + 0.5 * step && !heard(end_rad - step)) end_rad -= step;
  return std::min(end_rad, std::max(straight_down, sector_low_rad + widest));
}

double ReceiverOptions::self_noise_density(double speed_mps) const {
  if (!self_noise_db) return 0.0;
  const double faster = std::max(speed_mps / self_noise_speed_mps, 1.0);
  return scatter::from_db(*self_noise_db + self_noise_slope_db * std::log10(faster));
}

Sonar Sonar::sampled(double sound_speed_mps) const {
  Sonar sonar = *this;
  if (sample_rate_hz == 0.0) return sonar;
  const double own_bin_m = 0.5 * sound_speed_mps / sample_rate_hz;
  // The factor keeps a whole number of bins whole in spite of rounding.
  sonar.bins =
      static_cast<int>(std::clamp(std::ceil(range_m / own_bin_m * (1.0 - 1e-9)), 1.0, 1e9));
  sonar.range_m = sonar.bins * own_bin_m;
  return sonar;
}

}  // namespace ensonify::engine
