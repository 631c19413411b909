#include <ensonify/engine/seafloor/layers/bedforms.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/catmull_rom.h>
#include <ensonify/engine/seafloor/bed/interpolated.h>
#include <ensonify/engine/seafloor/bed/points_near.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

void check(const Bedforms& relief, double cell_m) {
  check_relief(relief);
  if (!(cell_m <= 0.25 * relief.wavelength_m))
    throw std::invalid_argument(fmt::format(
        "crests: cells of {} m cannot carry a wavelength of {} m; use cells of at most {} m",
        cell_m, relief.wavelength_m, 0.25 * relief.wavelength_m));
}

bool is_left_out(std::span<const double> weight, std::size_t point) {
  return !weight.empty() && weight[point] == 0.0;
}

/// Pairs of places where a crest ends or forks. Around each place the phase changes by a whole
/// turn, at the two places of a pair in opposite directions, so there is one crest more or less
/// between the two places.
class Forks {
 public:
  Forks(const Heightfield& grid, const Bedforms& relief, const LayerDraws& draws)
      : grid_(grid), core_m_(0.35 * relief.wavelength_m) {
    turns.assign(static_cast<std::size_t>(grid.points()), 0.0);
    height.assign(turns.size(), 1.0);
    const double per_m2 = relief.forks / std::pow(10.0 * relief.wavelength_m, 2);
    const double longest_m = 7.0 * relief.wavelength_m;
    for_each_scattered(grid, per_m2, reach_in_lengths * longest_m, draws, layer_stream::forks,
                       [&](double x, double y, auto& u) {
                         const double length_m = relief.wavelength_m * (2.0 + 5.0 * u[2]);
                         const double along =
                             relief.across_crests_rad + 0.5 * pi + 0.5 * (u[3] - 0.5);
                         add(x, y, length_m * std::sin(along), length_m * std::cos(along), length_m,
                             u[4] < 0.5 ? -1.0 : 1.0);
                       });
  }
  std::vector<double> turns, height;  // at the points: added to the phase, and a factor on heights

 private:
  void add(double x, double y, double east, double north, double length_m, double sign) {
    const double reach_m = reach_in_lengths * length_m;
    for_each_point_near(grid_, x, y, reach_m, [&](int column, int row, double dx, double dy) {
      const std::size_t point = grid_.index(column, row);
      // Vectors from the two places to the point; the pair adds their angle to the phase.
      const double ax = dx - 0.5 * east, ay = dy - 0.5 * north;
      const double bx = dx + 0.5 * east, by = dy + 0.5 * north;
      const double away_2 = (dx * dx + dy * dy) / (reach_m * reach_m);
      if (away_2 >= 1.0) return;
      double window = 1.0;  // 1 within half the reach, then it falls to 0
      if (away_2 > 0.25) {
        const double rest = 2.0 * (1.0 - std::sqrt(away_2));
        window = rest * rest * (3.0 - 2.0 * rest);
      }
      turns[point] += sign * window * std::atan2(ax * by - ay * bx, ax * bx + ay * by) / (2.0 * pi);
      // At the two places the phase is undefined, so the height falls smoothly to zero there, over
      // the width of a crest.
      for (const double r2 : {ax * ax + ay * ay, bx * bx + by * by})
        if (r2 < 16.0 * core_m_ * core_m_)
          height[point] *= 1.0 - std::exp(-r2 / (core_m_ * core_m_));
    });
  }

  static constexpr double reach_in_lengths = 1.6;

  const Heightfield& grid_;
  double core_m_;
};

/// Random irregularities, each about two wavelengths of the bedforms long: normal random numbers of
/// variance 1 at the points of a lattice, interpolated between the points.
std::vector<double> ragged(const Heightfield& grid, double wavelength_m, const LayerDraws& draws,
                           std::uint64_t what) {
  return interpolated(
      grid, 1.2 * wavelength_m,
      [&](std::int64_t column, std::int64_t row, std::size_t columns, std::span<double> samples) {
        for (std::size_t i = 0; i < samples.size(); ++i) {
          std::array<double, 1> number;
          draws
              .of(what, column + static_cast<std::int64_t>(i % columns),
                  row + static_cast<std::int64_t>(i / columns))
              .normal(number);
          samples[i] = catmull_rom_keeps_variance * number[0];
        }
      });
}

/// A positive number, made less than a limit, or near 0 if the limit is negative. The result is
/// smooth in both arguments, so the bed has no edge where the limit takes effect.
double less_than(double number, double limit) {
  constexpr double rounding = 0.05;
  const double some = 0.5 * (limit + std::sqrt(limit * limit + rounding * rounding));
  const double over = number / some, over_2 = over * over;
  return number / std::sqrt(std::sqrt(1.0 + over_2 * over_2));
}

void add_to_band(Heightfield& field, const Bedforms& relief, const LayerDraws& draws,
                 std::span<const double> weight) {
  // One more point on each side, for slopes.
  const Heightfield grid = field.window(-1, -1, field.columns + 2, field.rows + 2);
  const double drift_m = relief.drift_m > 0.0 ? relief.drift_m : 12.0 * relief.wavelength_m;
  const SmoothField bends(draws.of(layer_stream::bends), 0.6 * drift_m, 3.0 * drift_m);
  const SmoothField heights(draws.of(layer_stream::crest_heights), 0.6 * drift_m, 3.0 * drift_m);
  const std::vector<double> height = heights.over(grid);
  const std::vector<double> near_height =
      ragged(grid, relief.wavelength_m, draws, layer_stream::near_heights);
  const Forks forks(grid, relief, draws);
  const double ragged_ln = 4.0 * relief.raggedness;
  // If the phase has an rms slope of k0 * bend, crests turn by bend, and their spacing changes by
  // the same share. k0 is the wavenumber.
  const double bend_turns = relief.bend_rad / (relief.wavelength_m * bends.slope_per_m());
  const double east = std::sin(relief.across_crests_rad),
               north = std::cos(relief.across_crests_rad);
  std::vector<double> turns = bends.over(grid);
  {
    const std::vector<double> shift =
        ragged(grid, relief.wavelength_m, draws, layer_stream::phase_shifts);
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        const std::size_t point = grid.index(column, row);
        turns[point] = (grid.x_m(column) * east + grid.y_m(row) * north) / relief.wavelength_m +
                       bend_turns * turns[point] + relief.raggedness * shift[point] +
                       forks.turns[point];
      }
  }
  // `mean` is the mean of the profile, from the mean of sin^p over half a turn.
  const double p = 2.0 - relief.sharpness;
  const double mean =
      1.0 - 2.0 * std::tgamma(0.5 * (p + 1.0)) / (std::sqrt(pi) * std::tgamma(0.5 * p + 1.0));
  const CrestProfile profile(relief.sharpness, relief.asymmetry);
  // The difference of phase without whole turns: at a fork the phase jumps by a whole turn, which
  // does not change the height.
  const auto turns_between = [&](std::size_t from, std::size_t to) {
    const double apart = turns[to] - turns[from];
    return apart - static_cast<double>(static_cast<int>(apart + std::copysign(0.5, apart)));
  };
  const auto row_length = static_cast<std::size_t>(grid.columns);
  const auto turns_per_m = [&](std::size_t point) {
    const double east_per_m = (turns_between(point - 1, point) + turns_between(point, point + 1)) /
                              (2.0 * grid.cell_east_m);
    const double north_per_m =
        (turns_between(point - row_length, point) + turns_between(point, point + row_length)) /
        (2.0 * grid.cell_north_m);
    return std::sqrt(east_per_m * east_per_m + north_per_m * north_per_m);
  };
  constexpr double angle_of_repose_rad = 33.0 * degree;  // of sand under water
  const double highest_over_spacing = 2.0 * std::tan(angle_of_repose_rad) / profile.steepest();
  // At the border of the area, crests end one by one: their height is the weight to a power between
  // 1/e and e, and falls slowest where crests are high. The caller multiplies by the weight.
  const auto dying_out = [&](std::size_t point, double high) {
    const bool inside = weight.empty() || weight[point] == 1.0;
    return inside ? 1.0 : std::pow(weight[point], std::exp(-std::tanh(high)) - 1.0);
  };
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const std::size_t at = field.index(column, row);
      if (is_left_out(weight, at)) continue;
      const std::size_t point = grid.index(column + 1, row + 1);
      const double ln_height =
          relief.height_spread * height[point] +
          ragged_ln * (near_height[point] - ragged_ln);  // keeps the rms height
      const double higher_ln =
          ln_height > 0.0
              ? less_than(ln_height,
                          std::log(highest_over_spacing / (turns_per_m(point) * relief.height_m)))
              : ln_height;
      field.z_m[at] += 0.5 * relief.height_m * std::exp(higher_ln) * forks.height[point] *
                       dying_out(at, near_height[point]) * (profile.at(turns[point]) - mean);
    }
}

}  // namespace

CrestProfile::CrestProfile(double sharpness, double asymmetry)
    : rise_(0.5 * (1.0 + asymmetry)), at_step_(steps + 2) {
  for (std::size_t i = 0; i < at_step_.size(); ++i) {
    const double off = std::min(0.5 * static_cast<double>(i) / steps, 0.5);
    at_step_[i] = 1.0 - 2.0 * std::pow(std::sin(pi * off), 2.0 - sharpness);
  }
}

double CrestProfile::at(double turns) const {
  const double t = turns - std::floor(turns);
  // 0 at the crest, 1 in the trough.
  const double off = t < rise_ ? 1.0 - t / rise_ : (t - rise_) / (1.0 - rise_);
  const double place = off * steps;
  const auto step = static_cast<std::size_t>(place);
  return std::lerp(at_step_[step], at_step_[step + 1], place - static_cast<double>(step));
}

double CrestProfile::steepest() const {
  double step = 0.0;
  for (std::size_t i = 0; i + 1 < at_step_.size(); ++i)
    step = std::max(step, std::abs(at_step_[i + 1] - at_step_[i]));
  return step * steps / std::min(rise_, 1.0 - rise_);
}

void add_bedforms(Heightfield& field, const Bedforms& relief, const LayerDraws& draws,
                  std::span<const double> weight) {
  check(relief, std::max(field.cell_east_m, field.cell_north_m));
  if (relief.height_m == 0.0) return;
  // Heights depend on the place alone, so each thread makes a band of rows.
  std::vector<double> z_m = std::move(field.z_m);
  const auto columns = static_cast<std::size_t>(field.columns);
  refine::for_parts(
      static_cast<std::size_t>(field.rows), draws.control.threads,
      [&](std::size_t first_row, std::size_t end_row) {
        const std::size_t points = (end_row - first_row) * columns;
        if (points == 0) return;
        const std::span<double> heights = std::span(z_m).subspan(first_row * columns, points);
        Heightfield band = field.window(0, static_cast<int>(first_row), field.columns,
                                        static_cast<int>(end_row - first_row));
        band.z_m.assign(heights.begin(), heights.end());
        add_to_band(band, relief, draws,
                    weight.empty() ? weight : weight.subspan(first_row * columns, points));
        std::ranges::copy(band.z_m, heights.begin());
      });
  field.z_m = std::move(z_m);
}

namespace {
ReliefKind<Bedforms> bedform_kind() {
  return {
      .list = "crests",
      .help =
          "A layer of crests that bend, end and fork but do not fade: ripples (typically 0.1 to "
          "1.5 m long and 0.05 to 0.17 as high), megaripples (0.6 to 10 m, 0.1 to 0.5 m high), "
          "sand waves (50 to 500 m, 1 to 10 m high).",
      .purpose = Purpose::crest_layer,
      .add = &add_bedforms,
      .values = {
          {"wavelength_m", "m", 0.01, 10e3, "Distance from crest to crest; four cells or more.",
           &Bedforms::wavelength_m},
          {"height_m", "m", 0, 100,
           "Height from trough to crest: the median if raggedness is 0; otherwise the rms, if "
           "height_spread is 0.",
           &Bedforms::height_m},
          {"across_crests_deg", "degrees", -360, 360,
           "Heading across the crests, clockwise from north; steep sides face that way.",
           &Bedforms::across_crests_rad},
          {"sharpness", "", 0, 1, "0: a cosine; 1: crests are edges between round troughs.",
           &Bedforms::sharpness},
          {"asymmetry", "", 0, 0.95, "0: both sides equal; towards 1: a steep lee side.",
           &Bedforms::asymmetry},
          {"bend_deg", "degrees", 0, 45,
           "Rms angle by which the crests turn; their spacing changes by the same share, in radians.",
           &Bedforms::bend_rad},
          {"drift_m", "m", 0, 1e6, "Distance over which bend and height change; 0: 12 wavelengths.",
           &Bedforms::drift_m},
          {"height_spread", "", 0, 2,
           "Rms change of the logarithm of the height over drift_m. It makes no crest steeper than "
           "33 degrees, at which sand slides.",
           &Bedforms::height_spread},
          {"raggedness", "", 0, 0.3,
           "Rms shift of the crests' lines over some two wavelengths, as a share of the wavelength; "
           "the logarithm of their height changes four times as much.",
           &Bedforms::raggedness},
          {"forks", "", 0, 25, "How many crests begin and end in a square of 10 x 10 wavelengths.",
           &Bedforms::forks},
      }};
}
}  // namespace
const ReliefKind<Bedforms>& kind_of(const Bedforms&) { return made_once<bedform_kind>(); }

}  // namespace ensonify::engine
