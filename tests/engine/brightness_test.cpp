// The brightness of a picture of samples follows the scene's bed, for every automatic gain of the
// recorder.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/reception/recorder.h>

using namespace ensonify::engine;

namespace {

struct Brightness {
  double white = 0.0;   ///< share of pixels
  double middle = 0.0;  ///< the median of the bed's pixels
};

Brightness brightness_of(const std::string& scene_text, const std::vector<std::string>& overrides) {
  const Scene scene = parse_scene(scene_text, "scene.toml", overrides);
  Simulator simulator(scene, {});
  const Waterfall image = ping_all(scene, simulator, 1).images.front();
  const Picture picture = render(image, scene.display, simulator.calibration(0));
  std::vector<double> bed;
  Brightness made;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    made.white += picture.pixels[i] == 255;
    const std::size_t row = picture.height - 1 - i / picture.width;
    if (image.pixels.region[row * picture.width + i % picture.width] ==
        static_cast<std::uint32_t>(Region::seabed))
      bed.push_back(picture.pixels[i]);
  }
  made.white /= static_cast<double>(picture.pixels.size());
  std::ranges::nth_element(bed, bed.begin() + std::ssize(bed) / 2);
  made.middle = bed.at(bed.size() / 2);
  return made;
}

/// Ground without texture: few pings see only a part of its slow change.
std::string untextured_scene(const std::string& bed, const std::string& sonar) {
  return "version = 1\ntexture = false\n[seafloor]\nextent_east_m = 120\nextent_north_m = 30\ncell_m = 0.4\n" +
         bed + "[track]\npings = 24\n[sonar.s]\nrange_m = 50\nbins = 400\nelevations = 600\n" +
         sonar;
}

}  // namespace

TEST_CASE("a recorder of the largest of several looks has a picture as bright as one of one look") {
  const std::string scene = untextured_scene("", "detector = \"peak\"\n");
  for (const char* value : {"0", "0.1"}) {
    CAPTURE(value);
    const std::string ping_mean = "sonar.s.ping_mean=" + std::string(value);
    const Brightness one = brightness_of(scene, {ping_mean});
    const Brightness largest = brightness_of(scene, {ping_mean, "sonar.s.looks=3"});
    // The bed's level differs over range, which moves the two medians differently. Without the
    // median of the largest look it would be 1.22 times as bright.
    CHECK(largest.middle == Approx(one.middle).epsilon(0.08));
  }
}

TEST_CASE(
    "a picture of samples is as bright as one of intensities, however many looks are combined") {
  for (const char* detector : {"mean", "peak"})
    for (const int looks : {1, 2, 4, 16}) {
      const std::string scene = untextured_scene(
          "fractal.height_at_1m_m = 0\n",
          "detector = \"" + std::string(detector) + "\"\nlooks = " + std::to_string(looks) + "\n");
      CAPTURE(detector, looks);
      CHECK(brightness_of(scene, {"display.of=sample"}).middle ==
            Approx(brightness_of(scene, {"display.of=intensity"}).middle).epsilon(0.03));
    }
}

TEST_CASE("a recorder that scales each ping leaves a picture's brightness as it is") {
  for (const std::string& scene :
       {untextured_scene("", ""),
        untextured_scene("depth_m = 40\nmaterial = \"sandy mud\"\n", "looks = 4\n"),
        untextured_scene("material = \"rock\"\n", "curve = \"square-root\"\nbits = 8\n"),
        untextured_scene("", "sides = \"starboard\"\noutput_noise_db = -60\n")}) {
    const Brightness plain = brightness_of(scene, {});
    for (const char* mean : {"0.02", "0.08", "0.2"}) {
      CAPTURE(scene, mean, plain.white, plain.middle);
      const Brightness scaled = brightness_of(scene, {"sonar.s.ping_mean=" + std::string(mean)});
      CHECK(scaled.white < plain.white + 0.01);
      // The scale hides by how much the bed's level differs from the nominal one, here 1 dB or so.
      CHECK(scaled.middle == Approx(plain.middle).epsilon(0.17));
    }
  }
}

TEST_CASE("the bed at half the range is 16 dB below full scale at any speed") {
  for (const char* array :
       {"", "array_length_m = 1.2\nfocused = true\n", "receive_array_length_m = 0.9\n"})
    for (const double speed_mps : {0.0, 1.0, 3.0}) {
      CAPTURE(array, speed_mps);
      const std::vector<std::string> overrides{"speckle=false", "sonar.s.noise=false",
                                               "seafloor.fractal.height_at_1m_m=0", "track.pings=1",
                                               "track.speed_mps=" + std::to_string(speed_mps)};
      const Scene scene = parse_scene(untextured_scene("", array), "scene.toml", overrides);
      Simulator simulator(scene, {});
      const Waterfall image = ping_all(scene, simulator, 1).images.front();
      const double sample = double(image.pixels.sample[400 + 200]) / 32767.0;
      CHECK(20.0 * std::log10(sample) == Approx(-16.0).margin(0.3));
    }
}

TEST_CASE("noise that exceeds the bed keeps its grain, in the samples and in the picture") {
  const Scene scene = parse_scene(R"(version = 1
texture = false  # a bright point of the ground may clip
[seafloor]
extent_east_m = 640
extent_north_m = 30
cell_m = 1
depth_m = 60
[track]
pings = 6
altitude_m = 50
[sonar.s]
frequency_hz = 600e3
bandwidth_hz = 20e3
range_m = 300
bins = 1000
elevations = 600
)",
                                  "scene.toml");
  Simulator simulator(scene, {});
  const Calibration calibration = simulator.calibration(0);
  const Recorder& recorder = *calibration.recorder;
  const Waterfall image = ping_all(scene, simulator, 1).images.front();
  const Picture picture = render(image, scene.display, calibration);
  double sum = 0.0, squares = 0.0, count = 0.0;  // of the recorded amplitudes of the farthest bins
  double light = 0.0, its_squares = 0.0;
  for (std::size_t row = 0; row < image.rows(); ++row)
    for (std::size_t bin = 0; bin < 1000; ++bin) {
      const std::size_t i = row * image.columns() + 1000 + bin;
      const double amplitude = recorder.amplitude(image.pixels.sample[i]);
      REQUIRE(amplitude < 1.0);
      // What is received can be computed back from the sample and the gain.
      if (bin > 200)
        REQUIRE(amplitude ==
                Approx(std::sqrt(double(image.pixels.intensity[i])) * double(recorder.gain(bin)))
                    .epsilon(1e-3)
                    .margin(1.0 / 32767));
      if (bin < 800) continue;
      const double pixel = picture.pixels[(image.rows() - 1 - row) * image.columns() + 1000 + bin];
      sum += amplitude;
      squares += amplitude * amplitude;
      light += pixel;
      its_squares += pixel * pixel;
      count += 1.0;
    }
  // Rayleigh amplitudes, as loud as the bed at half the range.
  const double mean = sum / count, bright = light / count;
  CHECK(std::sqrt(squares / count / (mean * mean) - 1.0) ==
        Approx(std::sqrt(4.0 / std::numbers::pi - 1.0)).epsilon(0.1));
  CHECK(10.0 * std::log10(squares / count) == Approx(-16.0).margin(0.5));
  // Power 0.9 of a Rayleigh amplitude at the brightness of the bed, 0.35 to that power.
  CHECK(bright == Approx(255.0 * 0.39).epsilon(0.2));
  CHECK(std::sqrt(its_squares / count - bright * bright) > 0.25 * bright);
  REQUIRE(simulator.warnings().size() == 1);
  CHECK_THAT(simulator.warnings()[0], Catch::Contains("sonar s: beyond 1") &&
                                          Catch::Contains("noise") &&
                                          Catch::Contains("sonar.s.range_m"));
}

TEST_CASE("the brightness follows the shares that materials have of the bed") {
  const std::string patch = "[[seafloor.patches]]\nmaterial = \"gravel\"\npolygon_m = ";
  const std::string sand = "material = \"silty sand\"\n";
  const Brightness gravel = brightness_of(untextured_scene("material = \"gravel\"\n", ""), {});
  const Brightness covered = brightness_of(
      untextured_scene(sand + patch + "[[-70, -20], [70, -20], [70, 20], [-70, 20]]\n", ""), {});
  CHECK(covered.middle == gravel.middle);
  CHECK(covered.white == gravel.white);
  // Half the bed has gravel, which is 15 dB stronger here: the median lies between the two.
  const Brightness half = brightness_of(
      untextured_scene(sand + patch + "[[0, -20], [70, -20], [70, 20], [0, 20]]\n", ""), {});
  CHECK(half.middle == Approx(gravel.middle).epsilon(0.15));
}
