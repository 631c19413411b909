// A scene that imitates a real recording: set up on its first half, compared with its second. The pictures
// and the table go to build/imitation.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/paths.h"

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/ping_all.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/refine/atomic_file.h>

using namespace ensonify;
using namespace ensonify::engine;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t pings = 460, half = 230, bins = 1024;
constexpr double full_scale = 32767.0;
constexpr double range_m = 29.9835, bin_m = range_m / bins;
constexpr double degree = std::numbers::pi / 180.0;

/// Samples of both sides, near to far, and where the bed begins.
struct Recording {
  std::array<std::vector<float>, 2> samples{std::vector<float>(pings * bins),
                                            std::vector<float>(pings* bins)};
  std::array<std::vector<std::size_t>, 2> first{std::vector<std::size_t>(pings),
                                                std::vector<std::size_t>(pings)};
  float at(int side, std::size_t ping, std::size_t bin) const {
    return samples[static_cast<std::size_t>(side)][ping * bins + bin];
  }
  void find_first_returns() {
    for (int side : {0, 1})
      for (std::size_t ping = 0; ping < pings; ++ping) {
        std::size_t bin = 40;
        const auto level = [&] {
          float sum = 0.0f;
          for (std::size_t i = bin - 2; i <= bin + 2; ++i) sum += at(side, ping, i);
          return sum / 5.0f;
        };
        while (bin < bins - 3 && level() < 1200.0f) ++bin;
        first[static_cast<std::size_t>(side)][ping] = bin;
      }
  }
  std::size_t first_of(int side, std::size_t ping) const {
    return first[static_cast<std::size_t>(side)][ping];
  }
};

template <class T>
T read_at(const std::string& bytes, std::size_t place) {
  T value;
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

/// XTF: packets of two channels of 1024 shorts, port far to near; the first has no navigation.
Recording read_recording(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  Recording recording;
  std::size_t packet = 0;
  for (std::size_t place = 1024; place + 14 < bytes.size();) {
    if (bytes[place + 2] == 0 && packet++ > 0 && packet - 2 < pings)
      for (std::size_t side : {0, 1})
        for (std::size_t i = 0; i < bins; ++i) {
          const std::size_t from = place + 256 + (side + 1) * 64 + side * 2 * bins + 2 * i;
          recording.samples[side][(packet - 2) * bins + (side == 0 ? bins - 1 - i : i)] =
              read_at<std::uint16_t>(bytes, from);
        }
    place += read_at<std::uint32_t>(bytes, place + 10);
  }
  recording.find_first_returns();
  return recording;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Mean square over full scale, in dB, by whole degrees of depression; NaN where there is none.
std::vector<double> level_over_depression(const Recording& image, int side, std::size_t from,
                                          std::size_t until) {
  std::vector<double> sums(91), counts(91);
  for (std::size_t ping = from; ping < until; ++ping)
    for (std::size_t bin = image.first_of(side, ping) + 1; bin < bins; ++bin) {
      const double sine =
          static_cast<double>(image.first_of(side, ping)) / static_cast<double>(bin);
      const auto cell = static_cast<std::size_t>(std::lround(std::asin(sine) / degree));
      sums[cell] += std::pow(image.at(side, ping, bin) / full_scale, 2);
      counts[cell] += 1.0;
    }
  for (std::size_t i = 0; i < sums.size(); ++i)
    sums[i] = counts[i] > 200.0 ? 10.0 * std::log10(sums[i] / counts[i]) : std::nan("");
  return sums;
}

/// Medians over blocks of 8 pings x 16 bins of port's bed (starboard has the wreck), between two ranges: contrast,
/// and the correlations of neighbours in range and along the track.
struct Texture {
  double contrast, in_range, along_track;
};
Texture texture(const Recording& image, std::size_t from, std::size_t until, double near_m,
                double far_m) {
  std::vector<double> contrasts, ranges, tracks;
  for (std::size_t ping = from; ping + 8 <= until; ping += 8)
    for (auto bin = static_cast<std::size_t>(near_m / bin_m); (bin + 16.0) * bin_m < far_m;
         bin += 16) {
      if (bin < image.first_of(0, ping) * 5 / 4) continue;
      double sum = 0.0, squares = 0.0, range = 0.0, track = 0.0;
      for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t j = 0; j < 16; ++j) {
          const double s = image.at(0, ping + i, bin + j);
          sum += s;
          squares += s * s;
        }
      const double mean = sum / 128.0, variance = squares / 128.0 - mean * mean;
      if (!(variance > 0.0)) continue;
      for (std::size_t i = 0; i < 7; ++i)
        for (std::size_t j = 0; j < 15; ++j) {
          const double here = image.at(0, ping + i, bin + j) - mean;
          range += here * (image.at(0, ping + i, bin + j + 1) - mean);
          track += here * (image.at(0, ping + i + 1, bin + j) - mean);
        }
      contrasts.push_back(std::sqrt(variance) / mean);
      ranges.push_back(range / 105.0 / variance);
      tracks.push_back(track / 105.0 / variance);
    }
  return {median(contrasts), median(ranges), median(tracks)};
}

/// Median of the water column, behind the burst.
double floor_of(const Recording& image, std::size_t from, std::size_t until) {
  std::vector<double> values;
  for (std::size_t ping = from; ping < until; ++ping)
    for (int side : {0, 1})
      for (std::size_t bin = 40; bin + 40 < image.first_of(side, ping); bin += 3)
        values.push_back(image.at(side, ping, bin));
  return median(values);
}

double clipped(const Recording& image, std::size_t from, std::size_t until) {
  double count = 0.0;
  for (std::size_t ping = from; ping < until; ++ping)
    for (int side : {0, 1})
      for (std::size_t bin = 20; bin < bins; ++bin)
        count += image.at(side, ping, bin) >= full_scale;
  return count / (2.0 * static_cast<double>((until - from) * (bins - 20)));
}

/// What the recording's own navigation says.
struct Navigation {
  std::vector<double> depth_m, pitch_rad;
};
Navigation read_navigation(const fs::path& file) {
  std::ifstream stream(file);
  Navigation navigation;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || !std::isdigit(static_cast<unsigned char>(line.front()))) continue;
    std::vector<double> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(std::stod(cell));
    navigation.depth_m.push_back(cells.at(5));
    navigation.pitch_rad.push_back(cells.at(7) * degree);
  }
  return navigation;
}

struct Wreck {
  double east_m, north_m, heading_deg;
};

std::string scene_text(double bed_m, bool fitted, double gain_db, double noise_db, int looks,
                       const Wreck& wreck) {
  std::string text =
      fmt::format(R"(version = 1
seed = 11
speckle = {}
[sea]
sound_speed_mps = 1500
wind_mps = 4
[seafloor]
kind = "fractal"
extent_east_m = 100
extent_north_m = 110
cell_m = 0.1
depth_m = {}
material = "medium sand"
[seafloor.fractal]
height_at_1m_m = {}
hurst = 0.7
longest_m = 10
[track]
kind = "file"
file = "data:nav/scotsman_iver2_nav.csv"
smooth_s = 3
[sonar.port-starboard]
frequency_hz = 600e3
source_level_db = 210
array_length_m = 0.32
bandwidth_hz = 30e3
range_m = {}
bins = 1024
planes = 4
elevations = 1400
tvg_spreading = 30
gain_db = {}
looks = {}
noise = {}
)",
                  fitted, bed_m, fitted ? 0.015 : 0.0, range_m, gain_db, looks, fitted);
  if (!fitted) return text + "vertical_beamwidth_deg = 0\n";
  text += fmt::format(R"(vertical_pattern = "pattern.csv"
output_noise_db = {}
[arrivals]
surface = true
double_bounce = true
burst_m = 0.23
[[seafloor.crests]]
wavelength_m = 0.5
height_m = 0.03
across_crests_deg = 60
[[seafloor.boulders]]
per_hectare = 100
[[objects]]
mesh = "data:mesh_underwater/skytteren_wreck.ply"
class = "wreck"
scale = 0.15
heading_deg = {}
east_m = {}
north_m = {}
height_m = -0.5
)",
                      noise_db, wreck.heading_deg, wreck.east_m, wreck.north_m);
  return text;
}

Recording imitation(const Scene& scene, std::vector<Pose>& poses) {
  Simulator simulator(scene);
  poses = simulator.track();
  const ScenePings all = ping_all(scene, simulator, 0);
  const Waterfall& image = all.images.front();
  Recording recording;
  for (std::size_t ping = 0; ping < std::min(pings, image.rows()); ++ping)
    for (std::size_t bin = 0; bin < bins; ++bin) {
      // Without fading samples would clip: the expectation, and the gain of 1 at 1 m.
      const auto value = [&](std::size_t column) {
        const std::size_t pixel = ping * 2 * bins + column;
        return scene.speckle ? static_cast<float>(image.pixels.sample[pixel])
                             : static_cast<float>(full_scale) * simulator.recorder(0).gain(bin) *
                                   std::sqrt(image.pixels.intensity_mean[pixel]);
      };
      recording.samples[0][ping * bins + bin] = value(bins - 1 - bin);
      recording.samples[1][ping * bins + bin] = value(bins + bin);
    }
  recording.find_first_returns();
  return recording;
}

/// Real left, ours right, each with port left and the newest ping on top, every second bin.
void write_pictures(const fs::path& folder, const Recording& real, const Recording& ours) {
  constexpr std::size_t gap = 12, width = 2 * bins + gap;
  Picture picture{width, pings, 1, std::vector<std::uint8_t>(width * pings, 255)};
  for (std::size_t row = 0; row < pings; ++row)
    for (std::size_t column = 0; column < bins; ++column) {
      const int side = column >= bins / 2;
      const std::size_t bin = side ? 2 * column - bins : bins - 2 - 2 * column;
      for (const auto& [image, left] : {std::pair{&real, std::size_t{0}}, {&ours, bins + gap}}) {
        const double s = std::max(image->at(side, pings - 1 - row, bin),
                                  image->at(side, pings - 1 - row, bin + 1)) /
                         full_scale;
        picture.pixels[row * width + left + column] =
            static_cast<std::uint8_t>(std::lround(255.0 * std::pow(std::min(s, 1.0), 0.6)));
      }
    }
  refine::write_file(folder / "side_by_side.png", encode_png(picture));
}

}  // namespace

TEST_CASE("a scene set up on the first half of a real recording resembles the second",
          "[.][soak]") {
  const auto file = tests::data_file("sidescan/scotsman-iver2.xtf");
  const auto navigation_file = tests::data_file("nav/scotsman_iver2_nav.csv");
  if (!file || !navigation_file || !tests::data_file("mesh_underwater/skytteren_wreck.ply")) {
    WARN("skipped: the real recording is not there");
    return;
  }
  const fs::path folder = tests::program_file().parent_path().parent_path() / "imitation";
  fs::create_directories(folder);
  const ScenePaths paths{folder, file->parent_path().parent_path()};
  const Recording real = read_recording(*file);
  const Navigation navigation = read_navigation(*navigation_file);
  REQUIRE(navigation.depth_m.size() == pings);

  // The bed's depth, from first returns in a plane that leans by the pitch.
  std::vector<double> depths;
  for (std::size_t ping = 0; ping < half; ++ping)
    depths.push_back(navigation.depth_m[ping] + static_cast<double>(real.first_of(0, ping)) *
                                                    bin_m * std::cos(navigation.pitch_rad[ping]));
  const double bed_m = median(depths);

  // The vertical pattern and the gain: what is missing where every direction is heard alike.
  std::vector<Pose> poses;
  const Recording plain =
      imitation(parse_scene(scene_text(bed_m, false, 0, 0, 1, {}), "plain", {}, paths), poses);
  std::array<std::vector<double>, 2> missing;
  double loudest = -1e9;
  for (int side : {0, 1}) {
    const std::vector<double> has = level_over_depression(real, side, 0, half);
    const std::vector<double> ours = level_over_depression(plain, side, 0, half);
    for (std::size_t i = 0; i <= 90; ++i)
      missing[static_cast<std::size_t>(side)].push_back(has[i] - ours[i]);
    for (const double m : missing[static_cast<std::size_t>(side)])
      if (!std::isnan(m)) loudest = std::max(loudest, m);
  }
  {
    std::ofstream csv(folder / "pattern.csv");
    csv << "depression_deg,port_db,starboard_db\n";
    for (std::size_t i = 0; i <= 90; ++i)
      if (!std::isnan(missing[0][i] + missing[1][i]))
        csv << i << ',' << 0.5 * (missing[0][i] - loudest) << ',' << 0.5 * (missing[1][i] - loudest)
            << '\n';
  }
  const double floor = floor_of(real, 0, half);
  const double noise_db = 20.0 * std::log10(floor / std::sqrt(std::log(2.0)) / full_scale);
  const double contrast = texture(real, 0, half, 15.0, 28.0).contrast;
  const int looks = std::clamp(static_cast<int>(std::lround(std::pow(0.5227 / contrast, 2))), 1, 8);
  // The wreck lies to starboard of where it is longest seen, along the track.
  const Pose& beside = poses.at(275);
  const Eigen::Vector3d starboard = body_to_world(beside).col(1);
  const Eigen::Vector3d place = beside.position + 8.0 * starboard;
  const Wreck wreck{place.x(), place.y(), beside.heading_rad / degree};
  const std::string text = scene_text(bed_m, true, loudest, noise_db, looks, wreck);
  std::ofstream(folder / "imitation.toml") << text;
  const Recording ours = imitation(parse_scene(text, "imitation", {}, paths), poses);
  write_pictures(folder, real, ours);

  std::string table = fmt::format(
      "set up on the first half: bed {:.2f} m down, gain {:.1f} dB, floor {:.1f} dB re full scale, "
      "{} looks\n"
      "second half                 real   ours\n",
      bed_m, loudest, noise_db, looks);
  double squares = 0.0;
  int compared = 0;
  for (int side : {0, 1}) {
    const std::vector<double> has = level_over_depression(real, side, half, pings);
    const std::vector<double> is = level_over_depression(ours, side, half, pings);
    for (std::size_t i = 8; i <= 88; i += 4) {
      table += fmt::format("{} level at {:2} deg  {:7.1f} {:6.1f} dB\n",
                           side ? "starboard" : "port     ", i, has[i], is[i]);
      if (side == 0 && i >= 16 && !std::isnan(has[i] + is[i])) {
        squares += std::pow(has[i] - is[i], 2);
        ++compared;
      }
    }
  }
  for (const double near_m : {5.0, 10.0, 15.0, 20.0, 25.0}) {
    const Texture has = texture(real, half, pings, near_m, near_m + 5.0);
    const Texture is = texture(ours, half, pings, near_m, near_m + 5.0);
    table += fmt::format(
        "{:2.0f}-{:2.0f} m  contrast {:.2f} {:.2f}, correlation in range {:.2f} {:.2f}, along "
        "track {:.2f} {:.2f}\n",
        near_m, near_m + 5.0, has.contrast, is.contrast, has.in_range, is.in_range, has.along_track,
        is.along_track);
  }
  table += fmt::format("floor {:8.0f} {:8.0f}\nclipped {:8.4f} {:8.4f}\n",
                       floor_of(real, half, pings), floor_of(ours, half, pings),
                       clipped(real, half, pings), clipped(ours, half, pings));
  std::ofstream(folder / "table.txt") << table;
  WARN(table);
  CHECK(std::sqrt(squares / compared) < 6.0);
}
