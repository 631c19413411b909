#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/beam_tables.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// LineArray::power of an unfocused array as a table, the same for all arrays: over the angle
/// x = L sin(psi) / lambda and the nearness F = L^2 / (2 lambda r). Bilinear; within 0.3 % of the
/// axis' power at F below 5. Beyond the side lobes it was made for it is 0.
class ArrayTable {
 public:
  explicit ArrayTable(int side_lobes);

  /// Where a nearness lies in the table.
  struct Row {
    const float* values;  ///< of the row below; the next follows it
    float share;          ///< of the next
    float columns_per_x;
    float scale;  ///< from values() to powers
  };
  Row row(double nearness) const;
  /// Power over the row's scale.
  float value(const Row& row, float x) const {
    const float place = std::abs(x) * row.columns_per_x;
    if (!(place < last_column_)) return 0.0f;
    const auto column = static_cast<std::int32_t>(place);
    const float right = place - static_cast<float>(column);
    const float* a = row.values + column;
    const float* b = a + columns_;
    const float here = a[0] + right * (a[1] - a[0]);
    return here + row.share * (b[0] + right * (b[1] - b[0]) - here);
  }

  std::span<const float> values() const { return values_; }
  std::size_t columns() const { return columns_; }
  double reach() const { return reach_; }

 private:
  double reach_;  // x of the last column is nearness + reach
  std::size_t columns_;
  float last_column_;
  std::vector<float> values_;
};

/// A side's vertical pattern as a table over direction, without angles.
class VerticalTable {
 public:
  VerticalTable(const VerticalPattern& pattern, Side side);
  /// Of a direction's parts abeam (to the side) and down, of any length but 0.
  double power(double abeam, double down) const;
  std::span<const float> values() const { return values_; }

 private:
  std::vector<float> values_;
};

/// Where a side of the sonar listens from: it has moved and turned when an echo comes back.
struct ReceiverMotion {
  Eigen::Vector3d abeam = Eigen::Vector3d::Zero();  ///< to the side, at transmission
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  bool still = true;                                ///< it has not; the rest does not matter then
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  ///< its way a metre of the echo's range
  double drift_along = 0.0;                         ///< of that, along the array
  // What is added to the axes a metre of range.
  Eigen::Vector3d array_turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d abeam_turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d down_turn = Eigen::Vector3d::Zero();
};

/// The pose at t + 2 r / c for echoes from all ranges r up to one, the axes being interpolated.
ReceiverMotion reception(const Pose& pose, Side side, double range_m, double sound_speed_mps);

/// The two-way beam of a sonar at any range, near and far.
class Beam {
 public:
  Beam(const Sonar& sonar, double wavelength_m);

  /// Transmit times receive over the samples of a ray's plane, times its solid angle a radian of
  /// elevation.
  double two_way(Side side, std::span<const BeamSample> samples, double cos_elevation,
                 const Eigen::Vector3d& direction, double range_m,
                 const ReceiverMotion& reception) const;

  /// Of a line array.
  struct Array {
    float x_per_sine;
    double nearness_m;  ///< nearness times range
  };
  const Array& transmit() const { return transmit_; }
  const Array& receive() const { return receive_; }
  bool focused() const { return focused_; }
  bool alike() const { return alike_; }  ///< the two arrays
  const ArrayTable& array_table() const { return table_; }
  const VerticalTable& vertical_table(Side side) const {
    return vertical_[static_cast<std::size_t>(side)];
  }

 private:
  bool focused_, alike_;
  Array transmit_, receive_;
  ArrayTable table_;
  std::array<VerticalTable, 2> vertical_;
};

}  // namespace ensonify::engine
