#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/engine/sonar/reception/other_paths_options.h>
#include <ensonify/engine/sonar/reception/scatterers.h>
#include <ensonify/engine/sonar/vehicle/motion.h>
#include <ensonify/scatter/sediment.h>
#include <ensonify/scatter/surface_scatter.h>

namespace ensonify::engine {

/// When and from where a sonar hears.
struct PingContext {
  std::uint64_t ping = 0;
  double t_s = 0.0;
  ArrayFrame array;
  double altitude_m = 10.0;  ///< over the bed below

  double depth_m() const { return std::max(-array.origin.z(), 0.0); }
};

/// The plane abeam of an array, in which it hears, and how one side's pattern is turned in it.
/// Level planes, the surface and the bed, cut it in level lines.
struct BeamPlane {
  double upright = 1.0;                   ///< cosine of the pitch
  double cos_lean = 1.0, sin_lean = 0.0;  ///< of the pattern, turned down by the roll

  BeamPlane(const ArrayFrame& array, Side side);
  /// How far off in the plane a level is that lies so far above or below.
  double slant_m(double height_m) const { return height_m / std::max(upright, 1e-6); }
};

/// What a sonar makes of a scatterer: the sonar equation without the scatterer.
class EchoLaw {
 public:
  /// The scatterers must outlive it.
  EchoLaw(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
          const Scatterers& scatterers);

  std::size_t bins() const { return per_m2_.size(); }
  double bin_m() const { return bin_m_; }
  double range_m(std::size_t bin) const { return (static_cast<double>(bin) + 0.5) * bin_m_; }
  /// Intensity from a range of 1 m^2 (or of that target strength) on the beam's axis, uPa^2.
  double per_m2(std::size_t bin) const { return per_m2_[bin]; }
  double per_m2_at(double range_m) const;
  /// c tau_e / 2.
  double cell_m() const { return cell_m_; }
  double width_m(std::size_t bin) const { return scatterers_->width_m(bin); }
  /// Two-way power along the array, to the axis'.
  double pattern(std::size_t bin, double along_m) const {
    return scatterers_->pattern(bin, along_m);
  }
  double wavelength_m() const { return wavelength_m_; }
  double frequency_hz() const { return frequency_hz_; }
  /// One-way power of a side's vertical pattern, of a direction's parts abeam and down: the sonar's
  /// own.
  double vertical(Side side, double abeam, double down) const {
    return vertical_[static_cast<std::size_t>(side)].power(abeam, down);
  }
  /// The same of a direction's parts in the plane abeam: level to the side, and down from there.
  double vertical(Side side, const BeamPlane& plane, double level, double down) const {
    return vertical(side, level * plane.cos_lean + down * plane.sin_lean,
                    down * plane.cos_lean - level * plane.sin_lean);
  }
  /// Integral over depression of the two-way vertical pattern, and of the one-way.
  double vertical_width_rad(Side side, int power) const;

 private:
  double bin_m_, cell_m_, wavelength_m_, frequency_hz_;
  std::vector<double> per_m2_;
  std::array<VerticalTable, 2> vertical_;
  const Scatterers* scatterers_;
};

/// Noise that the receiver hears, uPa^2, the same at all ranges: the sea's
/// (scatter/ambient_noise.h) in the sweep's or pulse's band, less the directivity of the receiving
/// array, and its own.
double noise_power(const Sonar& sonar, const EchoLaw& law, const SeaState& sea, Side side);

/// The two-way vertical pattern's integral over parts of the plane abeam.
class VerticalSum {
 public:
  VerticalSum(const EchoLaw& law, Side side);
  /// From one depression to another, of the sonar's own frame; anywhere on the circle.
  double between(double from_rad, double to_rad) const { return up_to(to_rad) - up_to(from_rad); }

 private:
  double up_to(double depression_rad) const;
  std::vector<double> sums_;  // from 0 on
};

/// Incoherent arrivals beside the direct echo. The surface is a plane that heaves; the bed in
/// multiples and under the water's reverberation a level one at the altitude.
class OtherPaths {
 public:
  /// `bed` is what the bed is made of, if that is a sediment. The law must outlive it.
  OtherPaths(const OtherPathsOptions& options, const SeaState& sea, const EchoLaw& law,
             const std::optional<scatter::Sediment>& bed, std::uint64_t seed);

  /// Adds to the intensity in each bin; `direct` is the expected direct echo. `sums` is room to
  /// work in.
  void add(const PingContext& hearing, const EchoLine& line, std::span<const float> direct,
           std::span<float> power, std::vector<double>& sums) const;

 private:
  void add_surface(double depth_m, Side side, const BeamPlane& plane, std::span<float> power) const;
  void add_volume(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                  std::span<float> power) const;
  void add_multiples(double depth_m, double altitude_m, Side side, const BeamPlane& plane,
                     std::span<const float> direct, std::span<float> power,
                     std::vector<double>& sums) const;
  void add_double_bounce(const PingContext& hearing, const EchoLine& line,
                         std::span<const float> direct, std::span<float> power) const;

  OtherPathsOptions options_;
  const EchoLaw& law_;
  scatter::SeaSurface surface_;
  Oscillator waves_;
  std::vector<double> surface_strength_;  // over the sine of the grazing angle
  std::vector<double> bed_reflection_;    // of energy, over the same
  std::vector<double> volume_;            // of a bin, a radian of the vertical beam
  std::array<VerticalSum, 2> vertical_sums_;
  double wall_share_;
};

}  // namespace ensonify::engine
