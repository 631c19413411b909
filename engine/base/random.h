#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ensonify::engine {

/// What a stream of random numbers is for. Streams of different purposes are independent. Results
/// have the same bytes only while these numbers stay: never change or reuse one.
enum class Purpose : std::uint64_t {
  fractal_relief = 1,
  ripple_relief = 2,
  speckle = 3,
  test = 4,
  agreement = 5,
  noise = 6,
  artefact = 7,
  motion = 10,
  navigation = 11,
  object_place = 20,
  object_shape = 21,
  object_scour = 22,
  object_burial = 23,
  roughness_layer = 30,
  crest_layer = 31,
  furrow_layer = 32,
  pit_layer = 33,
  outcrop_layer = 34,
  boulder_layer = 35,
  seabed_patch = 36,
  survey_detail = 37,
  survey_scatter = 38,
  ground_texture = 40,
  bed_sample = 41,
  water_scatterers = 42,
  recipe = 60,
  dataset_split = 61,
  background_chip = 62,
  imitated_tones = 63,
  ping_gain = 64,
};

/// Random numbers that depend only on the seed, the purpose, what they belong to, and their index.
/// There is no state, so that threads, order and shards cannot change them. The generator is
/// Philox4x64-10 (Salmon and others, SC11).
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, Purpose purpose, std::array<std::uint64_t, 3> belongs_to = {})
      : seed_(seed), purpose_(purpose), belongs_to_(belongs_to) {}

  /// Numbers first, first+1, … of the stream, uniform in (0, 1].
  void uniform(std::span<double> out, std::uint64_t first = 0) const;
  /// Numbers first, first+1, …, with a standard normal distribution (Box-Muller).
  void normal(std::span<double> out, std::uint64_t first = 0) const;
  /// Numbers first, first+1, …, exponentially distributed with mean 1, as the intensity of fully
  /// developed speckle is.
  void exponential(std::span<double> out, std::uint64_t first = 0) const;

 private:
  std::uint64_t seed_;
  Purpose purpose_;
  std::array<std::uint64_t, 3> belongs_to_;
};

/// A number with a Poisson distribution of this mean, limited to `most`. It is derived from a
/// number that is uniform in (0, 1].
std::size_t poisson_count(double mean, double uniform, std::size_t most);

}  // namespace ensonify::engine
