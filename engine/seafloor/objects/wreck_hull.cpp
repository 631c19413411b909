#include <ensonify/engine/seafloor/objects/wreck.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

namespace {

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

/// Adds everything of the ship between two shares of its length.
void Wreck::stretch(double from, double to) {
  const bool from_torn = from > 0.0, to_torn = to < 1.0;
  const double rust = 1.5 - 0.75 * wear_;  // plating is missing where noise() is larger
  solids_.begin_part(hull);
  add_plating(solids_, lines_,
              {.from = from,
               .to = to,
               .stations = stations(from, to),
               .thick_m = plate_m_,
               .from_torn = from_torn,
               .to_torn = to_torn,
               .missing =
                   [&](double s, double t) {
                     return std::abs(t) > 0.3 && s > 0.04 && s < 0.96 && noise(s, t) > rust;
                   }},
              draws_);
  if (from == 0.0) {  // the plate across the stern
    const double half = lines_.half_breadth_m(0.0), keel = lines_.keel_m(0.0);
    const double top = lines_.top_m(0.0);
    solids_.block({0.0, -0.5 * length_m_ + plate_m_, 0.5 * (keel + top)},
                  {1.1 * half, plate_m_, 0.8 * (top - keel)});
  }
  inside(from, to);
  deck_of(from, to);
  upper_works(from, to);
  if (from == 0.0) stern_gear();
}

/// Frames with the beams of the deck, cargo in the holds, and sediment.
void Wreck::inside(double from, double to) {
  if (type_ == Type::submarine) return;
  const int count = std::clamp(static_cast<int>(length_m_ / 2.0), 8, 24);
  solids_.begin_part(frame);
  for (int i = 1; i < count; ++i) {
    const double s = 0.05 + 0.9 * i / count;
    const bool beam = draws_.chance(0.9 - 0.4 * wear_);
    if (s < from + 0.02 || s > to - 0.02) continue;
    rib(s, 0.0);
    if (!beam || in_hatch(s, 0.0)) continue;  // a beam is visible where the deck is missing
    const double half = lines_.half_breadth_m(s, bulwark_m_ + 3.0 * plate_m_);
    solids_.block({0.0, length_m_ * (s - 0.5), deck_m(s, 1.0) - 3.2 * plate_m_},
                  {2.0 * half - plate_m_, 3.0 * plate_m_, 3.8 * plate_m_});
  }
  solids_.begin_part(cargo);
  for (const Vector2d& hatch : hatches_)
    if (hatch.x() > from && hatch.y() < to) heap(hatch);
  if (open_ && from < 0.3 && to > 0.6) heap({0.35, 0.55});
  infill(from, to);
}

/// An uneven floor in the hull: sediment with fallen things on it.
void Wreck::infill(double from, double to) {
  solids_.begin_part(wreck_debris);
  constexpr int across_cells = 12;
  const int rows = 3 * stations(from, to);
  const double level = open_ ? draws_.between(0.35, 0.85) : draws_.between(0.25, 0.6);
  const double first = std::max(from, 0.02), last = std::min(to, 0.97);
  PlateGrid grid{.rows = rows + 1, .columns = across_cells + 1};
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= across_cells; ++c) {
      // Random shifts, because regular rows would be visible.
      const bool at_end = r == 0 || r == rows, at_side = c == 0 || c == across_cells;
      const double along = draws_.between(-0.3, 0.3), aside = draws_.between(-0.3, 0.3);
      const double s = first + (last - first) * (r + (at_end ? 0.0 : along)) / rows;
      const double across = 1.0 - 2.0 * (c + (at_side ? 0.0 : aside)) / across_cells;
      const double up =
          std::min(0.95, level + 0.1 * noise(0.6 * s, 2.0 * across) + draws_.between(-0.04, 0.04));
      // The half breadth of the hull at the lowest level of the floor.
      const double keel = lines_.keel_m(s), deep = lines_.top_m(s) - keel;
      const double half = 0.97 * lines_.half_breadth_m(s, (1.0 - level + 0.16) * deep);
      grid.add({half * across, length_m_ * (s - 0.5), keel + up * deep}, 0.08 * lines_.depth_m);
    }
  solids_.plate(grid);
}

void Wreck::rib(double s, double lost) {
  constexpr double shortest_m = 1.0;  // in a shorter ship a rib would end far outside the hull
  const double wide = 0.006 * std::max(1.0, 30.0 / std::max(length_m_, shortest_m));
  add_plating(solids_, lines_,
              {.from = s - 0.5 * wide,
               .to = s + 0.5 * wide,
               .stations = 1,
               .inset_m = 0.8 * plate_m_,
               .thick_m = 2.5 * plate_m_,
               .missing = [&](double, double t) { return std::abs(t) > 1.0 - lost; }},
              draws_);
}

/// Boxes, bales or coal in a hold.
void Wreck::heap(const Vector2d& hold) {
  const double middle = 0.5 * (hold.x() + hold.y());
  const double floor = lines_.keel_m(middle) + plate_m_, deep = lines_.depth_m;
  const double full = draws_.between(0.1, 0.6), half = 0.6 * lines_.half_breadth_m(middle);
  for (int i = 0; i < 24; ++i) {
    const std::size_t mark = solids_.mark();
    const double size = draws_.between(0.05, 0.22) * lines_.beam_m;
    solids_.block(Vector3d::Zero(), {size, draws_.between(0.6, 1.5) * size, 0.7 * size});
    const double y = length_m_ * (draws_.between(hold.x(), hold.y()) - 0.5);
    const double x = draws_.between(-half, half), up = draws_.between(0.2, 1.0) * full * deep;
    const double turn = draws_.between(0.0, pi);
    const double about_y = draws_.between(-0.3, 0.3), about_x = draws_.between(-0.3, 0.3);
    solids_.move(mark, motion({x, y, floor + up}, about_x, about_y, turn));
  }
}

void Wreck::stern_gear() {
  if (type_ == Type::barge) return;
  solids_.begin_part(machinery);
  const double high = 0.6 * lines_.depth_m, y = -0.5 * length_m_;
  solids_.block({0.0, y + 0.012 * length_m_, 0.5 * high},
                {1.5 * plate_m_, 0.025 * length_m_, high});  // rudder
  if (type_ == Type::sailing_ship) return;
  const double r = 0.3 * lines_.depth_m;
  const Vector3d hub(0.0, y + 0.05 * length_m_, 0.4 * lines_.depth_m);
  solids_.taper(hub - Vector3d(0.0, 0.3 * r, 0.0), hub + Vector3d(0.0, 0.3 * r, 0.0), 0.2 * r,
                0.2 * r, 10);
  for (int k = 0; k < 4; ++k) {
    const double angle = 0.5 * pi * k + 0.3;
    const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
    solids_.taper(hub, hub + r * out, 0.18 * r, 0.3 * r, 6);
  }
}

}  // namespace ensonify::engine
