#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// What spoils a ping. The numbers are bits.
enum class Artefact : std::uint32_t {
  lost = 1,              ///< nothing was recorded
  repeated = 2,          ///< the ping before was recorded again
  stale_navigation = 4,  ///< the pose reported is an old one
  interference = 8,      ///< another sonar was received
  gain_step = 16,        ///< the gain differs from the gain at the run's start
  automatic_gain = 32,
  fish = 64,
  wake = 128,
  shimmer = 256,
  transmit_leakage = 512,
  crosstalk = 1024,
};

/// The definition of an artefact. All are in the table of kind_of().
struct ArtefactKind {
  std::string_view name;  ///< in files
  /// The first number of the key of its random stream, different for each artefact; unset: no
  /// stream.
  std::optional<std::uint64_t> stream = {};
};
constexpr ArtefactKind kind_of(Artefact artefact) {
  switch (artefact) {
    case Artefact::lost: return {"lost", 0};
    case Artefact::repeated: return {"repeated", 1};
    case Artefact::stale_navigation: return {"stale_navigation", 2};
    case Artefact::interference: return {"interference"};  // uses the shimmer's fourth number
    case Artefact::gain_step: return {"gain_step", 5};
    case Artefact::automatic_gain: return {"automatic_gain"};
    case Artefact::fish: return {"fish", 3};
    case Artefact::wake: return {"wake"};
    case Artefact::shimmer: return {"shimmer", 4};
    case Artefact::transmit_leakage: return {"transmit_burst"};
    case Artefact::crosstalk: return {"crosstalk"};
  }
  return {};
}
/// The random stream of an artefact that has one. (a, b): what the numbers belong to, such as a
/// ping.
RandomStream artefact_stream(std::uint64_t seed, Artefact artefact, std::uint64_t a = 0,
                             std::uint64_t b = 0);

struct Artefacts {
  std::uint32_t bits = 0;

  void add(Artefact artefact) { bits |= static_cast<std::uint32_t>(artefact); }
  void add(Artefacts others) { bits |= others.bits; }
  bool has(Artefact artefact) const { return (bits & static_cast<std::uint32_t>(artefact)) != 0; }
  /// Their names, joined by '+'.
  std::string text() const;
};

/// What a bin is. The numbers are in the files.
enum class Region : std::uint32_t {
  no_data = 0,
  water_column = 1,
  seabed = 2,
  object = 3,
  shadow = 4
};
/// Names for users, in the order of the numbers.
inline constexpr std::array<std::string_view, 5> region_names{"no data", "water column", "seabed",
                                                              "object", "shadow"};
constexpr std::string_view name_of(Region region) {
  return region_names[static_cast<std::size_t>(region)];
}

/// The layers of range bins, one value per bin. An EchoLine has the bins of one line of one ping, a
/// Waterfall those of all pings. The layers in files have the same names, units and meanings.
struct BinLayers {
  std::vector<float> intensity;  ///< as received: mean squared pressure, uPa^2, before any gain
  std::vector<std::uint32_t> sample;  ///< the recorder's output: Recorder::sample
  /// The expected value of the echo alone: its mean over speckle and over texture of the ground
  /// that is finer than a cell.
  std::vector<float> intensity_mean;
  std::vector<float> range_m;         ///< slant range of the bin's centre
  std::vector<float> x_m, y_m, z_m;   ///< energy-weighted place of the echo, local metres
  std::vector<float> grazing_rad;     ///< energy-weighted
  std::vector<std::uint32_t> region;  ///< a Region
  /// The three with the most energy together.
  std::vector<std::uint32_t> sediment, class_id, instance;
  std::vector<float> fraction;  ///< their share of the energy
  /// Beam-weighted share of the planes in which the bin is in shadow.
  std::vector<float> shadow_fraction;
  std::vector<std::uint32_t>
      shadow_instance;                 ///< what casts the shadow; 0: the bed outside its features
  std::vector<std::uint32_t> layover;  ///< 1 where one plane sees several places in the bin

  /// Calls f(name in files, pointer to member) for every layer, in the files' order.
  template <class F>
  static void for_each(F&& f) {
    f("intensity", &BinLayers::intensity);
    f("sample", &BinLayers::sample);
    f("intensity_mean", &BinLayers::intensity_mean);
    f("range_m", &BinLayers::range_m);
    f("x_m", &BinLayers::x_m);
    f("y_m", &BinLayers::y_m);
    f("z_m", &BinLayers::z_m);
    f("grazing_rad", &BinLayers::grazing_rad);
    f("region", &BinLayers::region);
    f("sediment", &BinLayers::sediment);
    f("class", &BinLayers::class_id);
    f("instance", &BinLayers::instance);
    f("fraction", &BinLayers::fraction);
    f("shadow_fraction", &BinLayers::shadow_fraction);
    f("shadow_instance", &BinLayers::shadow_instance);
    f("layover", &BinLayers::layover);
  }
  /// Gives every layer that many bins, all zero.
  void assign(std::size_t bins) {
    for_each([&](std::string_view, auto layer) { (this->*layer).assign(bins, 0); });
  }
};

/// A plane part of an object's surface that mirrors the bed in front of it.
struct WallFacet {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();    ///< from the sonar
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitX();  ///< unit, out of the object
  double length_m = 0.0, height_m = 0.0;  ///< in its horizontal direction, and across that
  /// Share of the arriving energy that is reflected, times the share of the facet that the sonar
  /// sees.
  double reflected = 0.0;
  double slope = 0.0;  ///< rms inclination of the rough surface, in one direction, as a tangent
};

/// The echo of one beam of one sector of one ping: bins from near to far, and counts.
struct EchoLine {
  std::size_t sector = 0;  ///< index in Sonar::sectors()
  int beam = 0;            ///< from the rear, see Sonar::beams
  BinLayers bins;
  int first_return = -1;  ///< the first bin with an echo; -1: none
  int starved = 0;        ///< bins behind the bed's first return that nothing could reach
  Artefacts artefacts;    ///< of this line
  /// Factor of the amplitude: the recorder's gain in this ping, divided by its usual gain.
  float gain = 1.0f;
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;
  /// The steady part of the echo: the field of the objects' glints per bin (SteadyField). Its
  /// square is part of intensity_mean. Empty: there are no glints.
  std::vector<float> glint_re, glint_im;
  std::vector<WallFacet> walls;  ///< empty unless they are looked for, see MaterialInSonar
};

}  // namespace ensonify::engine
