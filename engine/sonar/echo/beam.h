#pragma once

#include <cmath>
#include <complex>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/beam_tables.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// LineArray::power as a table over the angle x = L sin(psi) / lambda and the nearness |F|, with
/// linear interpolation. All arrays with one shading have the same table. For F below 5 the error
/// is within 0.3 % of the power on the axis. The power is 0 beyond the side lobes for which the
/// table was made.
class ArrayTable {
 public:
  /// lobes_beyond: Sonar::lobes_beyond().
  explicit ArrayTable(int side_lobes, const Shading& shading = {}, int lobes_beyond = 1);

  /// Two rows of the table, between which a nearness lies.
  struct Row {
    const float* values;  ///< values() from the lower row on
    float share;          ///< weight of the upper row
    float columns_per_x;
    float scale;  ///< power divided by value()
  };
  Row row(double nearness) const;
  /// The power at x, divided by the row's scale.
  float value(const Row& row, float x) const {
    const float place = std::abs(x) * row.columns_per_x;
    if (!(place < last_column_)) return 0.0f;
    const auto column = static_cast<std::int32_t>(place);
    const float right = place - static_cast<float>(column);
    const float* at = row.values + 2 * column;
    const float lower = at[0] + right * (at[2] - at[0]), upper = at[1] + right * (at[3] - at[1]);
    return lower + row.share * (upper - lower);
  }

  /// Row by row except the last. A column has two values: of the row, and of the next row.
  std::span<const float> values() const { return values_; }
  std::size_t columns() const { return columns_; }
  double reach() const { return reach_; }

 private:
  double reach_;  // the last column is at x = nearness + reach
  std::size_t columns_;
  float last_column_;
  std::vector<float> values_;
};

/// The vertical pattern of a sector as a table over direction, whose lookup takes no arc tangent.
class VerticalTable {
 public:
  /// The tables of all sectors of a sonar.
  static std::vector<VerticalTable> of(const Sonar& sonar);
  VerticalTable(const VerticalPattern& pattern, const Sector& sector);
  /// One-way power in the direction with these components abeam (into the sector) and down. The
  /// vector may have any length except 0.
  double power(double abeam, double down) const;
  std::span<const float> values() const { return values_; }

 private:
  std::vector<float> values_;
};

/// How far the receiver of a sector has moved and turned between transmission and the return of an
/// echo. All vectors are in world axes.
struct ReceiverMotion {
  Eigen::Vector3d abeam = Eigen::Vector3d::Zero();  ///< into the sector, at transmission
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  bool steady = true;  ///< it neither moves nor turns: all values below are 0
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  ///< metres per metre of the echo's range
  double drift_along = 0.0;                         ///< the part of drift along the array
  // The change of the array's axis and of the axes above, per metre of range.
  Eigen::Vector3d array_turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d abeam_turn = Eigen::Vector3d::Zero();
  Eigen::Vector3d down_turn = Eigen::Vector3d::Zero();
};

/// The motion of a sector's receiver from its pose at t to its pose at t + 2 r / c, for echoes from
/// all ranges r up to range_m. The axes are interpolated linearly over r.
ReceiverMotion receiver_motion(const Pose& pose, const Sector& sector, double range_m,
                               double sound_speed_mps);

class Beam;

/// The two-way field of a sonar's arrays at about one range, without the vertical patterns, over
/// the sine of the angle from the arrays' broadside plane. Beam::two_way() has a table of the
/// square of its magnitude. Its phase is relative to the spherical wave from the array's middle.
class ArrayField {
 public:
  std::complex<double> at(double sine) const;
  double low, high;  ///< beyond these sines it counts as 0

 private:
  friend class Beam;
  const Beam* beam_;
  double sent_nearness_, heard_nearness_, sent_shift_, heard_shift_;
};

/// The two-way beam of a sonar, in the near field and the far field.
class Beam {
 public:
  /// beam_offset_m: how far the beam lies ahead of the array's middle, along the array.
  Beam(const Sonar& sonar, double wavelength_m, double beam_offset_m = 0.0);
  /// The transmitter with a receiver that has no width: what each element of a sonar whose beams
  /// are steered receives.
  static Beam of_element(const Sonar& sonar, double wavelength_m);

  /// Transmit power times receive power, integrated over the samples of a ray's plane, times the
  /// cosine of elevation: the weight of the ray per radian of elevation. direction: unit vector of
  /// the ray in world axes. sector: index in Sonar::sectors().
  double two_way(std::size_t sector, std::span<const BeamSample> samples, double cos_elevation,
                 const Eigen::Vector3d& direction, double range_m,
                 const ReceiverMotion& motion) const;
  /// The vertical patterns in two_way(): one-way powers at transmission and at reception.
  struct VerticalPowers {
    double sent, heard;
  };
  VerticalPowers vertical_powers(std::size_t sector, const Eigen::Vector3d& direction,
                                 double range_m, const ReceiverMotion& motion) const;
  /// The arrays' field near this range, which two_way() has as power.
  ArrayField field_near(const Eigen::Vector3d& direction, double range_m,
                        const ReceiverMotion& motion) const;

  /// A line array, and how it uses its table: x_per_sine is x divided by sin(psi); nearness_m is
  /// the nearness times the range, if the array is not focused (0: focused at all ranges).
  struct Array {
    float x_per_sine;
    double nearness_m;
    bool in_zones;   ///< whether it is focused in the zones of zones_per_m()
    float offset_m;  ///< how far it lies behind the beam, along the array
    Shading shading;
  };
  const Array& transmit() const { return transmit_; }
  const Array& receive() const { return receive_; }
  bool focused() const { return focused_; }
  /// 1 / range of each zone in which arrays are focused.
  std::span<const float> zones_per_m() const { return zones_per_m_; }
  bool same_arrays() const { return same_arrays_; }
  const ArrayTable& transmit_table() const { return *transmit_table_; }
  const ArrayTable& receive_table() const { return *receive_table_; }
  const VerticalTable& vertical_table(std::size_t sector) const { return vertical_[sector]; }

 private:
  Beam(const Sonar& sonar, const LineArray& transmit, const LineArray& receive,
       double beam_offset_m);
  double nearness_at(const Array& array, double range_m) const;
  double heard_shift(const Eigen::Vector3d& direction, double range_m,
                     const ReceiverMotion& motion) const;

  bool focused_, same_arrays_;
  std::vector<float> zones_per_m_;
  Array transmit_, receive_;
  std::shared_ptr<const ArrayTable> transmit_table_, receive_table_;
  std::vector<VerticalTable> vertical_;  // by sector
};

}  // namespace ensonify::engine
