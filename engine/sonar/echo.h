#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <ensonify/engine/sonar/artefacts.h>
#include <ensonify/engine/sonar/sonar.h>

namespace ensonify::engine {

/// What a bin is. The numbers are in the files.
enum class Region : std::uint32_t {
  no_data = 0,
  water_column = 1,
  seabed = 2,
  object = 3,
  shadow = 4
};

/// What is known of each range bin, one value a bin: of one side of one ping in an EchoLine, of all
/// pings in a Waterfall. Names, units and meanings are those of the files.
struct Layers {
  std::vector<float> intensity;  ///< as received: mean squared pressure, uPa^2, before any gain
  std::vector<std::uint32_t> sample;  ///< the recorder's output: Recorder::sample
  std::vector<float> intensity_mean;  ///< the expectation of the echo alone
  std::vector<float> range_m;         ///< slant range of the bin's centre
  std::vector<float> x_m, y_m, z_m;   ///< energy-weighted place of what the bin saw, local metres
  std::vector<float> grazing_rad;     ///< energy-weighted
  std::vector<std::uint32_t> region;  ///< a Region
  std::vector<std::uint32_t> sediment, class_id, instance;  ///< those with the most energy
  std::vector<float> fraction;                              ///< that triple's share of the energy
  std::vector<float> shadow_fraction;  ///< beam-weighted share of the planes that jump over the bin
  std::vector<std::uint32_t>
      shadow_instance;                 ///< what blocks it; 0: the bed, and none of its features
  std::vector<std::uint32_t> layover;  ///< 1 where one plane sees several places in the bin

  /// Calls f(name in files, pointer to member) for every layer, in the files' order.
  template <class F>
  static void for_each(F&& f) {
    f("intensity", &Layers::intensity);
    f("sample", &Layers::sample);
    f("intensity_mean", &Layers::intensity_mean);
    f("range_m", &Layers::range_m);
    f("x_m", &Layers::x_m);
    f("y_m", &Layers::y_m);
    f("z_m", &Layers::z_m);
    f("grazing_rad", &Layers::grazing_rad);
    f("region", &Layers::region);
    f("sediment", &Layers::sediment);
    f("class", &Layers::class_id);
    f("instance", &Layers::instance);
    f("fraction", &Layers::fraction);
    f("shadow_fraction", &Layers::shadow_fraction);
    f("shadow_instance", &Layers::shadow_instance);
    f("layover", &Layers::layover);
  }
  /// Every layer to that many bins, all zero.
  void assign(std::size_t bins) {
    for_each([&](std::string_view, auto layer) { (this->*layer).assign(bins, 0); });
  }
};

/// The echo of one side of one ping: bins from near to far, and what was counted on the way.
struct EchoLine {
  Side side = Side::port;
  Layers bins;
  int first_return = -1;  ///< the first bin with an echo; -1: none
  int starved = 0;        ///< bins behind it that nothing could reach
  Artefacts artefacts;    ///< what spoiled it
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;
};

}  // namespace ensonify::engine
