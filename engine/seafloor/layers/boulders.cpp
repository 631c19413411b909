#include <ensonify/engine/seafloor/layers/boulders.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/points_near.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr double largest_boulder_of_median = 5.0;
constexpr double tail_diameters = 6.0;
constexpr double farthest_top = 1.6;  // greatest distance of a top from its middle, in radii
// A Gaussian exp(-x^2) with x beyond this is less than 5e-22 and changes no height.
constexpr double faint = 7.0;

/// The mean of (diameter / median)^2 for a log-normal diameter with an upper limit.
double mean_square_of_median(double spread) {
  if (spread == 0.0) return 1.0;
  const double largest = std::log(largest_boulder_of_median);
  const auto below = [&](double normal) { return 0.5 * std::erfc(-normal / std::numbers::sqrt2); };
  return std::exp(2.0 * spread * spread) * below(largest / spread - 2.0 * spread) +
         largest_boulder_of_median * largest_boulder_of_median * below(-largest / spread);
}

/// A flat face along which a block has broken: the height of the face divided by the height of the
/// whole block. Places are in units of half the block's axes.
struct BrokenFace {
  double at_middle, slope_along, slope_across;

  double height(double along, double across) const {
    return at_middle - slope_along * along - slope_across * across;
  }
};

/// One stone: a block with a tilted top, more or less rounded, longer than wide, from which parts
/// have broken off along flat faces.
class Boulder {
 public:
  Boulder(const BoulderField& field, const auto& u, const LayerDraws& draws) {
    diameter_m = random_diameter_m(field.diameter_m, field.diameter_spread,
                                   largest_boulder_of_median, u[2], u[3]);
    height_m = field.height_ratio * diameter_m * (0.3 + 1.4 * u[4]);  // some lie deep in the bed
    heading_ = 2.0 * pi * u[5];
    stretch_ = std::sqrt(1.0 + 0.7 * u[6]);
    corner_ = 2.0 * pi * u[7];
    corner_2_ = 2.0 * pi * u[8];
    lean_ = 0.6 * (u[9] - 0.5);
    current_turn_rad = 0.8 * (lower_bits(u[5]) - 0.5);
    moat_share = 2.0 * lower_bits(u[6]);
    tail_share = 2.0 * lower_bits(u[7]);
    squareness_ = 2.0 + 4.0 * lower_bits(u[9]);
    // Broken faces need more numbers than feature_draws has, so they have a random stream that the
    // stone's own numbers choose.
    break_off(draws.of(layer_stream::broken_faces, static_cast<std::int64_t>(u[6] * 0x1p31),
                       static_cast<std::int64_t>(u[7] * 0x1p31)));
  }
  /// The height of the stone's top over the bed, 0 outside the stone.
  double top_m(double dx, double dy) const {
    const double along =
        (dx * std::sin(heading_) + dy * std::cos(heading_)) / (0.5 * diameter_m * stretch_);
    const double across =
        (dx * std::cos(heading_) - dy * std::sin(heading_)) / (0.5 * diameter_m) * stretch_;
    return top_m_ * top(along, across);
  }

  double diameter_m, height_m;
  // Random variation: turn of the current, and factors on depth of the moat and height of the tail.
  double current_turn_rad, moat_share, tail_share;

 private:
  /// The height of the top divided by top_m_, at a place in units of half the axes.
  double top(double along, double across) const {
    const double broken = lowest_broken_face(along, across), distance = std::hypot(along, across);
    if (broken <= 0.0 || distance >= 1.0 + outline_waves[0] + outline_waves[1]) return 0.0;
    const double angle = std::atan2(across, along);
    const double outline = 1.0 + outline_waves[0] * std::cos(3.0 * angle + corner_) +
                           outline_waves[1] * std::cos(5.0 * angle + corner_2_);
    return std::min(broken, block(distance / outline, along));
  }

  /// The height of the block before parts broke off, divided by top_m_. `distance` is in units of
  /// the outline's distance in this direction.
  double block(double distance, double along) const {
    return distance < 1.0 ? std::sqrt(1.0 - std::pow(distance, squareness_)) * (1.0 + lean_ * along)
                          : 0.0;
  }

  double lowest_broken_face(double along, double across) const {
    double lowest = std::numeric_limits<double>::infinity();
    for (const BrokenFace& face : broken_) lowest = std::min(lowest, face.height(along, across));
    return lowest;
  }

  /// Breaks parts off. The rest has nearly the height that was drawn: its highest place is searched
  /// at a few places only, and for a round outline.
  void break_off(const RandomStream& draws) {
    std::array<double, 3 * broken_faces> u;
    draws.uniform(u);
    for (std::size_t i = 0; i < broken_faces; ++i) {
      const double heading = 2.0 * pi * u[3 * i], slope = 0.2 + 1.6 * u[3 * i + 1];
      broken_[i] = {0.7 + 0.5 * u[3 * i + 2], slope * std::cos(heading), slope * std::sin(heading)};
    }
    constexpr std::array places = {0.0, -0.25, 0.25, -0.5, 0.5, -0.75, 0.75};
    double highest = 0.0;
    for (const double across : places)
      for (const double along : places)
        if (const double broken = lowest_broken_face(along, across); broken > highest)
          highest = std::max(highest, std::min(broken, block(std::hypot(along, across), along)));
    top_m_ = height_m / highest;
  }

  static constexpr std::array outline_waves = {
      0.10, 0.06};  // amplitudes, as shares of the outline's radius
  static constexpr std::size_t broken_faces = 4;
  std::array<BrokenFace, broken_faces> broken_;
  double top_m_, heading_, stretch_, corner_, corner_2_, lean_;
  double squareness_;  // 2: half an ellipsoid; above, the top is flat and the sides are steep
};

}  // namespace

double reach_m(const BoulderField& boulders) {
  return tail_diameters * largest_boulder_of_median * boulders.diameter_m;
}

void add_boulders(Heightfield& field, const BoulderField& boulders, const LayerDraws& draws,
                  const Allowed& allowed, std::span<std::uint32_t> marked) {
  check_relief(boulders);
  check_cover("boulders", boulders.per_hectare, boulders.diameter_m,
              mean_square_of_median(boulders.diameter_spread));
  std::vector<double> stones(field.z_m.size(), 0.0);
  const bool sand_moved = boulders.scour_ratio > 0.0 || boulders.tail_ratio > 0.0;
  const SmoothField crowds(draws.of(layer_stream::boulder_density), 8.0 * boulders.diameter_m,
                           60.0 * boulders.diameter_m);
  // Thinning: candidates are drawn at the highest density, and each is kept with a probability of
  // the local density divided by the highest.
  const auto stays = [&](double x, double y, double random) {
    const double even = 0.5 * std::erfc(-crowds.at(x, y) / std::numbers::sqrt2);
    return random <= std::pow(even, boulders.clustering);
  };
  std::uint32_t number = 0;
  const auto set_down = [&](double x, double y, const auto& u) {
    if (!allowed(x, y) || (boulders.clustering > 0.0 && !stays(x, y, lower_bits(u[8])))) return;
    ++number;
    const Boulder stone(boulders, u, draws);
    const double half_m = 0.5 * stone.diameter_m;
    const double current_rad = boulders.current_rad + stone.current_turn_rad;
    const double down_x = std::sin(current_rad), down_y = std::cos(current_rad);
    const double moat_m = boulders.scour_ratio * stone.height_m * stone.moat_share;
    const double tail_m = boulders.tail_ratio * stone.height_m * stone.tail_share;
    const double its_reach_m = stone.diameter_m * (sand_moved ? tail_diameters : 0.8);
    for_each_point_near(field, x, y, its_reach_m, [&](int column, int row, double dx, double dy) {
      const std::size_t point = field.index(column, row);
      const double down = (dx * down_x + dy * down_y) / half_m;
      const double across = (dx * down_y - dy * down_x) / half_m;
      const double r = std::hypot(down, across);
      const double moat = (r - 1.15) / 0.45;  // a horseshoe that is open on the lee side
      if (moat < faint) {
        const double open = 0.5 - 0.5 * down / std::max(r, 1e-9);
        field.z_m[point] -= moat_m * open * std::exp(-moat * moat);
      }
      const double width = 0.7 + 0.08 * down;
      if (down > 0.0 && std::abs(across) < faint * width) {
        const double along = down / 3.0;
        field.z_m[point] += tail_m * along * std::exp(1.0 - along) *
                            std::exp(-across * across / (width * width)) *
                            std::clamp(2.0 - 2.0 * down / (2.0 * tail_diameters), 0.0, 1.0);
      }
      if (r > farthest_top) return;
      const double top = stone.top_m(dx, dy);
      if (top > stones[point]) {
        stones[point] = top;
        marked[point] = number;
      }
    });
  };
  for_each_scattered(field, 1e-4 * boulders.per_hectare * (1.0 + boulders.clustering),
                     reach_m(boulders), draws, layer_stream::boulders, set_down);
  for (std::size_t i = 0; i < stones.size(); ++i) field.z_m[i] += stones[i];
}

namespace {
ReliefKind<BoulderField> boulder_kind() {
  return {
      .list = "boulders",
      .help =
          "A layer of many boulders with moats and tails; give the seabed four cells or more "
          "per boulder. For single boulders with fine detail use [[objects]].",
      .purpose = Purpose::boulder_layer,
      .class_name = "boulder",
      .material = "stone",
      .add = &add_boulders,
      .size_m = &BoulderField::diameter_m,
      .values = {
          {"per_hectare", "", 0, 1e5, "How many in 100 x 100 m, on average.",
           &BoulderField::per_hectare},
          {"diameter_m", "m", 0.001, 1000, "Median diameter.", &BoulderField::diameter_m},
          {"diameter_spread", "", 0, 2,
           "Standard deviation of its logarithm; none is larger than 5 medians.",
           &BoulderField::diameter_spread},
          {"height_ratio", "", 0, 3, "Mean ratio of height above the bed to diameter.",
           &BoulderField::height_ratio},
          {"scour_ratio", "", 0, 1, "Depth of the moat over the height.",
           &BoulderField::scour_ratio},
          {"tail_ratio", "", 0, 1, "Height of the tail over the height.",
           &BoulderField::tail_ratio},
          {"clustering", "", 0, 5,
           "0: boulders lie independently of each other; 2: half of them lie on a fifth of the bed.",
           &BoulderField::clustering},
          {"current_deg", "degrees", -360, 360,
           "Heading that the current, and so the tails, go to.", &BoulderField::current_rad},
      }};
}
}  // namespace
const ReliefKind<BoulderField>& kind_of(const BoulderField&) { return made_once<boulder_kind>(); }

}  // namespace ensonify::engine
