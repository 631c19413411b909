#include <ensonify/engine/sonar/reception/moved_beam.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {

MovedBeam::MovedBeam(const Sonar& sonar, double wavelength_m)
    : sonar_(sonar),
      transmit_(sonar.transmit_array(wavelength_m)),
      receive_(sonar.receive_array(wavelength_m)),
      wavelength_m_(wavelength_m),
      middle_(beam(0.0)),
      half_way_m_(0.25 * sonar.range_m) {
  const double nearest_m = 0.5 * (transmit_.length_m + receive_.length_m);
  for (std::size_t i = 0; i < share_rows; ++i) {
    const double place = static_cast<double>(i) / share_rows;
    const double range_m = std::max(half_way_m_ * place / (1.0 - place), nearest_m);
    const double reach = lobes_rad(transmit_, sonar.transmit_defocus(range_m), range_m) +
                         transmit_.null_rad(sonar.lobes_beyond()) +
                         lobes_rad(receive_, sonar.defocus(range_m), range_m);
    Row& row = rows_.emplace_back();
    row.steps_per_shift = shift_steps / reach;
    for (std::size_t step = 0; step <= shift_steps; ++step)
      row.shares[step] =
          summed_share(range_m, reach * static_cast<double>(step) / double(shift_steps));
  }
}

double MovedBeam::lobes_rad(const LineArray& array, double defocus, double range_m) const {
  return array.null_rad(sonar_.side_lobes + 1) + 0.5 * array.length_m * std::abs(defocus) / range_m;
}

Beam MovedBeam::beam(double ahead_m) const {
  Sonar all_round = sonar_;
  all_round.vertical = {.beamwidth_rad = 0.0};  // the vertical pattern does not matter
  return {all_round, wavelength_m_, ahead_m};
}

double MovedBeam::summed_share(double range_m, double shift, const Beam& beam,
                               double ahead_m) const {
  const double offset_rad = std::abs(ahead_m) / range_m, shift_rad = std::abs(shift);
  const double sent_rad = lobes_rad(transmit_, sonar_.transmit_defocus(range_m), range_m);
  const double reach_rad =
      std::min(sent_rad + offset_rad +
                   next_lobe_rad(shift_rad, sent_rad, transmit_.null_rad(sonar_.lobes_beyond())),
               lobes_rad(receive_, sonar_.defocus(range_m), range_m) + shift_rad +
                   next_lobe_rad(offset_rad, sent_rad, receive_.null_rad(sonar_.lobes_beyond())));
  std::array<BeamSample, 256> samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double place = (2.0 * static_cast<double>(i) + 1.0) / samples.size() - 1.0;
    samples[i] = {static_cast<float>(place * reach_rad), 1.0f};
  }
  ReceiverMotion motion{.abeam = Eigen::Vector3d::UnitX(), .down = -Eigen::Vector3d::UnitZ()};
  const auto width = [&](const Beam& of) {
    return of.two_way(0, samples, 1.0, motion.abeam, range_m, motion);
  };
  const double at_rest = width(middle_);
  motion.steady = false;
  motion.drift_along = shift;
  return width(beam) / at_rest;
}

double MovedBeam::share(double range_m, double shift) const {
  const double place = double(share_rows) * range_m / (range_m + half_way_m_);
  const std::size_t below = std::min(static_cast<std::size_t>(place), share_rows - 2);
  const double up = std::min(place - static_cast<double>(below), 1.0);
  const auto at = [&](const Row& row) {
    const double steps = std::abs(shift) * row.steps_per_shift;
    if (!(steps < double(shift_steps))) return 0.0;
    const auto step = static_cast<std::size_t>(steps);
    const double* its = &row.shares[step];
    return its[0] + (steps - static_cast<double>(step)) * (its[1] - its[0]);
  };
  const double here = at(rows_[below]);
  return here + up * (at(rows_[below + 1]) - here);
}

}  // namespace ensonify::engine
