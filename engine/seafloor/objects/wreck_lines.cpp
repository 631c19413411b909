#include <ensonify/engine/seafloor/objects/wreck.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

struct Range {
  double low, high;
};

/// The ranges from which the lines of a type of ship are drawn.
struct TypeOfShip {
  Range beam;   ///< beam / length
  Range depth;  ///< depth / beam
  Range section, bow, stern, stern_width;
  Range sheer, rake;  ///< sheer / depth, rake / depth
  double bow_width;
};
// clang-format off
constexpr std::array<TypeOfShip, 5> types_of_ship{{
    // beam           depth        section     bow       stern       stern width   sheer        rake        bow width
    {{0.13, 0.18},  {0.5, 0.65}, {4, 7},     {2.6, 4}, {3, 4.5},   {0.2, 0.4},   {0.1, 0.3},  {0, 0.3},   0.04},  // steamer
    {{0.19, 0.25},  {0.45, 0.6}, {2.3, 3},   {2, 2.8}, {2.5, 4},   {0.3, 0.6},   {0.3, 0.6},  {0.2, 0.5}, 0.05},  // trawler
    {{0.2, 0.3},    {0.3, 0.45}, {7, 12},    {6, 14},  {6, 14},    {0.75, 0.95}, {0, 0.08},   {0, 0.4},   0.7},  // barge
    {{0.2, 0.26},   {0.45, 0.6}, {2.0, 2.8}, {2, 2.6}, {2.2, 3.2}, {0.2, 0.4},   {0.2, 0.4},  {0.3, 0.7}, 0.04},  // sailing ship
    {{0.09, 0.115}, {0.9, 1.0},  {2.0, 2.3}, {2.2, 3}, {1.8, 2.6}, {0.06, 0.1},  {0.0, 0.05}, {0, 0.1},   0.06},  // submarine
}};
// clang-format on

}  // namespace

void Wreck::choose_lines() {
  const bool small = length_m_ < 16.0;
  const bool large = length_m_ > 40.0;
  const int draw = draws_.one_of(4);
  if (large)
    type_ = draws_.chance(0.12)  ? Type::submarine
            : draws_.chance(0.5) ? Type::steamer
                                 : static_cast<Type>(draw);
  else
    type_ = static_cast<Type>(small ? 1 + draw % 3 : draw);
  const TypeOfShip& ranges = types_of_ship[static_cast<std::size_t>(type_)];
  const auto drawn = [&](const Range& range) { return draws_.between(range.low, range.high); };
  lines_.length_m = length_m_;
  lines_.beam_m = drawn(ranges.beam) * length_m_;
  lines_.depth_m = drawn(ranges.depth) * lines_.beam_m;
  lines_.section = drawn(ranges.section);
  lines_.end_section = std::min(lines_.section, type_ == Type::barge ? 6.0 : 1.6);
  lines_.bow_power = drawn(ranges.bow);
  lines_.stern_power = drawn(ranges.stern);
  lines_.stern_width = drawn(ranges.stern_width);
  lines_.bow_width = ranges.bow_width;
  lines_.sheer_m = drawn(ranges.sheer) * lines_.depth_m;
  lines_.rake_m = drawn(ranges.rake) * lines_.depth_m;
  lines_.stern_rise_m = draws_.between(0.2, 0.55) * lines_.depth_m;
  plate_m_ = std::clamp(0.012 * lines_.beam_m, 0.03, 0.15);
  open_ = type_ != Type::submarine && draws_.chance(length_m_ < 16.0 ? 0.6 : 0.4);
  bulwark_m_ = std::min(1.1, 0.18 * lines_.depth_m);
  wear_ = draws_.between(0.0, 1.0);
  for (double& phase : phases_) phase = draws_.between(0.0, 2.0 * pi);
  house_length_ = draws_.between(0.1, 0.2);
  house_at_ = draws_.chance(0.6) ? draws_.between(0.42, 0.56) : 0.16;
}

/// Smooth noise along (s) and around (t) the hull, between -1.35 and 1.35.
double Wreck::noise(double s, double t) const {
  return 0.45 *
         (std::cos(19.0 * s + 5.0 * t + phases_[0]) + std::cos(31.0 * s - 9.0 * t + phases_[1]) +
          std::cos(53.0 * s + 15.0 * t + phases_[2]));
}

int Wreck::stations(double from, double to) {
  return std::max(3, static_cast<int>(std::lround(32.0 * (to - from))));
}

double Wreck::deck_m(double s, double across) const {  // across: -1 to 1
  const double camber = 0.02 * lines_.beam_m;
  return lines_.top_m(s) - bulwark_m_ - camber * across * across;
}

bool Wreck::in_hatch(double s, double across) const {
  if (type_ == Type::submarine || std::abs(across) > 0.52) return false;
  return std::ranges::any_of(hatches_,
                             [&](const Vector2d& hatch) { return s > hatch.x() && s < hatch.y(); });
}

void Wreck::choose_hatches() {
  hatches_.clear();
  const double cabin = house_at();
  for (const double at : {0.2, 0.38, 0.62, 0.78}) {
    const double half = draws_.between(0.04, 0.065);
    const bool has = draws_.chance(type_ == Type::barge ? 0.95 : 0.7);
    if (has && std::abs(at - cabin) > half + 0.5 * house_length_ + 0.02)
      hatches_.emplace_back(at - half, at + half);
  }
}

double Wreck::house_at() const {
  const std::array at{house_at_, 0.3, 0.1, 0.17, 0.55};  // in the order of Type
  return at[static_cast<std::size_t>(type_)];
}

}  // namespace ensonify::engine
