// A scene that imitates a real recording: its parameters are fitted to the recording's first half,
// its result is compared with the second half. Pictures and a table go to build/imitation.
//
// What the recording's samples show about its recorder:
// - Each ping of each side has the same mean, a quarter of full scale, within 1 % from ping to ping
//   except where it clips. So each ping is scaled as the last step before clipping.
// - The floor in the water column and in shadows is the same at all ranges, so it is added after
//   the varied gain, and it changes with that scale.
// - The file's channel headers state that the largest of several samples was kept, and a smooth
//   bed's samples scatter as the largest of three Rayleigh amplitudes.

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "support/at.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/paths.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/output/png.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/refine/atomic_file.h>

using namespace ensonify;
using namespace ensonify::engine;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t pings = 460, first_half = 230, bins = 1024;
constexpr double full_scale = 32767.0;
constexpr double range_m = 29.9835, bin_m = range_m / bins;

/// Samples of both sides, near to far, and the first bin of the bed.
struct ComparedImage {
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

/// XTF: packets of two channels of 1024 shorts, port far to near; the first has no navigation.
ComparedImage read_recording(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  ComparedImage recording;
  std::size_t packet = 0;
  for (std::size_t place = 1024; place + 14 < bytes.size();) {
    if (bytes[place + 2] == 0 && packet++ > 0 && packet - 2 < pings)
      for (std::size_t side : {0, 1})
        for (std::size_t i = 0; i < bins; ++i) {
          const std::size_t from = place + 256 + (side + 1) * 64 + side * 2 * bins + 2 * i;
          recording.samples[side][(packet - 2) * bins + (side == 0 ? bins - 1 - i : i)] =
              tests::at<std::uint16_t>(bytes, from);
        }
    place += tests::at<std::uint32_t>(bytes, place + 10);
  }
  recording.find_first_returns();
  return recording;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Mean square relative to full scale, dB, by whole degrees of depression; NaN with too few
/// samples.
std::vector<double> level_over_depression(const ComparedImage& image, int side, std::size_t from,
                                          std::size_t until, double enough = 200.0) {
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
    sums[i] = counts[i] > enough ? 10.0 * std::log10(sums[i] / counts[i]) : std::nan("");
  return sums;
}

/// Contrast, and correlation of neighbours in range and along the track: medians over blocks of
/// 8 pings x 16 bins of the port bed (the wreck is to starboard) between two ranges.
struct Texture {
  double contrast, in_range, along_track;
};
Texture texture(const ComparedImage& image, std::size_t from, std::size_t until, double near_m,
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

/// Median of the water column, beyond the transmit leakage.
double floor_of(const ComparedImage& image, int side, std::size_t from, std::size_t until) {
  std::vector<double> values;
  for (std::size_t ping = from; ping < until; ++ping)
    for (std::size_t bin = 40; bin + 20 < image.first_of(side, ping); ++bin)
      values.push_back(image.at(side, ping, bin));
  return median(values);
}

double clipped(const ComparedImage& image, std::size_t from, std::size_t until) {
  double count = 0.0;
  for (std::size_t ping = from; ping < until; ++ping)
    for (int side : {0, 1})
      for (std::size_t bin = 20; bin < bins; ++bin)
        count += image.at(side, ping, bin) >= full_scale;
  return count / (2.0 * static_cast<double>((until - from) * (bins - 20)));
}

/// The recording's navigation and altitude.
struct Navigation {
  std::string header;
  std::vector<std::vector<double>> rows;
  double depth_m(std::size_t ping) const { return rows[ping].at(5); }
  double altitude_m(std::size_t ping) const { return rows[ping].at(6); }
  double pitch_rad(std::size_t ping) const { return rows[ping].at(7) * degree; }
};
Navigation read_navigation(const fs::path& file) {
  std::ifstream stream(file);
  Navigation navigation;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line.front() == '#') continue;
    if (!std::isdigit(static_cast<unsigned char>(line.front()))) {
      navigation.header = line;
      continue;
    }
    std::vector<double>& cells = navigation.rows.emplace_back();
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(std::stod(cell));
  }
  return navigation;
}

/// The instrument's parameters, fitted to the first half.
struct Setup {
  double bed_m;         ///< depth of a level bed
  double altimeter;     ///< true altitude relative to the altimeter's
  double spreading;     ///< of the varied gain, dB per factor of ten in range
  int looks;            ///< the largest of this number of samples is recorded
  double bandwidth_hz;  ///< of the pulse
  double ping_mean;     ///< mean of each ping's samples relative to full scale
  double gain_db = 0.0, noise_db = -60.0;
};

constexpr double absorption_db_per_m = 0.16;  // 600 kHz, cold and not very salty
/// Relief over 1 m. Tried: 0.03 and 0.05 m. With 0.05 m contrast alone is nearer to the first half,
/// with 0.03 m contrast and correlations together.
constexpr double relief_m = 0.03;
constexpr int steepest = 80;  // degrees; beyond, one bin at the first return changes everything

/// Writes the vertical patterns of both sides as one-way levels over depression.
void write_pattern(const fs::path& file, const std::array<std::vector<double>, 2>& two_way_db) {
  // Angles that were not seen, above the axis, get the levels mirrored from below it.
  std::array<std::vector<double>, 2> rows;
  for (std::size_t side : {0, 1}) {
    const std::vector<double>& seen = two_way_db[side];
    int first = 0, axis = 0;
    while (std::isnan(seen[static_cast<std::size_t>(first)])) ++first;
    const auto known = [&](int angle) {
      std::size_t i = static_cast<std::size_t>(std::clamp(angle, first, 90));
      while (std::isnan(seen[i])) --i;
      return seen[i];
    };
    for (int i = first; i <= 90; ++i)
      if (known(i) > known(axis)) axis = i;
    for (int angle = -90; angle <= 90; ++angle) {
      const int beyond = 2 * axis - angle;  // mirrored at the axis
      rows[side].push_back(angle >= first ? known(angle)
                                          : std::min(known(axis), known(first) + known(beyond) -
                                                                      known(2 * axis - first)));
    }
  }
  std::ofstream csv(file);
  csv << "depression_deg,port_db,starboard_db\n";
  const double loudest = std::max(std::ranges::max(rows[0]), std::ranges::max(rows[1]));
  for (std::size_t i = 0; i < rows[0].size(); i += 2)
    csv << static_cast<int>(i) - 90 << ',' << 0.5 * (rows[0][i] - loudest) << ','
        << 0.5 * (rows[1][i] - loudest) << '\n';
}

struct Wreck {
  double east_m, north_m, heading_deg;
};

std::string scene_text(const Setup& setup, bool fitted, const Wreck& wreck) {
  std::string text = fmt::format(
      R"(version = 1
conditions = "ideal"
seed = 11
speckle = {}
[sea]
sound_speed_mps = 1500
absorption_db_per_km = {}
wind_mps = 4
[seafloor]
kind = "fractal"
extent_east_m = 100
extent_north_m = 110
cell_m = 0.08
depth_m = {}
material = "medium sand"
[seafloor.fractal]
height_at_1m_m = {}
hurst = 0.5
longest_m = 10
[track]
kind = "file"
file = "navigation.csv"
smooth_s = 3
[sonar.port-starboard]
frequency_hz = 600e3
source_level_db = 210
array_length_m = 0.32
bandwidth_hz = {}
range_m = {}
bins = 1024
planes = 4
elevations = 1400
tvg_spreading = {}
tvg_absorption = false
gain_db = {}
noise = false
)",
      fitted, 1e3 * absorption_db_per_m, setup.bed_m, fitted ? relief_m : 0.0, setup.bandwidth_hz,
      range_m, setup.spreading, setup.gain_db);
  if (!fitted) return text + "vertical_beamwidth_deg = 0\n";
  text += fmt::format(R"(vertical_pattern = "pattern.csv"
looks = {}
detector = "peak"
ping_mean = {}
output_noise_db = {}
[arrivals]
surface = true
double_bounce = true
burst_m = 0.23
[[objects]]
mesh = "data:mesh_underwater/skytteren_wreck.ply"
class = "wreck"
scale = 0.15
heading_deg = {}
east_m = {}
north_m = {}
height_m = -3.5
)",
                      setup.looks, setup.ping_mean, setup.noise_db, wreck.heading_deg, wreck.east_m,
                      wreck.north_m);
  return text;
}

ComparedImage imitation(const Scene& scene, std::vector<Pose>& poses) {
  Simulator simulator(scene);
  poses = simulator.track();
  const ScenePings all = ping_all(scene, simulator, 0);
  const Waterfall& image = all.images.front();
  ComparedImage recording;
  for (std::size_t ping = 0; ping < std::min(pings, image.rows()); ++ping)
    for (std::size_t bin = 0; bin < bins; ++bin) {
      // Without speckle the samples would clip, so the expected amplitude is used, with the gain.
      const auto value = [&](std::size_t column) {
        const std::size_t pixel = ping * 2 * bins + column;
        return scene.speckle ? static_cast<float>(image.pixels.sample[pixel])
                             : static_cast<float>(full_scale) *
                                   SimulatorInternals::recorder(simulator, 0).gain(bin) *
                                   std::sqrt(image.pixels.intensity_mean[pixel]);
      };
      recording.samples[0][ping * bins + bin] = value(bins - 1 - bin);
      recording.samples[1][ping * bins + bin] = value(bins + bin);
    }
  recording.find_first_returns();
  return recording;
}

/// Real recording left, imitation right, each with port left, the newest ping on top and every
/// second bin.
void write_pictures(const fs::path& folder, const ComparedImage& real, const ComparedImage& ours) {
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

namespace {

constexpr std::size_t block = 23;  // pings with nearly the same altitude

double db_of(double amplitude) { return 20.0 * std::log10(amplitude / full_scale); }

/// The slope of the varied gain for which the echo at each depression falls as a line array's, with
/// r^-3 and the absorption. The echo is measured relative to the floor, which the gain does not
/// change.
double fitted_spreading(const ComparedImage& real) {
  double covariance = 0.0, variance = 0.0;
  for (const int side : {0, 1})
    for (std::size_t angle = 20; angle <= 70; ++angle) {
      std::vector<double> x, y;
      for (std::size_t from = 0; from < first_half; from += block) {
        const double level = level_over_depression(real, side, from, from + block, 8.0)[angle];
        if (std::isnan(level)) continue;
        const double r = bin_m * static_cast<double>(real.first_of(side, from + block / 2)) /
                         std::sin(static_cast<double>(angle) * degree);
        x.push_back(std::log10(r));
        y.push_back(level - db_of(floor_of(real, side, from, from + block)) +
                    2.0 * absorption_db_per_m * r);
      }
      const auto n = static_cast<double>(x.size());
      const double mean_x = std::accumulate(x.begin(), x.end(), 0.0) / n;
      const double mean_y = std::accumulate(y.begin(), y.end(), 0.0) / n;
      for (std::size_t i = 0; i < x.size(); ++i) {
        covariance += (x[i] - mean_x) * (y[i] - mean_y);
        variance += (x[i] - mean_x) * (x[i] - mean_x);
      }
    }
  return std::max(0.0, 30.0 + covariance / variance);
}

/// Mean, rms and median of the largest of `looks` Rayleigh amplitudes of mean square 1.
struct Largest {
  double mean = 0.0, rms = 0.0, median;
  explicit Largest(int looks) : median(std::sqrt(-std::log(1.0 - std::pow(0.5, 1.0 / looks)))) {
    double squares = 0.0;
    constexpr int steps = 20000;
    for (int i = 0; i < steps; ++i) {
      const double square = -std::log(1.0 - std::pow((i + 0.5) / steps, 1.0 / looks));
      mean += std::sqrt(square) / steps;
      squares += square / steps;
    }
    rms = std::sqrt(squares);
  }
  double contrast() const { return std::sqrt(rms * rms - mean * mean) / mean; }
};

/// All parameters except gain and pattern.
Setup set_up(const ComparedImage& real, const Navigation& navigation) {
  Setup setup{};
  std::vector<double> depths, altitudes, means;
  for (std::size_t ping = 0; ping < first_half; ++ping) {
    const double height_m =
        static_cast<double>(real.first_of(0, ping)) * bin_m * std::cos(navigation.pitch_rad(ping));
    depths.push_back(navigation.depth_m(ping) + height_m);
    altitudes.push_back(height_m / navigation.altitude_m(ping));
    for (const int side : {0, 1}) {
      double sum = 0.0;
      for (std::size_t bin = 20; bin < bins; ++bin) sum += real.at(side, ping, bin);
      means.push_back(sum / (bins - 20) / full_scale);
    }
  }
  setup.bed_m = median(depths);
  setup.altimeter = median(altitudes);
  setup.ping_mean = median(means);
  setup.spreading = fitted_spreading(real);
  // From the smooth bed at the highest altitude: the contrast gives the looks, the correlation of
  // neighbours the bandwidth.
  const Texture smooth = texture(real, 0, first_half / 2, 15.0, 28.0);
  setup.looks = 1;
  while (setup.looks < 8 && std::abs(Largest(setup.looks + 1).contrast() - smooth.contrast) <
                                std::abs(Largest(setup.looks).contrast() - smooth.contrast))
    ++setup.looks;
  const double alike =
      std::sqrt(std::max(smooth.in_range, 0.0));  // of the field; triangle of a box
  setup.bandwidth_hz = 1500.0 / (2.0 * bin_m) * (1.0 - alike);
  return setup;
}

/// The numbers by which parts of recordings are compared.
struct Summary {
  std::array<std::vector<double>, 2> level;  // by side, over depression
  std::vector<Texture> textures;             // over range
  double floor_db, clipped;
};
constexpr std::array texture_from_m{5.0, 10.0, 15.0, 20.0, 25.0};
Summary summary(const ComparedImage& image, std::size_t from, std::size_t until) {
  Summary all;
  for (const int side : {0, 1})
    all.level[static_cast<std::size_t>(side)] = level_over_depression(image, side, from, until);
  for (const double near_m : texture_from_m)
    all.textures.push_back(texture(image, from, until, near_m, near_m + 5.0));
  all.floor_db = db_of(floor_of(image, 0, from, until));
  all.clipped = clipped(image, from, until);
  return all;
}

/// Rms difference of the port levels (the wreck is to starboard) where both are known.
double level_difference_db(const Summary& a, const Summary& b) {
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i <= 90; ++i)
    if (const double difference = a.level[0][i] - b.level[0][i]; !std::isnan(difference)) {
      squares += difference * difference;
      count += 1.0;
    }
  return std::sqrt(squares / count);
}
double texture_difference(const Summary& a, const Summary& b, double Texture::*what) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.textures.size(); ++i)
    squares += std::pow(a.textures[i].*what - b.textures[i].*what, 2);
  return std::sqrt(squares / static_cast<double>(a.textures.size()));
}

}  // namespace

TEST_CASE("a scene fitted to the first half of a real recording resembles the second half",
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
  const ComparedImage real = read_recording(*file);
  const Navigation navigation = read_navigation(*navigation_file);
  REQUIRE(navigation.rows.size() == pings);
  Setup setup = set_up(real, navigation);
  {  // With the recording's altitude, above a level bed.
    std::ofstream csv(folder / "navigation.csv");
    csv << navigation.header << '\n';
    for (std::vector<double> row : navigation.rows) {
      row.at(5) = setup.bed_m - setup.altimeter * row.at(6);
      csv << fmt::format("{}\n", fmt::join(row, ","));
    }
  }

  // The vertical pattern and the gain: the bed relative to the floor, compared with a simulation
  // without a vertical pattern.
  std::vector<Pose> poses;
  const ComparedImage plain =
      imitation(parse_scene(scene_text(setup, false, {}), "plain", {}, paths), poses);
  std::array<std::vector<double>, 2> pattern_db;
  const Largest largest(setup.looks);
  double loudest = -1e9;
  for (const int side : {0, 1}) {
    std::vector<double> sums(91), counts(91);
    for (std::size_t from = 0; from < first_half; from += block) {
      const std::vector<double> has = level_over_depression(real, side, from, from + block, 8.0);
      const std::vector<double> is = level_over_depression(plain, side, from, from + block, 8.0);
      const double floor_db = db_of(floor_of(real, side, from, from + block) / largest.median);
      for (std::size_t i = 0; i <= 90; ++i)
        if (i <= steepest && std::isfinite(has[i] + is[i])) {
          sums[i] += has[i] - db_of(full_scale * largest.rms) - floor_db - is[i];
          counts[i] += 1.0;
        }
    }
    for (std::size_t i = 0; i <= 90; ++i) {
      pattern_db[static_cast<std::size_t>(side)].push_back(sums[i] / counts[i]);  // or NaN
      if (counts[i] > 0.0) loudest = std::max(loudest, sums[i] / counts[i]);
    }
  }
  write_pattern(folder / "pattern.csv", pattern_db);
  setup.gain_db = loudest + setup.noise_db;
  // The wreck is abeam to starboard where it is seen longest; its mesh points athwart.
  const Pose& beside = poses.at(275);
  const Eigen::Vector3d starboard = body_to_world(beside).col(1);
  const Eigen::Vector3d place = beside.position + 7.5 * starboard;
  const Wreck wreck{place.x(), place.y(), beside.heading_rad / degree - 117.0};
  const std::string text = scene_text(setup, true, wreck);
  std::ofstream(folder / "imitation.toml") << text;
  const ComparedImage ours = imitation(parse_scene(text, "imitation", {}, paths), poses);
  write_pictures(folder, real, ours);

  const Summary before = summary(real, 0, first_half), has = summary(real, first_half, pings),
                is = summary(ours, first_half, pings), made_of = summary(ours, 0, first_half);
  std::string table = fmt::format(
      "fitted to the first half: bed at {:.2f} m depth, altitude {:.3f} of the altimeter's, varied "
      "gain of {:.1f} dB per factor of ten, the largest of {} looks, {:.1f} kHz, mean of a ping "
      "{:.4f} of full scale\n"
      "                            first half    second half\n"
      "                             real   ours   real   ours\n",
      setup.bed_m, setup.altimeter, setup.spreading, setup.looks, 1e-3 * setup.bandwidth_hz,
      setup.ping_mean);
  for (std::size_t side : {0, 1})
    for (std::size_t i = 8; i <= 88; i += 4)
      table += fmt::format("{} level at {:2} deg  {:6.1f} {:6.1f} {:6.1f} {:6.1f} dB\n",
                           side ? "starboard" : "port     ", i, before.level[side][i],
                           made_of.level[side][i], has.level[side][i], is.level[side][i]);
  for (std::size_t i = 0; i < texture_from_m.size(); ++i) {
    table += fmt::format("{:2.0f}-{:2.0f} m", texture_from_m[i], texture_from_m[i] + 5.0);
    for (const auto& [name, what] : {std::pair{"contrast", &Texture::contrast},
                                     {"in range", &Texture::in_range},
                                     {"along track", &Texture::along_track}})
      table += fmt::format("  {} {:.2f} {:.2f} {:.2f} {:.2f}", name, before.textures[i].*what,
                           made_of.textures[i].*what, has.textures[i].*what, is.textures[i].*what);
    table += '\n';
  }
  table += fmt::format(
      "floor {:8.1f} {:8.1f} {:8.1f} {:8.1f} dB\nclipped {:8.4f} {:8.4f} {:8.4f} {:8.4f}\n",
      before.floor_db, made_of.floor_db, has.floor_db, is.floor_db, before.clipped, made_of.clipped,
      has.clipped, is.clipped);
  // The imitation must be nearer to the second half than the real first half is.
  struct Bound {
    const char* what;
    double apart, halves_apart;
  };
  const std::array bounds{
      Bound{"level, dB rms", level_difference_db(is, has), level_difference_db(before, has)},
      Bound{"contrast, rms", texture_difference(is, has, &Texture::contrast),
            texture_difference(before, has, &Texture::contrast)},
      Bound{"correlation in range, rms", texture_difference(is, has, &Texture::in_range),
            texture_difference(before, has, &Texture::in_range)},
      Bound{"correlation along track, rms", texture_difference(is, has, &Texture::along_track),
            texture_difference(before, has, &Texture::along_track)},
      Bound{"floor, dB", std::abs(is.floor_db - has.floor_db),
            std::abs(before.floor_db - has.floor_db)},
      Bound{"clipped", std::abs(is.clipped - has.clipped), std::abs(before.clipped - has.clipped)}};
  table += "apart from the second half:        ours   the first half\n";
  for (const Bound& bound : bounds)
    table += fmt::format("{:32} {:7.4f} {:7.4f}\n", bound.what, bound.apart, bound.halves_apart);
  std::ofstream(folder / "table.txt") << table;
  WARN(table);
  for (const Bound& bound : bounds) {
    CAPTURE(bound.what);
    CHECK(bound.apart < bound.halves_apart);
  }
}
