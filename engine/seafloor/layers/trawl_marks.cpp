#include <ensonify/engine/seafloor/layers/trawl_marks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

/// A sum of waves over a way; of rms 1.
struct Wander {
  static constexpr double most = 2.9;  // more than 4 / sqrt(2)
  std::array<double, 4> length_m, phase;
  double at(double way_m) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < length_m.size(); ++i)
      sum += std::sin(2.0 * pi * way_m / length_m[i] + phase[i]);
    return sum / std::sqrt(2.0);
  }
  /// A bound on its change over a metre.
  double steepest_per_m() const {
    double sum = 0.0;
    for (const double length : length_m) sum += 2.0 * pi / length;
    return sum / std::sqrt(2.0);
  }
};

class Door {
 public:
  Door(double offset_m, const RandomStream& draws) : offset_m_(offset_m) {
    std::array<double, 12> u;
    draws.uniform(u);
    for (std::size_t i = 0; i < 4; ++i) {
      wobble_.length_m[i] = 12.0 + 60.0 * u[i];
      wobble_.phase[i] = 2.0 * pi * u[4 + i];
      bite_.length_m[i] = 4.0 + 30.0 * u[4 + i];
      bite_.phase[i] = 2.0 * pi * u[8 + i];
    }
  }
  static constexpr double most_off_m = 0.25 * Wander::most;  // its mean offset
  double mean_offset_m() const { return offset_m_; }
  double offset_m(double way_m) const { return offset_m_ + 0.25 * wobble_.at(way_m); }
  /// How deep it digs, of the mean: doors bounce, and now and then leave the bed.
  double bite(double way_m) const { return std::clamp(1.0 + 0.45 * bite_.at(way_m), 0.0, 1.6); }

 private:
  double offset_m_;
  Wander wobble_{}, bite_{};
};

/// One tow.
class Tow {
 public:
  Tow(const Heightfield& grid, const TrawlMarks& marks, const LayerDraws& draws, std::int64_t i)
      : marks_(marks),
        port_(-0.5 * marks.door_spacing_m, draws.of(2, i)),
        starboard_(0.5 * marks.door_spacing_m, draws.of(3, i)) {
    std::array<double, 12> u;
    const RandomStream stream = draws.of(1, i);
    stream.uniform(u);
    std::array<double, 1> turn;
    stream.normal(turn, 16);
    x_m_ = (u[0] - 0.5) * grid.columns_in_all() * grid.cell_east_m;
    y_m_ = (u[1] - 0.5) * grid.rows_in_all() * grid.cell_north_m;
    const double heading =
        marks.heading_rad + marks.heading_spread_rad * turn[0] + (u[2] < 0.5 ? pi : 0.0);
    east_ = std::sin(heading);
    north_ = std::cos(heading);
    depth_m_ = marks.depth_m * (0.35 + 0.65 * u[3]);  // marks of several ages
    for (std::size_t w = 0; w < 4; ++w) {
      wander_.length_m[w] = 150.0 + 700.0 * u[4 + w];
      wander_.phase[w] = 2.0 * pi * u[8 + w];
    }
    sideways_per_m_ = std::abs(north_) + std::abs(east_) * marks.wander_m * wander_.steepest_per_m();
  }

  struct Change {
    double height_m = 0.0;
    std::uint32_t door = 0;  // 1 or 2, where its mark is
    double clear_m = 0.0;    // nor is there any change as far as this to the east
  };
  Change at(double x_m, double y_m) const {
    const double dx = x_m - x_m_, dy = y_m - y_m_;
    const double across = dx * north_ - dy * east_;
    const double reach = 2.0 * marks_.width_m;
    const double from_mean_door = std::abs(std::abs(across) - 0.5 * marks_.door_spacing_m);
    const double strip = Wander::most * marks_.wander_m + Door::most_off_m + reach;
    if (from_mean_door > strip) return {.clear_m = (from_mean_door - strip) / sideways_per_m_};
    const double way = dx * east_ + dy * north_;
    const double from_middle = across - marks_.wander_m * wander_.at(way);
    Change change{.clear_m = std::numeric_limits<double>::infinity()};
    for (const std::uint32_t number : {1u, 2u}) {
      const Door& door = number == 1 ? port_ : starboard_;
      const double away = std::abs(from_middle - door.mean_offset_m()) - Door::most_off_m - reach;
      change.clear_m = std::min(change.clear_m, std::max(away, 0.0) / sideways_per_m_);
      if (away > 0.0) continue;
      const double from_door = from_middle - door.offset_m(way);
      if (std::abs(from_door) > reach) continue;
      // The Gaussian's second derivative: its integral is zero.
      const double a2 = std::pow(from_door / (0.5 * marks_.width_m), 2);
      const double bite = door.bite(way);
      change.height_m -= depth_m_ * bite * (1.0 - a2) * std::exp(-0.5 * a2);
      if (bite > 0.1 && a2 < 6.0) change.door = number;
    }
    return change;
  }

 private:
  const TrawlMarks& marks_;
  Door port_, starboard_;
  double x_m_, y_m_, east_, north_, depth_m_;
  Wander wander_{};
  double sideways_per_m_;  // a bound: how fast a place to the east comes nearer to a door
};

}  // namespace

void add_trawl_marks(Heightfield& field, const TrawlMarks& marks, const LayerDraws& draws,
                     std::span<std::uint32_t> marked) {
  check_relief(marks);
  for (int i = 0; i < marks.count; ++i) {
    const Tow tow(field, marks, draws, i);
    for (int row = 0; row < field.rows; ++row)
      for (int column = 0; column < field.columns;) {
        const Tow::Change change = tow.at(field.x_m(column), field.y_m(row));
        if (change.height_m != 0.0) {
          const std::size_t point = field.index(column, row);
          field.z_m[point] += change.height_m;
          if (change.door != 0) marked[point] = 2 * static_cast<std::uint32_t>(i) + change.door;
        }
        constexpr double rounding = 1.0 - 1e-9;
        column += 1 + static_cast<int>(std::min(rounding * change.clear_m / field.cell_east_m,
                                                static_cast<double>(field.columns)));
      }
  }
}

const ReliefKind<TrawlMarks>& kind_of(const TrawlMarks&) {
  static const ReliefKind<TrawlMarks> kind{
      .list = "trawl_marks",
      .help = "A layer of paired furrows with berms, left by the doors of otter trawls.",
      .purpose = Purpose::furrow_layer,
      .class_name = "trawl_mark",
      .add = &add_trawl_marks,
      .values = {
          {"count", "", 0, 1000, "How many tows cross the seabed.", &TrawlMarks::count},
          {"depth_m", "m", 0, 10,
           "Of a fresh furrow: centimetres in sand, up to 0.4 m in mud; berms have 0.45 of it.",
           &TrawlMarks::depth_m},
          {"width_m", "m", 0.01, 100, "Of a furrow, between its berms; typically 0.2 to 2 m.",
           &TrawlMarks::width_m},
          {"door_spacing_m", "m", 0.1, 1000, "Between a pair's furrows; typically 20 to 120 m.",
           &TrawlMarks::door_spacing_m},
          {"heading_deg", "degrees", -360, 360,
           "Heading of the tows; half of them go the opposite way.", &TrawlMarks::heading_rad},
          {"heading_spread_deg", "degrees", 0, 180, "Its standard deviation.",
           &TrawlMarks::heading_spread_rad},
          {"wander_m", "m", 0, 1000, "How far, rms, a tow strays from a straight line.",
           &TrawlMarks::wander_m},
      }};
  return kind;
}

}  // namespace ensonify::engine
