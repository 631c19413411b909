#include <ensonify/engine/sonar/echo/beam.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include <ensonify/engine/base/made_once.h>

namespace ensonify::engine {
namespace {

constexpr auto rows = static_cast<std::size_t>(array_rows);
constexpr double middle_nearness = array_middle_nearness;
constexpr int columns_per_lobe = 64;

constexpr auto directions = static_cast<std::size_t>(vertical_directions);

double nearness_of(std::size_t row) {
  return middle_nearness * static_cast<double>(row) / static_cast<double>(rows - row);
}

/// One row: power times 1 + 2 F, which stays bounded as F grows, at x = column * step.
std::vector<float> row_of(const Shading& shading, double nearness, double step,
                          std::size_t columns) {
  std::vector<float> row(columns);
  // The Fresnel integral over one half of the array, by Simpson's rule. The cosines of the steps
  // follow by recurrence.
  const double last_x = step * static_cast<double>(row.size() - 1);
  const int steps = shading.whole_steps(64 + 2 * static_cast<int>(4.0 * (nearness + last_x)));
  const double du = 0.5 / steps;
  std::vector<double> re(static_cast<std::size_t>(steps) + 1), im(re.size());
  for (std::size_t i = 0; i < re.size(); ++i) {
    const double u = du * static_cast<double>(i);
    const double rule = i == 0 || i + 1 == re.size() ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    const double weight = rule * shading.at(u);
    const double phase = 2.0 * std::numbers::pi * nearness * u * u;
    re[i] = 2.0 * weight * du / 3.0 * std::cos(phase);
    im[i] = 2.0 * weight * du / 3.0 * std::sin(phase);
  }
  // Several columns at a time, because in a column each step waits for the step before.
  constexpr std::size_t together = 8;
  for (std::size_t first = 0; first < row.size(); first += together) {
    std::array<double, together> turn, now, before, sum_re{}, sum_im{};
    for (std::size_t c = 0; c < together; ++c) {
      turn[c] = std::cos(2.0 * std::numbers::pi * du * step * static_cast<double>(first + c));
      now[c] = 1.0, before[c] = turn[c];
    }
    for (std::size_t i = 0; i < re.size(); ++i)
      for (std::size_t c = 0; c < together; ++c) {
        sum_re[c] += re[i] * now[c];
        sum_im[c] += im[i] * now[c];
        const double next = 2.0 * turn[c] * now[c] - before[c];
        before[c] = now[c];
        now[c] = next;
      }
    for (std::size_t c = 0; c < std::min(together, row.size() - first); ++c)
      row[first + c] = static_cast<float>((sum_re[c] * sum_re[c] + sum_im[c] * sum_im[c]) *
                                          (1.0 + 2.0 * nearness));
  }
  return row;
}

/// The table of most sonars: no shading, no side lobes, no beams far from the middle. Its 33,000
/// integrals take as long as several pings.
std::shared_ptr<const ArrayTable> usual_array_table() {
  return std::make_shared<const ArrayTable>(0, Shading(), 1);
}

std::shared_ptr<const ArrayTable> array_table(const Sonar& sonar, const Shading& shading,
                                              double lobe_rad) {
  // The angle by which an outer beam lies aside at a tenth of the range.
  const double aside_rad = sonar.beam_offset_m(sonar.parallel_beams() - 1) / (0.1 * sonar.range_m);
  const int lobes = static_cast<int>(
      std::clamp(std::ceil(aside_rad / lobe_rad), 1.0, double(sonar.lobes_beyond())));
  if (sonar.side_lobes > 0 || lobes > 1 || shading != Shading())
    return std::make_shared<const ArrayTable>(sonar.side_lobes, shading, lobes);
  return made_once<usual_array_table>();
}

/// A measure of a direction's angle that grows from -2 to 2 over a turn and takes no arc tangent.
double diamond_angle(double abeam, double down) {
  const double t = down / (std::abs(abeam) + std::abs(down));
  return abeam >= 0.0 ? t : down >= 0.0 ? 2.0 - t : -2.0 - t;
}

}  // namespace

ArrayTable::ArrayTable(int side_lobes, const Shading& shading, int lobes_beyond)
    : reach_(shading.null_x(side_lobes + 1) + lobes_beyond),
      columns_(static_cast<std::size_t>(columns_per_lobe * std::ceil(reach_)) + 1),
      last_column_(static_cast<float>(columns_ - 1)),
      values_(2 * (rows - 1) * columns_) {
  for (std::size_t row = 0; row < rows; ++row) {
    const double step = (nearness_of(row) + reach_) / static_cast<double>(columns_ - 1);
    const std::vector<float> values = row_of(shading, nearness_of(row), step, columns_);
    for (std::size_t column = 0; column < columns_; ++column) {
      if (row + 1 < rows) values_[2 * (row * columns_ + column)] = values[column];
      if (row > 0) values_[2 * ((row - 1) * columns_ + column) + 1] = values[column];
    }
  }
}

ArrayTable::Row ArrayTable::row(double nearness) const {
  // One division in place of three.
  const double to_middle = nearness + middle_nearness, to_reach = nearness + reach_,
               to_scale = 1.0 + 2.0 * nearness;
  const double inverse = 1.0 / (to_middle * to_reach * to_scale);
  const double place =
      std::min(nearness * inverse * to_reach * to_scale * double(rows), double(rows) - 1.001);
  const auto below = static_cast<std::size_t>(place);
  return {&values_[2 * below * columns_], static_cast<float>(place - static_cast<double>(below)),
          static_cast<float>(static_cast<double>(last_column_) * inverse * to_middle * to_scale),
          static_cast<float>(inverse * to_middle * to_reach)};
}

std::vector<VerticalTable> VerticalTable::of(const Sonar& sonar) {
  std::vector<VerticalTable> tables;
  for (const Sector& sector : sonar.sectors()) tables.emplace_back(sonar.vertical, sector);
  return tables;
}

VerticalTable::VerticalTable(const VerticalPattern& pattern, const Sector& sector) {
  for (std::size_t i = 0; i <= directions; ++i) {
    const double t = 4.0 * static_cast<double>(i) / directions - 2.0;
    const double down = std::abs(t) <= 1.0 ? t : std::copysign(2.0 - std::abs(t), t);
    const double abeam = std::copysign(1.0 - std::abs(down), 1.0 - std::abs(t));
    values_.push_back(static_cast<float>(pattern.power(std::atan2(down, abeam), sector)));
  }
}

double VerticalTable::power(double abeam, double down) const {
  const double place = (diamond_angle(abeam, down) + 2.0) * (directions / 4.0);
  const std::size_t below = std::min(static_cast<std::size_t>(place), directions - 1);
  const double share = place - static_cast<double>(below);
  return values_[below] + share * (values_[below + 1] - values_[below]);
}

ReceiverMotion receiver_motion(const Pose& pose, const Sector& sector, double range_m,
                               double sound_speed_mps) {
  const double back_s = 2.0 * range_m / sound_speed_mps;
  ReceiverMotion motion;
  motion.steady = pose.velocity_mps.isZero(0.0) && pose.roll_rate_radps == 0.0 &&
                  pose.pitch_rate_radps == 0.0 && pose.heading_rate_radps == 0.0;
  motion.drift = 2.0 / sound_speed_mps * pose.velocity_mps;
  const Eigen::Matrix3d sent = body_to_world(pose);
  const Eigen::Matrix3d turn = (body_to_world(pose.after(back_s)) - sent) / range_m;
  motion.drift_along = motion.drift.dot(sent.col(0));
  motion.abeam = sector.out * sent.col(1);
  motion.down = sent.col(2);
  motion.array_turn = turn.col(0);
  motion.abeam_turn = sector.out * turn.col(1);
  motion.down_turn = turn.col(2);
  return motion;
}

Beam::Beam(const Sonar& sonar, double wavelength_m, double beam_offset_m)
    : Beam(sonar, sonar.transmit_array(wavelength_m), sonar.receive_array(wavelength_m),
           beam_offset_m) {}

Beam Beam::of_element(const Sonar& sonar, double wavelength_m) {
  return {sonar, sonar.transmit_array(wavelength_m), {0.0, wavelength_m}, 0.0};
}

Beam::Beam(const Sonar& sonar, const LineArray& transmit, const LineArray& receive,
           double beam_offset_m)
    : focused_(sonar.focused && sonar.focus_zones_m.empty() && sonar.parallel_beams() == 1),
      same_arrays_(receive == transmit && sonar.parallel_beams() == 1),
      transmit_table_(array_table(sonar, transmit.shading, transmit.null_rad(1))),
      receive_table_(receive.shading == transmit.shading
                         ? transmit_table_
                         : array_table(sonar, receive.shading, transmit.null_rad(1))),
      vertical_(VerticalTable::of(sonar)) {
  const bool zones = !sonar.focus_zones_m.empty();
  const auto array = [&](const LineArray& of, bool focusing, double offset_m) -> Array {
    return {.x_per_sine = static_cast<float>(of.length_m / of.wavelength_m),
            .nearness_m = focusing && sonar.focused && !zones
                              ? 0.0
                              : 0.5 * of.length_m * of.length_m / of.wavelength_m,
            .in_zones = focusing && zones,
            .offset_m = static_cast<float>(offset_m),
            .shading = of.shading};
  };
  // A separate receiver has the beam; the transmitter stays in the array's middle.
  transmit_ = array(transmit, sonar.parallel_beams() == 1, beam_offset_m);
  receive_ = array(receive, true, 0.0);
  for (const double zone_m : sonar.focus_zones_m)
    zones_per_m_.push_back(static_cast<float>(1.0 / zone_m));
}

// LineArray::nearness() with Sonar::defocus(), in the kernel's form.
double Beam::nearness_at(const Array& array, double range_m) const {
  double defocus = 1.0;
  if (array.in_zones) {
    defocus = std::numeric_limits<double>::infinity();
    for (const float zone_per_m : zones_per_m_)
      if (const double its = 1.0 - range_m * double(zone_per_m); std::abs(its) < std::abs(defocus))
        defocus = its;
  }
  return array.nearness_m / range_m * defocus;
}

/// By how much a direction's sine is greater for the receiver that has moved.
double Beam::heard_shift(const Eigen::Vector3d& direction, double range_m,
                         const ReceiverMotion& motion) const {
  if (motion.steady) return 0.0;
  return range_m * (direction - motion.drift).dot(motion.array_turn) - motion.drift_along;
}

Beam::VerticalPowers Beam::vertical_powers(std::size_t sector, const Eigen::Vector3d& direction,
                                           double range_m, const ReceiverMotion& motion) const {
  const VerticalTable& vertical = vertical_table(sector);
  const double sent = vertical.power(direction.dot(motion.abeam), direction.dot(motion.down));
  if (motion.steady) return {sent, sent};
  const Eigen::Vector3d way = direction - motion.drift;
  return {sent, vertical.power(way.dot(motion.abeam) + range_m * way.dot(motion.abeam_turn),
                               way.dot(motion.down) + range_m * way.dot(motion.down_turn))};
}

double Beam::two_way(std::size_t sector, std::span<const BeamSample> samples, double cos_elevation,
                     const Eigen::Vector3d& direction, double range_m,
                     const ReceiverMotion& motion) const {
  const auto [sent, heard] = vertical_powers(sector, direction, range_m, motion);
  const auto cosine = static_cast<float>(cos_elevation);
  const ArrayTable::Row row = transmit_table_->row(std::abs(nearness_at(transmit_, range_m)));
  float sum = 0.0f;
  if (motion.steady && same_arrays_) {
    for (const BeamSample& sample : samples) {
      const float one_way =
          transmit_table_->value(row, cosine * sample.sin_azimuth * transmit_.x_per_sine);
      sum += sample.width_rad * one_way * one_way;
    }
    return cos_elevation * sent * heard * row.scale * row.scale * sum;
  }
  const ArrayTable::Row heard_row =
      same_arrays_ ? row : receive_table().row(std::abs(nearness_at(receive_, range_m)));
  const auto sent_shift = static_cast<float>(double(transmit_.offset_m) / range_m);
  const auto shift = static_cast<float>(heard_shift(direction, range_m, motion));
  for (const BeamSample& sample : samples) {
    const float sine = cosine * sample.sin_azimuth;
    const float transmitted =
        transmit_table_->value(row, (sine + sent_shift) * transmit_.x_per_sine);
    if (transmitted > 0.0f)
      sum += sample.width_rad * transmitted *
             receive_table().value(heard_row, (sine + shift) * receive_.x_per_sine);
  }
  return cos_elevation * sent * heard * row.scale * heard_row.scale * sum;
}

ArrayField Beam::field_near(const Eigen::Vector3d& direction, double range_m,
                            const ReceiverMotion& motion) const {
  ArrayField field;
  field.beam_ = this;
  field.sent_nearness_ = nearness_at(transmit_, range_m);
  field.heard_nearness_ = nearness_at(receive_, range_m);
  field.sent_shift_ = double(transmit_.offset_m) / range_m;
  field.heard_shift_ = heard_shift(direction, range_m, motion);
  const double sent = (std::abs(field.sent_nearness_) + transmit_table_->reach()) /
                      double(transmit_.x_per_sine),
               heard = (std::abs(field.heard_nearness_) + receive_table_->reach()) /
                       double(receive_.x_per_sine);
  field.low = std::max(-sent - field.sent_shift_, -heard - field.heard_shift_);
  field.high = std::min(sent - field.sent_shift_, heard - field.heard_shift_);
  return field;
}

std::complex<double> ArrayField::at(double sine) const {
  const auto one_way = [&](const Beam::Array& array, double shift, double nearness) {
    return array.shading.field((sine + shift) * double(array.x_per_sine), nearness);
  };
  const std::complex<double> sent = one_way(beam_->transmit(), sent_shift_, sent_nearness_);
  if (beam_->same_arrays() && heard_shift_ == sent_shift_) return sent * sent;
  return sent * one_way(beam_->receive(), heard_shift_, heard_nearness_);
}

}  // namespace ensonify::engine
