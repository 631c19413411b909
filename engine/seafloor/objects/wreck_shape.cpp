#include <array>

#include <ensonify/engine/seafloor/objects/hull.h>
#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

enum WreckPart { hull, deck, superstructure, mast, frame, cargo, machinery, wreck_debris };

/// Makes one wreck. While its parts are made, the ship stands upright with its keel at z = 0.
class Wreck {
 public:
  explicit Wreck(FamilyForm& form)
      : variant_(form.variant),
        draws_(form.draws),
        solids_(form.solids),
        sides_(form.sides()),
        length_m_(form.size_m) {
    choose_lines();
  }

  void make() {
    if (variant_ == "broken")
      broken();
    else if (variant_ == "collapsed")
      collapsed();
    else if (variant_ == "frames")
      frames_alone();
    else
      whole();
  }

 private:
  enum class Type { steamer, trawler, barge, sailing_ship, submarine };

  void choose_lines() {
    const bool small = length_m_<16.0, large = length_m_> 40.0;
    static constexpr std::array any{Type::steamer, Type::trawler, Type::barge, Type::sailing_ship,
                                    Type::submarine};
    const int draw = draws_.one_of(4);
    type_ = large ? any[static_cast<std::size_t>(draws_.chance(0.12)  ? 4
                                                 : draws_.chance(0.5) ? 0
                                                                      : draw)]
                  : any[static_cast<std::size_t>(small ? 1 + draw % 3 : draw)];
    struct Range {
      double low, high;
    };
    struct Lines {
      Range beam, depth, section, bow, stern, stern_width, sheer, rake;
      double bow_width;
    };
    static constexpr std::array<Lines, 5> of_type{{{{0.13, 0.18},
                                                    {0.5, 0.65},
                                                    {4, 7},
                                                    {2.6, 4},
                                                    {3, 4.5},
                                                    {0.2, 0.4},
                                                    {0.1, 0.3},
                                                    {0, 0.3},
                                                    0.04},
                                                   {{0.19, 0.25},
                                                    {0.45, 0.6},
                                                    {2.3, 3},
                                                    {2, 2.8},
                                                    {2.5, 4},
                                                    {0.3, 0.6},
                                                    {0.3, 0.6},
                                                    {0.2, 0.5},
                                                    0.05},
                                                   {{0.2, 0.3},
                                                    {0.3, 0.45},
                                                    {7, 12},
                                                    {6, 14},
                                                    {6, 14},
                                                    {0.75, 0.95},
                                                    {0, 0.08},
                                                    {0, 0.4},
                                                    0.7},
                                                   {{0.2, 0.26},
                                                    {0.45, 0.6},
                                                    {2.0, 2.8},
                                                    {2, 2.6},
                                                    {2.2, 3.2},
                                                    {0.2, 0.4},
                                                    {0.2, 0.4},
                                                    {0.3, 0.7},
                                                    0.04},
                                                   {{0.09, 0.115},
                                                    {0.9, 1.0},
                                                    {2.0, 2.3},
                                                    {2.2, 3},
                                                    {1.8, 2.6},
                                                    {0.06, 0.1},
                                                    {0.0, 0.05},
                                                    {0, 0.1},
                                                    0.06}}};
    const Lines& ranges = of_type[static_cast<std::size_t>(type_)];
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

  // ---- The ship upright.

  /// Smooth noise along and around the hull, about -1 to 1.
  double noise(double s, double t) const {
    return 0.45 *
           (std::cos(19.0 * s + 5.0 * t + phases_[0]) + std::cos(31.0 * s - 9.0 * t + phases_[1]) +
            std::cos(53.0 * s + 15.0 * t + phases_[2]));
  }

  /// What a stretch of the ship is made of, from stern (0) to bow (1).
  void stretch(double from, double to) {
    const bool from_torn = from > 0.0, to_torn = to < 1.0;
    const double rust = 1.5 - 0.75 * wear_;  // the noise above which plating is gone
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
    if (from == 0.0) transom();
    inside(from, to);
    deck_of(from, to);
    upper_works(from, to);
    if (from == 0.0) stern_gear();
  }

  static int stations(double from, double to) {
    return std::max(3, static_cast<int>(std::lround(32.0 * (to - from))));
  }

  /// The plate across the stern.
  void transom() {
    const double half = lines_.half_breadth_m(0.0), keel = lines_.keel_m(0.0);
    const double top = lines_.top_m(0.0);
    solids_.block({0.0, -0.5 * length_m_ + plate_m_, 0.5 * (keel + top)},
                  {1.1 * half, plate_m_, 0.8 * (top - keel)});
  }

  double deck_m(double s, double across) const {  // across: -1 to 1
    const double camber = 0.02 * lines_.beam_m;
    return lines_.top_m(s) - bulwark_m_ - camber * across * across;
  }

  bool in_hatch(double s, double across) const {
    if (type_ == Type::submarine || std::abs(across) > 0.52) return false;
    return std::ranges::any_of(
        hatches_, [&](const Vector2d& hatch) { return s > hatch.x() && s < hatch.y(); });
  }

  void choose_hatches() {
    hatches_.clear();
    const double cabin = house_at();
    for (const double at : {0.2, 0.38, 0.62, 0.78}) {
      const double half = draws_.between(0.04, 0.065);
      const bool has = draws_.chance(type_ == Type::barge ? 0.95 : 0.7);
      if (has && std::abs(at - cabin) > half + 0.5 * house_length_ + 0.02)
        hatches_.emplace_back(at - half, at + half);
    }
  }

  double house_at() const {
    switch (type_) {
      case Type::steamer: return house_at_;
      case Type::trawler: return 0.3;
      case Type::barge: return 0.1;
      case Type::sailing_ship: return 0.17;
      case Type::submarine: break;
    }
    return 0.55;
  }

  /// Frames, and in the holds the cargo and the machinery.
  void inside(double from, double to) {
    if (type_ == Type::submarine) return;
    const int count = std::clamp(static_cast<int>(length_m_ / 2.0), 8, 24);
    solids_.begin_part(frame);
    for (int i = 1; i < count; ++i) {
      const double s = 0.05 + 0.9 * i / count;
      const bool beam = draws_.chance(0.9 - 0.4 * wear_);
      if (s < from + 0.02 || s > to - 0.02) continue;
      rib(s, 0.0);
      if (!beam || in_hatch(s, 0.0)) continue;  // of the deck, which shows where the deck is gone
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

  /// Sediment, and what has fallen on it: an uneven floor in the hull.
  void infill(double from, double to) {
    solids_.begin_part(wreck_debris);
    constexpr int across_cells = 12;
    const int rows = 3 * stations(from, to);
    const double level = open_ ? draws_.between(0.35, 0.85) : draws_.between(0.25, 0.6);
    const double first = std::max(from, 0.02), last = std::min(to, 0.97);
    PlateGrid grid{
        .rows = rows + 1, .columns = across_cells + 1, .front = {}, .back = {}, .cut = {}};
    for (int r = 0; r <= rows; ++r)
      for (int c = 0; c <= across_cells; ++c) {
        // Random shifts, because regular rows would be visible.
        const bool at_end = r == 0 || r == rows, at_side = c == 0 || c == across_cells;
        const double along = draws_.between(-0.3, 0.3), aside = draws_.between(-0.3, 0.3);
        const double s = first + (last - first) * (r + (at_end ? 0.0 : along)) / rows;
        const double across = 1.0 - 2.0 * (c + (at_side ? 0.0 : aside)) / across_cells;
        const double up = std::min(
            0.95, level + 0.1 * noise(0.6 * s, 2.0 * across) + draws_.between(-0.04, 0.04));
        // The hull's half breadth where the floor is lowest.
        const double keel = lines_.keel_m(s), deep = lines_.top_m(s) - keel;
        const double half = 0.97 * lines_.half_breadth_m(s, (1.0 - level + 0.16) * deep);
        const Vector3d at(half * across, length_m_ * (s - 0.5), keel + up * deep);
        grid.front.push_back(at);
        grid.back.emplace_back(at - Vector3d(0.0, 0.0, 0.08 * lines_.depth_m));
      }
    solids_.plate(grid);
  }

  void rib(double s, double lost) {
    const double wide = 0.006 * std::max(1.0, 30.0 / length_m_);
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
  void heap(const Vector2d& hold) {
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

  void deck_of(double from, double to) {
    if (type_ == Type::submarine) {
      submarine_deck(from, to);
      return;
    }
    if (open_) return;
    solids_.begin_part(deck);
    constexpr int across_cells = 8;
    const int rows = 2 * stations(from, to);
    const double rot = 1.3 - 1.1 * wear_;
    PlateGrid grid{
        .rows = rows + 1, .columns = across_cells + 1, .front = {}, .back = {}, .cut = {}};
    for (int r = 0; r <= rows; ++r)
      for (int c = 0; c <= across_cells; ++c) {
        const double s = std::clamp(from + (to - from) * r / rows, 0.01, 0.97);
        const double across = 1.0 - 2.0 * double(c) / across_cells;  // from starboard to port
        const double torn = (r == 0 && from > 0.0) || (r == rows && to < 1.0)
                                ? draws_.between(-0.4, 0.4) * (to - from) / rows
                                : 0.0;
        const double z = deck_m(s, across);
        const double half = lines_.half_breadth_m(s, lines_.top_m(s) - z) - 0.3 * plate_m_;
        const double y = length_m_ * ((r == 0      ? std::max(from, 0.005)
                                       : r == rows ? std::min(to, 0.985)
                                                   : s) +
                                      torn - 0.5);
        grid.front.emplace_back(half * across, y, z);
        grid.back.emplace_back(half * across, y, z - plate_m_);
      }
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < across_cells; ++c) {
        const double s = from + (to - from) * (r + 0.5) / rows;
        const double across = 1.0 - 2.0 * (c + 0.5) / across_cells;
        grid.cut.push_back(in_hatch(s, across) || noise(0.7 * s, 2.0 * across) > rot);
      }
    solids_.plate(grid);
    coamings(from, to);
  }

  void coamings(double from, double to) {
    const double high = std::clamp(0.1 * lines_.depth_m, 0.2, 1.0);
    for (const Vector2d& hatch : hatches_) {
      if (hatch.x() <= from || hatch.y() >= to) continue;
      const double middle = 0.5 * (hatch.x() + hatch.y());
      const double half = 0.52 * lines_.half_breadth_m(middle),
                   z = deck_m(middle, 0.5) + 0.4 * high;
      const double y = length_m_ * (middle - 0.5), long_m = length_m_ * (hatch.y() - hatch.x());
      for (const double side : {-1.0, 1.0}) {
        solids_.block({side * half, y, z}, {plate_m_, long_m, high});
        solids_.block({0.0, y + 0.5 * side * long_m, z}, {2.02 * half, plate_m_, 0.98 * high});
      }
    }
  }

  void submarine_deck(double from, double to) {
    solids_.begin_part(deck);
    constexpr int rows = 12, columns = 4;
    PlateGrid grid{.rows = rows + 1, .columns = columns + 1, .front = {}, .back = {}, .cut = {}};
    const double low = std::max(from, 0.06), high = std::min(to, 0.95);
    for (int r = 0; r <= rows; ++r)
      for (int c = 0; c <= columns; ++c) {
        const double s = low + (high - low) * r / rows, across = 1.0 - 2.0 * double(c) / columns;
        const double half = 1.0 * lines_.half_breadth_m(s), y = length_m_ * (s - 0.5);
        const double z = lines_.top_m(s) + 0.12 * lines_.beam_m * (1.0 - 0.9 * across * across);
        grid.front.emplace_back(0.97 * half * across, y, z);
        grid.back.emplace_back(0.97 * half * across, y, z - 0.13 * lines_.beam_m);
      }
    solids_.plate(grid);
  }

  void upper_works(double from, double to) {
    const double at = house_at();
    solids_.begin_part(superstructure);
    if (at > from + 0.03 && at < to - 0.03 && !open_ && !draws_.chance(0.35 * wear_)) house(at);
    if (to == 1.0 && type_ != Type::barge && type_ != Type::submarine && draws_.chance(0.6))
      forecastle();
    masts(from, to);
    deck_gear(from, to);
    rails(from, to);
    clutter(from, to);
  }

  void house(double at) {
    const double beam = lines_.beam_m, base = deck_m(at, 0.0), y = length_m_ * (at - 0.5);
    if (type_ == Type::submarine) {
      const double high = draws_.between(0.35, 0.6) * beam;
      tower({0.0, y, base + bulwark_m_}, 0.22 * beam, 0.9 * beam, high + 0.15 * beam);
      solids_.begin_part(mast);
      solids_.taper({0.0, y + 0.2 * beam, base},
                    {0.0, y + 0.2 * beam, base + 1.6 * high + bulwark_m_}, 0.04 * beam, 0.03 * beam,
                    8);
      return;
    }
    const double tier = std::clamp(0.3 * lines_.depth_m, 1.0, 2.5);
    const int tiers = type_ == Type::steamer ? 2 + draws_.one_of(2) : 1 + draws_.one_of(2);
    double wide = 0.8 * 2.0 * lines_.half_breadth_m(at), long_m = house_length_ * length_m_;
    double z = base - 0.1 * tier;
    for (int i = 0; i < tiers; ++i) {
      const double lean = wear_ * draws_.between(-0.08, 0.08) * (i + 1);
      const std::size_t mark = solids_.mark();
      solids_.block({0.0, 0.0, 0.5 * tier}, {wide, long_m, 1.05 * tier});
      solids_.move(mark, motion({0.0, y + 0.1 * long_m * i, z}, 0.5 * lean, lean, 0.0));
      z += tier;
      wide *= draws_.between(0.65, 0.9);
      long_m *= draws_.between(0.5, 0.75);
    }
    if (type_ == Type::steamer || type_ == Type::trawler) {
      const double r = 0.07 * beam, high = draws_.between(1.5, 3.0) * tier;
      if (!draws_.chance(0.5 * wear_))
        solids_.taper({0.0, y - 0.4 * house_length_ * length_m_, base},
                      {0.0, y - 0.4 * house_length_ * length_m_ - 0.1 * high, base + tier + high},
                      r, r, sides_);
    }
  }

  /// A prism with rounded ends.
  void tower(const Vector3d& foot, double half_wide_m, double long_m, double high_m) {
    std::vector<std::vector<Vector3d>> rings(2);
    for (const Vector2d& p : circle(1.0, 20))
      for (std::size_t i = 0; i < 2; ++i)
        rings[i].push_back(foot + Vector3d((i ? 0.85 : 1.0) * half_wide_m * p.x(),
                                           0.5 * (i ? 0.85 : 1.0) * long_m * p.y(),
                                           i ? high_m : 0.0));
    solids_.skin(rings);
  }

  void forecastle() {
    constexpr int rows = 6;
    PlateGrid grid{.rows = rows + 1, .columns = 3, .front = {}, .back = {}, .cut = {}};
    const double from = 0.86;
    for (int r = 0; r <= rows; ++r) {
      const double s = from + (0.985 - from) * r / rows;
      for (const double across : {1.0, 0.0, -1.0}) {
        const double z = lines_.top_m(s) + 0.02 * lines_.beam_m * (1.0 - across * across);
        const Vector3d at(
            0.99 * lines_.half_breadth_m(s) * across,
            length_m_ * (s - 0.5) + lines_.rake_m * std::pow((s - 0.8) / 0.2, 2.0) * (s > 0.8), z);
        grid.front.push_back(at);
        grid.back.emplace_back(at - Vector3d(0.0, 0.0, plate_m_));
      }
    }
    solids_.plate(grid);
  }

  /// Masts that stand, are broken off, or have fallen over the side.
  void masts(double from, double to) {
    if (type_ == Type::barge || type_ == Type::submarine) return;
    solids_.begin_part(mast);
    const bool sailing = type_ == Type::sailing_ship;
    const std::array<double, 3> at{0.72, sailing ? 0.45 : 0.25, 0.2};
    const int count = sailing ? 2 + draws_.one_of(2) : 1 + draws_.one_of(2);
    for (int i = 0; i < count; ++i) {
      const double s = at[static_cast<std::size_t>(i)];
      const double high = length_m_ * draws_.between(0.25, sailing ? 0.6 : 0.4);
      const double fate = draws_.between(0.0, 1.0), side = draws_.side();
      const double fall = draws_.between(0.8, 1.5), swing = draws_.between(-0.6, 0.6);
      if (s < from + 0.02 || s > to - 0.02) continue;
      const double r = std::max(0.05, 0.012 * high), base = deck_m(s, 0.0) - 0.2 * lines_.depth_m;
      const Vector3d foot(0.0, length_m_ * (s - 0.5), base);
      if (fate < 0.35) {
        solids_.taper(foot, foot + Vector3d(0.0, -0.04 * high, high), r, 0.5 * r, 8);
        if (!sailing)  // a derrick boom
          solids_.taper(foot + Vector3d(0.0, 0.0, 0.25 * high),
                        foot + Vector3d(0.0, 0.5 * high * side, 0.45 * high), 0.6 * r, 0.5 * r, 8);
      } else {
        solids_.taper(foot, foot + Vector3d(0.0, 0.0, (0.2 + 0.3 * fate) * high), r, 0.9 * r, 8);
        if (fate < 0.8) {  // fallen over the side
          const Vector3d across(side * lines_.half_breadth_m(s), 0.0, lines_.top_m(s) - base);
          const Vector3d way =
              Vector3d(side * std::cos(swing), std::sin(swing), -0.2 * fall).normalized();
          solids_.taper(foot + across - 0.35 * high * way, foot + across + 0.45 * high * way, r,
                        0.5 * r, 8);
        }
      }
    }
  }

  /// Winches, anchors and ventilators on the deck.
  void deck_gear(double from, double to) {
    if (open_ || type_ == Type::submarine) return;
    solids_.begin_part(machinery);
    const int count = 2 + draws_.one_of(4);
    for (int i = 0; i < count; ++i) {
      const double s = draws_.between(0.1, 0.92), across = draws_.between(-0.5, 0.5);
      const double size = std::clamp(0.07 * lines_.beam_m, 0.2, 1.2) * draws_.between(0.6, 1.4);
      if (s < from + 0.03 || s > to - 0.03) continue;
      const Vector3d at(across * lines_.half_breadth_m(s), length_m_ * (s - 0.5),
                        deck_m(s, across));
      solids_.block(at + Vector3d(0.0, 0.0, 0.4 * size), {size, 0.8 * size, size});
      solids_.taper(at + Vector3d(-0.9 * size, 0.0, 0.6 * size),
                    at + Vector3d(0.9 * size, 0.0, 0.6 * size), 0.35 * size, 0.35 * size, 10);
    }
  }

  /// What is left of the rail along the gunwale: posts, and pieces of its upper bar.
  void rails(double from, double to) {
    if (type_ == Type::barge || type_ == Type::submarine) return;
    solids_.begin_part(hull);
    const double thick = 0.8 * plate_m_, high = std::min(1.0, 0.15 * lines_.depth_m);
    const double standing = draws_.between(0.2, 1.0 - 0.4 * wear_);
    const int count = std::clamp(static_cast<int>(length_m_ / 2.0), 8, 40);
    for (const double side : {-1.0, 1.0})
      for (int i = 0; i < count; ++i) {
        const bool stands = draws_.chance(standing);
        const double s = 0.08 + 0.86 * i / count, next = s + 0.86 / count;
        if (!stands || s < from + 0.02 || next > to - 0.02) continue;
        const auto top = [&](double at) {
          return Vector3d(0.97 * side * lines_.half_breadth_m(at), length_m_ * (at - 0.5),
                          lines_.top_m(at) + high);
        };
        bar(solids_, top(s) - Vector3d(0.0, 0.0, 1.2 * high), top(s), thick, thick);
        bar(solids_, top(s), top(next), thick, thick);
      }
  }

  /// What has fallen on the deck, or on the bottom of an open hull: planks, pipes and boxes.
  void clutter(double from, double to) {
    if (type_ == Type::submarine) return;
    solids_.begin_part(wreck_debris);
    const int count = static_cast<int>((to - from) * draws_.between(35.0, 60.0 + 70.0 * wear_));
    for (int i = 0; i < count; ++i) {
      const std::size_t mark = solids_.mark();
      const double s = draws_.between(from + 0.04, to - 0.04);
      const double across = draws_.between(-0.9, 0.9), long_m = draws_.between(0.04, 0.3);
      const double thick = std::clamp(0.03 * lines_.beam_m, 0.06, 0.6) * draws_.between(0.4, 1.6);
      const bool box = draws_.chance(0.3), beam = draws_.chance(0.5);
      // Half of them fell nearly across or along the ship.
      double turn = beam ? 0.5 * pi * draws_.one_of(2) : draws_.between(0.0, pi);
      if (beam) turn += draws_.between(-0.15, 0.15);
      const double lean = draws_.between(-0.4, 0.4);
      if (!open_ && in_hatch(s, across)) continue;
      const double floor = open_ ? lines_.keel_m(s) + 0.15 * lines_.depth_m : deck_m(s, across);
      const double wide = open_ ? 0.6 : 1.0;
      solids_.block(Vector3d::Zero(),
                    {box ? 3.0 * thick : long_m * lines_.beam_m, box ? 2.0 * thick : thick, thick});
      solids_.move(mark, motion({wide * across * lines_.half_breadth_m(s), length_m_ * (s - 0.5),
                                 floor + 0.6 * thick},
                                0.0, lean, turn));
    }
  }

  void stern_gear() {
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

  // ---- What became of it.

  /// Turns and sinks in what was made from a mark on: by its list, trim and heading.
  void lie(std::size_t mark, double list, double trim, double heading, double sunk_m,
           const Vector2d& place) {
    solids_.move(mark, motion({0.0, 0.0, -0.5 * lines_.depth_m}, 0.0, 0.0, 0.0));
    Eigen::Isometry3d turn = motion(Vector3d::Zero(), 0.0, list, 0.0);
    solids_.move(mark, turn);
    turn = motion({place.x(), place.y(), 0.0}, trim, 0.0, heading);
    solids_.move(mark, turn);
    // The lowest of the hull, not of a mast that lies over the side.
    const double low_m = lowest_of_hull(list);
    solids_.move(mark, motion({0.0, 0.0, -low_m - sunk_m}, 0.0, 0.0, 0.0));
  }

  /// The lowest point of the midship section about its middle, with a list.
  double lowest_of_hull(double list) const {
    double low = 0.0;
    for (int k = -16; k <= 16; ++k) {
      const Vector3d p = lines_.point(0.5, k / 16.0);
      low = std::min(low, (p.z() - 0.5 * lines_.depth_m) * std::cos(list) - p.x() * std::sin(list));
    }
    return low;
  }

  void whole() {
    choose_hatches();
    const double side = draws_.side();
    const double list =
        variant_ == "listing"
            ? radians(draws_.chance(0.5) ? draws_.between(15.0, 50.0) : draws_.between(60.0, 105.0))
            : radians(draws_.between(0.0, 9.0));
    const double depth = lines_.depth_m, reach = draws_.between(0.0, 0.7);
    const double trim = draws_.side() * reach * depth / (0.5 * length_m_);  // one end buried
    solids_.begin_part(hull);
    const std::size_t mark = solids_.mark();
    stretch(0.0, 1.0);
    lie(mark, side * list, trim, 0.0, (draws_.between(0.05, 0.3) + 0.6 * reach) * depth,
        {0.0, 0.0});
    field(10 + draws_.one_of(40), 1.1);
  }

  void broken() {
    choose_hatches();
    const double at = draws_.between(0.3, 0.7), gap = draws_.between(0.0, 0.1) * length_m_;
    for (const bool bow : {false, true}) {
      const std::size_t mark = solids_.mark();
      if (bow)
        stretch(at, 1.0);
      else
        stretch(0.0, at);
      // About its own middle.
      const double middle = length_m_ * (0.5 * (bow ? at + 1.0 : at) - 0.5);
      solids_.move(mark, motion({0.0, -middle, 0.0}, 0.0, 0.0, 0.0));
      const bool upright = draws_.chance(0.6);
      const double side = draws_.side();
      const double list =
          side * radians(upright ? draws_.between(0.0, 25.0) : draws_.between(50.0, 100.0));
      const double heading = radians(draws_.between(-35.0, 35.0));
      const double aside = draws_.between(-0.5, 0.5) * lines_.beam_m;
      const double trim = radians(draws_.between(-5.0, 5.0));
      lie(mark, list, trim, heading, draws_.between(0.1, 0.4) * lines_.depth_m,
          {aside, middle + (bow ? 0.5 : -0.5) * gap});
    }
    const std::size_t mark = solids_.mark();
    field(25 + draws_.one_of(50), 1.3);
    solids_.move(mark, motion({0.0, length_m_ * (at - 0.5), 0.0}, 0.0, 0.0, 0.0));
  }

  /// The frames of a wooden ship stand out of the bed, over the bottom and the keelson.
  void frames_alone() {
    open_ = true;
    const std::size_t mark = solids_.mark();
    solids_.begin_part(hull);
    const double left = draws_.between(0.15, 0.45);
    add_plating(
        solids_, lines_,
        {.from = 0.03,
         .to = 0.97,
         .stations = 28,
         .thick_m = plate_m_,
         .missing = [&](double s,
                        double t) { return std::abs(t) > left + 0.25 * noise(s, 0.3 * t); }},
        draws_);
    solids_.begin_part(frame);
    const int count = std::clamp(static_cast<int>(length_m_ / 0.9), 14, 44);
    const double standing = draws_.between(0.65, 1.0);
    for (int i = 0; i <= count; ++i) {
      const double s = 0.05 + 0.9 * i / count;
      if (draws_.chance(0.12)) continue;
      rib(s,
          std::clamp(1.0 - standing + 0.25 * noise(s, 0.0) + draws_.between(-0.1, 0.1), 0.0, 0.85));
    }
    bar(solids_, {0.0, -0.47 * length_m_, 3.0 * plate_m_}, {0.0, 0.48 * length_m_, 3.0 * plate_m_},
        5.0 * plate_m_, 5.0 * plate_m_);
    const double stem = lines_.depth_m * draws_.between(0.5, 1.1);
    bar(solids_, {0.0, 0.47 * length_m_, 0.0}, {0.0, 0.49 * length_m_ + 0.5 * lines_.rake_m, stem},
        4.0 * plate_m_, 5.0 * plate_m_);
    bar(solids_, {0.0, -0.47 * length_m_, 0.0}, {0.0, -0.48 * length_m_, 0.8 * stem},
        4.0 * plate_m_, 5.0 * plate_m_);
    solids_.begin_part(cargo);
    if (draws_.chance(0.6)) heap({0.35, 0.6});  // ballast
    const double sunk_m = draws_.between(0.0, 0.25) * lines_.depth_m;
    lie(mark, radians(draws_.between(-25.0, 25.0)), 0.0, 0.0, sunk_m, {0.0, 0.0});
    field(15 + draws_.one_of(40), 1.0);
  }

  /// The sides have fallen outwards over the bottom; boilers, engine and the ends stand out.
  void collapsed() {
    open_ = true;
    const HullLines ship = lines_;
    solids_.begin_part(hull);
    std::size_t mark = solids_.mark();
    lines_.depth_m *= draws_.between(0.12, 0.25);
    lines_.sheer_m = 0.0;
    lines_.stern_rise_m *= 0.2;
    add_plating(solids_, lines_,
                {.from = 0.1,
                 .to = 0.88,
                 .stations = 26,
                 .thick_m = plate_m_,
                 .from_torn = true,
                 .to_torn = true,
                 .missing = [&](double s, double t) { return noise(s, t) > 0.75; }},
                draws_);
    solids_.begin_part(frame);
    for (int i = 0; i < 16; ++i)
      if (const double s = draws_.between(0.15, 0.85); !draws_.chance(0.3))
        rib(s, draws_.between(0.0, 0.4));
    solids_.move(mark, motion({0.0, 0.0, -0.5 * lines_.depth_m}, 0.0, 0.0, 0.0));
    lines_ = ship;
    fallen_sides();
    engine_room();
    const std::array<Vector2d, 2> ends{Vector2d(0.0, draws_.between(0.08, 0.16)),
                                       Vector2d(1.0 - draws_.between(0.1, 0.2), 1.0)};
    hatches_.clear();
    for (const Vector2d& end : ends) {
      if (draws_.chance(0.2)) continue;
      mark = solids_.mark();
      stretch(end.x(), end.y());
      const double middle = length_m_ * (0.5 * (end.x() + end.y()) - 0.5);
      solids_.move(mark, motion({0.0, -middle, 0.0}, 0.0, 0.0, 0.0));
      const double sunk_m = draws_.between(0.15, 0.4) * lines_.depth_m;
      const double heading = radians(draws_.between(-20.0, 20.0));
      const double side = draws_.side(), list = side * radians(draws_.between(20.0, 95.0));
      lie(mark, list, 0.0, heading, sunk_m, {0.0, middle});
    }
    field(40 + draws_.one_of(60), 0.9);
  }

  void fallen_sides() {
    solids_.begin_part(hull);
    const int count = 10 + draws_.one_of(8);
    for (int i = 0; i < count; ++i) {
      const std::size_t mark = solids_.mark();
      const double s = draws_.between(0.15, 0.85), side = draws_.side();
      const double wide = draws_.between(0.5, 1.0) * lines_.depth_m;
      const double long_m = draws_.between(0.06, 0.16) * length_m_;
      const double twist_m = draws_.between(-0.1, 0.1) * wide;
      const double bend_m = draws_.between(-0.05, 0.1) * wide;
      bent_plate(solids_, wide, long_m, plate_m_, bend_m, twist_m, true, draws_);
      const double away = lines_.half_breadth_m(s) * draws_.between(0.2, 1.15);
      const double tilt = side * draws_.between(-0.15, 0.7), heading = draws_.between(-0.3, 0.3);
      solids_.move(mark, motion({side * away, length_m_ * (s - 0.5), 0.0}, 0.0, tilt, heading));
      rest(solids_, mark, draws_.between(0.05, 0.3));
    }
  }

  void engine_room() {
    solids_.begin_part(machinery);
    const double beam = lines_.beam_m, at = length_m_ * (draws_.between(0.35, 0.6) - 0.5);
    if (type_ == Type::barge || type_ == Type::sailing_ship) {  // a windlass and an anchor's chain
      bar(solids_, {-0.2 * beam, at, 0.1 * beam}, {0.2 * beam, at, 0.1 * beam}, 0.12 * beam,
          0.12 * beam);
      return;
    }
    const int boilers = 1 + draws_.one_of(3);
    const double r = draws_.between(0.1, 0.17) * beam, long_m = draws_.between(1.6, 2.4) * r;
    for (int i = 0; i < boilers; ++i) {
      const std::size_t mark = solids_.mark();
      const std::array profile{Vector2d(0.9 * r, -0.5 * long_m), Vector2d(r, -0.45 * long_m),
                               Vector2d(r, 0.45 * long_m), Vector2d(0.9 * r, 0.5 * long_m)};
      turned(solids_, profile, sides_);
      const double x = (i - 0.5 * (boilers - 1)) * 2.15 * r + draws_.between(-0.2, 0.2) * r;
      const double turn = draws_.between(-0.2, 0.2), y = at + draws_.between(0.0, 0.5) * r;
      solids_.move(mark, motion({x, y, 0.0}, 0.0, 0.0, turn));
      rest(solids_, mark, draws_.between(0.05, 0.25));
    }
    const double y = at - 1.4 * long_m, high = draws_.between(1.8, 2.8) * r;
    for (int i = 0; i < 3; ++i) {  // the cylinders of a triple-expansion engine on their bed plate
      const double r_i = r * (0.35 + 0.12 * i);
      solids_.taper({0.0, y - 1.1 * r * (i - 1), 0.5 * high}, {0.0, y - 1.1 * r * (i - 1), high},
                    r_i, r_i, 12);
    }
    solids_.block({0.0, y, 0.3 * high}, {0.9 * r, 3.4 * r, 0.6 * high});
    solids_.taper({0.0, y - 1.7 * r, 0.25 * r}, {0.0, -0.42 * length_m_, 0.25 * r}, 0.1 * r,
                  0.1 * r, 8);
  }

  void field(int count, double reach) {
    solids_.begin_part(wreck_debris);
    scatter_debris(solids_, count, std::min(0.35 * lines_.beam_m, 5.0),
                   {reach * lines_.beam_m, 0.48 * length_m_}, draws_);
  }

  std::string_view variant_;
  Draws& draws_;
  Solids& solids_;
  int sides_;
  double length_m_;
  Type type_ = Type::steamer;
  HullLines lines_{};
  double plate_m_ = 0.1, bulwark_m_ = 1.0, wear_ = 0.0;
  double house_length_ = 0.16, house_at_ = 0.5;
  bool open_ = false;
  std::array<double, 3> phases_{};
  std::vector<Vector2d> hatches_;
};

}  // namespace

void make_wreck(FamilyForm& form) { Wreck(form).make(); }

}  // namespace ensonify::engine
