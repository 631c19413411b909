#include <ensonify/engine/seafloor/layers/outcrops.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/points_near.h>

namespace ensonify::engine {
namespace {

// Distance between joints in thicknesses of their bed. It is about 1 or a few (Bai and Pollard,
// J. Struct. Geol. 22, 43, 2000). A sonar shows the larger distances.
constexpr double joints_per_bed = 4.0;
// Twice the greatest slope of a block's top, along the dip and along the strike.
constexpr double leaning = 0.12;
constexpr double leaning_along_strike = 0.03;
// Greatest height of a block's top over or under the eroded surface, in thicknesses of a bed.
constexpr double farthest_in_beds = 1.5;
constexpr double fallen_per_m2 = 1.0;  // near a ledge
// Takes effect where joints are more than 11 m apart.
constexpr double max_fallen_per_block = 128.0;
constexpr double longest_fallen_in_joints = 0.45;
constexpr double closed_share = 0.8;  // share of closed joints in the second set
constexpr double crooked = 6.0;       // distance of joints from a straight line / roughness there

/// The blocks of a bed between two sets of joints. The joints of the first set are unbroken and run
/// roughly across the dip, as ledges do. The joints of the second set end at the first set, and
/// most of them are closed. The class keeps the last block, because the next place is often in it.
class Joints {
 public:
  Joints(double spacing_m, double dip_heading_rad, const LayerDraws& draws)
      : spacing_m_(spacing_m), draws_(draws) {
    std::array<double, 1> turned;
    draws.of(layer_stream::strike).uniform(turned);
    const double across_rad = dip_heading_rad + 0.5 * (turned[0] - 0.5);
    cosine_ = std::sin(across_rad);
    sine_ = std::cos(across_rad);
  }

  struct Block {
    double middle_x, middle_y;
    double across_m, along_m;     // from the middle to the place, across and along the strike
    double edge_m;                // from the place to the nearest joint
    std::array<double, 4> draws;  // uniform random numbers of this block
  };
  Block at(double x, double y) {
    const double u = x * cosine_ + y * sine_, v = y * cosine_ - x * sine_;
    const bool same_strip = across_.contains(u);
    if (!same_strip) across_ = gap(u, layer_stream::main_joints, 0, 0.0);
    if (!same_strip || !along_.contains(v)) {
      along_ = gap(v, layer_stream::cross_joints, across_.number, closed_share);
      const double middle_u = 0.5 * (across_.low + across_.high);
      const double middle_v = 0.5 * (along_.low + along_.high);
      block_.middle_x = middle_u * cosine_ - middle_v * sine_;
      block_.middle_y = middle_u * sine_ + middle_v * cosine_;
      draws_.of(layer_stream::blocks, across_.number, along_.number).uniform(block_.draws);
    }
    block_.across_m = u - 0.5 * (across_.low + across_.high);
    block_.along_m = v - 0.5 * (along_.low + along_.high);
    block_.edge_m = std::min({u - across_.low, across_.high - u, v - along_.low, along_.high - v});
    return block_;
  }

 private:
  struct Gap {
    std::int64_t number = 0;
    double low = 0.0, high = 0.0;
    bool contains(double place) const { return low <= place && place < high; }
  };
  /// The gap between two open joints in which a place lies. Each interval of spacing_m has a joint.
  Gap gap(double place, std::uint64_t set, std::int64_t strip, double closed) const {
    struct Joint {
      double at;
      bool open;
    };
    const auto joint = [&](std::int64_t number) -> Joint {
      std::array<double, 2> u;
      draws_.of(set, strip, number).uniform(u);
      return {(static_cast<double>(number) + u[0]) * spacing_m_, u[1] > closed};
    };
    auto low = static_cast<std::int64_t>(std::floor(place / spacing_m_)), high = low + 1;
    if (joint(low).at > place) high = low--;
    while (!joint(low).open) --low;
    while (!joint(high).open) ++high;
    return {low, joint(low).at, joint(high).at};
  }

  double spacing_m_, cosine_, sine_;
  LayerDraws draws_;
  Gap across_, along_;  // of the last block
  Block block_{};
};

/// A fallen block: a box with a tilted top and without two opposite corners. Sizes follow a power
/// law, like the sizes of broken rock.
class FallenBlock {
 public:
  FallenBlock(double joint_m, std::span<const double> u) {
    length_m_ = std::min(longest_fallen_in_joints, 0.1 * std::pow(u[2], -0.4)) * joint_m;
    width_m_ = length_m_ * (0.5 + 0.5 * u[3]);
    height_m_ = width_m_ * (0.5 + 0.6 * u[4]);
    const double heading = 2.0 * std::numbers::pi * u[5];
    east_ = std::sin(heading);
    north_ = std::cos(heading);
    lean_along_ = u[6] - 0.5;
    lean_across_ = u[7] - 0.5;
    corner_ = u[6] < 0.5 ? -1.0 : 1.0;
  }
  double reach_m() const { return 0.5 * std::hypot(length_m_, width_m_); }
  /// The height of the block's top over its foot; 0 outside the block.
  double top_m(double dx, double dy) const {
    const double along = 2.0 * (dx * east_ + dy * north_) / length_m_;
    const double across = 2.0 * (dx * north_ - dy * east_) / width_m_;
    if (std::max(std::abs(along), std::abs(across)) >= 1.0) return 0.0;
    if (std::abs(along + corner_ * across) >= 1.4) return 0.0;
    return height_m_ * (1.0 + lean_along_ * along + lean_across_ * across);
  }

 private:
  double length_m_, width_m_, height_m_, east_, north_, lean_along_, lean_across_, corner_;
};

/// The length at which the rms roughness is half the rock's height: longer waves would be hills.
double longest_roughness_m(const OutcropRelief& relief) {
  return std::pow(0.5 * relief.height_m / relief.roughness_at_1m_m, 1.0 / relief.hurst);
}

/// Lays fallen blocks where higher rock is near. `rock` is the rock's height over the sediment. A
/// block lies on the higher of rock and sediment.
void add_fallen_blocks(const Heightfield& field, const OutcropRelief& relief,
                       const LayerDraws& draws, std::vector<double>& rock) {
  const std::vector<double> before = rock;
  const auto standing = [&](double x, double y) {
    const auto column = std::lround(x / field.cell_east_m + 0.5 * (field.columns - 1));
    const auto row = std::lround(y / field.cell_north_m + 0.5 * (field.rows - 1));
    if (column < 0 || row < 0 || column >= field.columns || row >= field.rows) return 0.0;
    return std::max(before[field.index(static_cast<int>(column), static_cast<int>(row))], 0.0);
  };
  const double joint_m = joints_per_bed * relief.ledge_m, near_m = 2.0 * joint_m;
  const double drop_m = 0.6 * relief.ledge_m;
  if (std::ranges::max(before) <= drop_m) return;
  const double per_m2 = std::min(fallen_per_m2, max_fallen_per_block / (joint_m * joint_m));
  for_each_scattered(field, per_m2, longest_fallen_in_joints * joint_m, draws, layer_stream::fallen,
                     [&](double x, double y, const auto& u) {
                       const double foot = standing(x, y);
                       // A block falls if rock at a random distance is higher, so more blocks lie
                       // near the ledge.
                       const double away_m = u[8] * near_m, from = 2.0 * std::numbers::pi * u[9];
                       bool fell = false;
                       for (int i = 0; i < 8; ++i) {
                         const double direction = from + 0.25 * std::numbers::pi * i;
                         fell |= standing(x + away_m * std::sin(direction),
                                          y + away_m * std::cos(direction)) > foot + drop_m;
                       }
                       if (!fell) return;
                       const FallenBlock block(joint_m, u);
                       for_each_point_near(field, x, y, block.reach_m(),
                                           [&](int column, int row, double dx, double dy) {
                                             const double top = block.top_m(dx, dy);
                                             double& height = rock[field.index(column, row)];
                                             if (top > 0.0) height = std::max(height, foot + top);
                                           });
                     });
}

}  // namespace

void add_outcrops(Heightfield& field, const OutcropRelief& relief, const LayerDraws& draws,
                  std::span<const double> weight, std::span<std::uint32_t> marked) {
  check_relief(relief);
  if (relief.height_m == 0.0) return;
  Heightfield rough = field;
  std::ranges::fill(rough.z_m, 0.0);
  if (relief.roughness_at_1m_m > 0.0)
    add_fractal(rough,
                {.height_at_1m_m = relief.roughness_at_1m_m,
                 .hurst = relief.hurst,
                 .longest_m = longest_roughness_m(relief)},
                draws.of(layer_stream::rock), draws.control);
  // Below the sediment, the roughness decreases to 0 at the border of the area.
  for (std::size_t point = 0; point < rough.z_m.size(); ++point)
    rough.z_m[point] *= std::min(1.0, 2.0 * weight[point]);
  const double sinks = std::tan(relief.dip_rad);
  const double east = std::sin(relief.dip_heading_rad), north = std::cos(relief.dip_heading_rad);
  const auto eroded = [&](std::size_t point) {
    return relief.height_m * (2.0 * weight[point] - 1.0) + rough.z_m[point];
  };
  const auto bed_at = [&](double x, double y) { return -sinks * (x * east + y * north); };
  const auto nearest = [&](double x, double y) {
    const auto on = [](double index, int count) {
      return static_cast<int>(std::clamp(std::round(index), 0.0, count - 1.0));
    };
    return field.index(on(x / field.cell_east_m + 0.5 * (field.columns - 1), field.columns),
                       on(y / field.cell_north_m + 0.5 * (field.rows - 1), field.rows));
  };
  const double joint_m = joints_per_bed * relief.ledge_m, off_m = farthest_in_beds * relief.ledge_m;
  Joints joints(std::max(joint_m, 1e-3), relief.dip_heading_rad, draws);
  std::vector<double> rock(field.z_m.size());
  for (int row = 0; row < field.rows; ++row) {
    draws.control.check_stop();
    for (int column = 0; column < field.columns; ++column) {
      const std::size_t point = field.index(column, row);
      rock[point] = eroded(point);
      if (relief.ledge_m == 0.0) continue;
      // Beds are numbered across their dip. The top of each block is the top of one bed: of the
      // last bed below the eroded surface at the block's middle, or of a neighbour of this bed. The
      // block's top is tilted a little, and is at most off_m from the eroded surface.
      const double x = field.x_m(column), y = field.y_m(row);
      const Joints::Block block = joints.at(x + crooked * rough.z_m[point],
                                            y + crooked * rough.z_m[rough.z_m.size() - 1 - point]);
      const auto& u = block.draws;
      const double over = (eroded(nearest(block.middle_x, block.middle_y)) -
                           bed_at(block.middle_x, block.middle_y)) /
                              relief.ledge_m +
                          0.5 * (u[0] - 0.5);
      const double lean = leaning * (u[1] - 0.5) * block.across_m +
                          leaning_along_strike * (u[2] - 0.5) * block.along_m;
      const double open = block.edge_m / (0.06 * joint_m);
      const double crack = 0.4 * u[3] * u[3] * relief.ledge_m * std::exp(-open * open);
      const double top =
          bed_at(x, y) + relief.ledge_m * std::floor(over) + lean - crack + 0.6 * rough.z_m[point];
      rock[point] = std::clamp(top, rock[point] - off_m, rock[point] + off_m);
    }
  }
  if (relief.ledge_m > 0.0) add_fallen_blocks(field, relief, draws, rock);
  for (std::size_t point = 0; point < rock.size(); ++point) {
    if (!(rock[point] > 0.0) || weight[point] == 0.0) continue;
    field.z_m[point] += rock[point];
    marked[point] = 1;
  }
}

namespace {
ReliefKind<OutcropRelief> outcrop_kind() {
  return {
      .list = "outcrops",
      .help =
          "A layer of tilted beds of rock that stand out of the sediment in ledges. Joints part "
          "the beds into blocks, and fallen blocks lie about. Over the width border_m the rock "
          "rises from height_m below the bed to height_m above it.",
      .purpose = Purpose::outcrop_layer,
      .class_name = "outcrop",
      .material = "rough rock",
      .area = {.share = 0.3, .border_m = 30.0},  // over which the rock rises
      .add = &add_outcrops,
      .values = {
          {"height_m", "m", 0, 1000,
           "How far the rock's mean surface rises in the middle of the area; ledges, blocks and "
           "roughness rise above it. At the area's border it is level with the bed, so less than "
           "`share` is visible: 0.23 of 0.3 if border_m is as wide as patch_m.",
           &OutcropRelief::height_m},
          {"ledge_m", "m", 0, 1000,
           "Height of a ledge: a bed's thickness. Joints are four times as far apart; 0: no ledges, "
           "joints and blocks.",
           &OutcropRelief::ledge_m},
          {"dip_deg", "degrees", 0, 45, "How steeply the beds sink.", &OutcropRelief::dip_rad},
          {"dip_heading_deg", "degrees", -360, 360,
           "Direction in which they sink; ledges run across it.", &OutcropRelief::dip_heading_rad},
          {"roughness_at_1m_m", "m", 0, 100,
           "Rms height difference of points 1 m apart on the rock, in addition to its ledges.",
           &OutcropRelief::roughness_at_1m_m},
          {"hurst", "", 0.01, 0.99, "Hurst exponent of this roughness.", &OutcropRelief::hurst},
      }};
}
}  // namespace
const ReliefKind<OutcropRelief>& kind_of(const OutcropRelief&) { return made_once<outcrop_kind>(); }

}  // namespace ensonify::engine
