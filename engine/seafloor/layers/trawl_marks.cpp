#include <ensonify/engine/seafloor/layers/trawl_marks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/seafloor/bed/catmull_rom.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

/// A sum of waves along the way of a tow, with an rms of 1.
struct Wander {
  static constexpr double most = 2.9;  // no value is larger: 4 / sqrt(2), rounded up
  std::array<double, 4> length_m, phase;
  double at(double way_m) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < length_m.size(); ++i)
      sum += std::sin(2.0 * pi * way_m / length_m[i] + phase[i]);
    return sum / std::sqrt(2.0);
  }
};

struct Stretch {
  double from_m, to_m;
};

/// The values of a Wander along a stretch, interpolated between points. In a window of a bed the
/// values have the same bits as in the whole bed.
class WanderAlong {
 public:
  WanderAlong(const Wander& wander, const Stretch& stretch)
      : first_(std::floor(stretch.from_m / step_m)) {
    const auto count = static_cast<std::size_t>(std::ceil(stretch.to_m / step_m) - first_) + 2;
    for (std::size_t i = 0; i < count; ++i)
      values_.push_back(wander.at((first_ + static_cast<double>(i)) * step_m));
  }
  double at(double way_m) const {
    const double place = way_m / step_m, before = std::floor(place);
    const auto i = static_cast<std::size_t>(before - first_);
    return std::lerp(values_[i], values_[i + 1], place - before);
  }

 private:
  static constexpr double step_m = 1.0;  // the waves are at least 150 m long
  double first_;
  std::vector<double> values_;
};

/// The fine furrows of the sweeps and the ground gear: normal numbers of variance 1, interpolated
/// (catmull_rom) on a lattice whose cells are narrow across the way and long along it.
class Sweep {
 public:
  Sweep(const LayerDraws& draws, std::int64_t tow, const Stretch& stretch, double half_width_m,
        double cell_m)
      : across_m_(std::max(0.3, 2.0 * cell_m)),
        first_row_(std::floor(stretch.from_m / along_m) - 1.0),
        first_column_(std::floor(-half_width_m / across_m_) - 1.0),
        columns_(static_cast<std::size_t>(std::ceil(half_width_m / across_m_) - first_column_) +
                 3) {
    const double rows = std::ceil(stretch.to_m / along_m) - first_row_ + 3.0;
    numbers_.resize(static_cast<std::size_t>(rows) * columns_);
    for (std::size_t row = 0; row * columns_ < numbers_.size(); ++row)
      draws
          .of(layer_stream::sweeps, tow,
              static_cast<std::int64_t>(first_row_) + static_cast<std::int64_t>(row))
          .normal(std::span(numbers_).subspan(row * columns_, columns_));
    for (double& number : numbers_) number *= catmull_rom_keeps_variance;
  }
  double at(double way_m, double across_m) const {
    const double along = way_m / along_m, before = std::floor(along);
    const double aside = across_m / across_m_, port = std::floor(aside);
    const auto row = static_cast<std::size_t>(before - first_row_);
    const auto column = static_cast<std::size_t>(port - first_column_);
    const auto of_row = catmull_rom(along - before), of_column = catmull_rom(aside - port);
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 4; ++k)
        sum += of_row[i] * of_column[k] * numbers_[(row - 1 + i) * columns_ + column - 1 + k];
    return sum;
  }

 private:
  static constexpr double along_m = 12.0;
  double across_m_, first_row_, first_column_;
  std::size_t columns_;
  std::vector<double> numbers_;
};

class Door {
 public:
  Door(double offset_m, const RandomStream& draws) : offset_m_(offset_m) {
    std::array<double, 12> u;
    draws.uniform(u);
    for (std::size_t i = 0; i < 4; ++i) {
      wobble_.length_m[i] = 40.0 + 110.0 * u[i];
      wobble_.phase[i] = 2.0 * pi * u[4 + i];
      bite_.length_m[i] = 4.0 + 30.0 * u[4 + i];
      bite_.phase[i] = 2.0 * pi * u[8 + i];
    }
  }
  static constexpr double max_off_m = 0.25 * Wander::most;  // greatest change of the offset
  double mean_offset_m() const { return offset_m_; }
  double offset_m(double way_m) const { return offset_m_ + 0.25 * wobble_.at(way_m); }
  /// Depth of the furrow / mean depth: doors bounce, and sometimes leave the bed.
  double bite(double way_m) const { return std::clamp(1.0 + 0.45 * bite_.at(way_m), 0.0, 1.6); }

 private:
  double offset_m_;
  Wander wobble_{}, bite_{};
};

class Tow {
 public:
  Tow(const Heightfield& grid, const TrawlMarks& marks, const LayerDraws& draws, std::int64_t i)
      : marks_(marks),
        port_(-0.5 * marks.door_spacing_m, draws.of(layer_stream::port_doors, i)),
        starboard_(0.5 * marks.door_spacing_m, draws.of(layer_stream::starboard_doors, i)) {
    std::array<double, 12> u;
    const RandomStream stream = draws.of(layer_stream::tows, i);
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
    Wander wander{};
    for (std::size_t w = 0; w < 4; ++w) {
      wander.length_m[w] = 150.0 + 700.0 * u[4 + w];
      wander.phase[w] = 2.0 * pi * u[8 + w];
    }
    const double west = grid.x_m(0), east = grid.x_m(grid.columns - 1);
    const double south = grid.y_m(0), north = grid.y_m(grid.rows - 1);
    const auto [from_m, to_m] =
        std::minmax({way(west, south), way(west, north), way(east, south), way(east, north)});
    const Stretch stretch{from_m, to_m};
    wander_.emplace(wander, stretch);
    if (marks.sweep_depth_m > 0.0)
      sweep_.emplace(draws, i, stretch, 0.5 * marks.door_spacing_m,
                     std::max(grid.cell_east_m, grid.cell_north_m));
  }

  struct Change {
    double height_m = 0.0;
    std::uint32_t door = 0;  // 1 or 2 if the place is in the mark of a door
    double clear_m = 0.0;    // there is no change for this distance to the east
  };
  Change at(double x_m, double y_m) const {
    const double across = (x_m - x_m_) * north_ - (y_m - y_m_) * east_;
    const double half_m = 0.5 * marks_.door_spacing_m, reach_m = 2.0 * marks_.width_m;
    const double beyond_m =
        std::abs(across) - half_m - Wander::most * marks_.wander_m - Door::max_off_m - reach_m;
    if (beyond_m > 0.0) return {.clear_m = beyond_m / std::abs(north_)};
    const double way_m = way(x_m, y_m);
    const double from_middle = across - marks_.wander_m * wander_->at(way_m);
    Change change;
    if (const double off = from_middle / half_m; sweep_ && std::abs(off) < 1.0)
      change.height_m = marks_.sweep_depth_m * (1.0 - off * off) * sweep_->at(way_m, from_middle);
    for (const std::uint32_t number : {1u, 2u}) {
      const Door& door = number == 1 ? port_ : starboard_;
      if (std::abs(from_middle - door.mean_offset_m()) > Door::max_off_m + reach_m) continue;
      const double from_door = from_middle - door.offset_m(way_m);
      if (std::abs(from_door) > reach_m) continue;
      // The second derivative of a Gaussian, because its integral is zero.
      const double a2 = std::pow(from_door / (0.5 * marks_.width_m), 2);
      const double bite = door.bite(way_m);
      change.height_m -= depth_m_ * bite * (1.0 - a2) * std::exp(-0.5 * a2);
      if (bite > 0.1 && a2 < 6.0) change.door = number;
    }
    return change;
  }

 private:
  double way(double x_m, double y_m) const { return (x_m - x_m_) * east_ + (y_m - y_m_) * north_; }

  const TrawlMarks& marks_;
  Door port_, starboard_;
  double x_m_, y_m_, east_, north_, depth_m_;
  std::optional<WanderAlong> wander_;
  std::optional<Sweep> sweep_;
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

namespace {
ReliefKind<TrawlMarks> trawl_mark_kind() {
  return {
      .list = "trawl_marks",
      .help = "A layer of paired furrows with berms, left by the doors of otter trawls.",
      .purpose = Purpose::furrow_layer,
      .class_name = "trawl_mark",
      .add = &add_trawl_marks,
      .size_m = &TrawlMarks::width_m,
      .values = {
          {"count", "", 0, 1000, "How many tows cross the seabed.", &TrawlMarks::count},
          {"depth_m", "m", 0, 10,
           "Depth of a fresh furrow: centimetres in sand, up to 0.4 m in mud; berms have 0.45 of it.",
           &TrawlMarks::depth_m},
          {"width_m", "m", 0.01, 100, "Width of a furrow between its berms; typically 0.2 to 2 m.",
           &TrawlMarks::width_m},
          {"door_spacing_m", "m", 0.1, 1000,
           "Distance between the furrows of a pair; typically 20 to 120 m.",
           &TrawlMarks::door_spacing_m},
          {"sweep_depth_m", "m", 0, 1,
           "Rms height, midway between the doors, of the fine furrows that the sweeps and the ground "
           "gear leave; 0: none.",
           &TrawlMarks::sweep_depth_m},
          {"heading_deg", "degrees", -360, 360,
           "Heading of the tows; half of them go the opposite way.", &TrawlMarks::heading_rad},
          {"heading_spread_deg", "degrees", 0, 180, "Standard deviation of the heading.",
           &TrawlMarks::heading_spread_rad},
          {"wander_m", "m", 0, 1000, "How far, rms, a tow strays from a straight line.",
           &TrawlMarks::wander_m},
      }};
}
}  // namespace
const ReliefKind<TrawlMarks>& kind_of(const TrawlMarks&) { return made_once<trawl_mark_kind>(); }

}  // namespace ensonify::engine
