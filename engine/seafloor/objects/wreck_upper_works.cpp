#include <ensonify/engine/seafloor/objects/wreck.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

void Wreck::deck_of(double from, double to) {
  if (type_ == Type::submarine) {
    submarine_deck(from, to);
    return;
  }
  if (open_) return;
  solids_.begin_part(deck);
  constexpr int across_cells = 8;
  const int rows = 2 * stations(from, to);
  const double rot = 1.3 - 1.1 * wear_;
  PlateGrid grid{.rows = rows + 1, .columns = across_cells + 1};
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
      grid.add({half * across, y, z}, plate_m_);
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

void Wreck::coamings(double from, double to) {
  const double high = std::clamp(0.1 * lines_.depth_m, 0.2, 1.0);
  for (const Vector2d& hatch : hatches_) {
    if (hatch.x() <= from || hatch.y() >= to) continue;
    const double middle = 0.5 * (hatch.x() + hatch.y());
    const double half = 0.52 * lines_.half_breadth_m(middle), z = deck_m(middle, 0.5) + 0.4 * high;
    const double y = length_m_ * (middle - 0.5), long_m = length_m_ * (hatch.y() - hatch.x());
    for (const double side : {-1.0, 1.0}) {
      solids_.block({side * half, y, z}, {plate_m_, long_m, high});
      solids_.block({0.0, y + 0.5 * side * long_m, z}, {2.02 * half, plate_m_, 0.98 * high});
    }
  }
}

void Wreck::submarine_deck(double from, double to) {
  solids_.begin_part(deck);
  constexpr int rows = 12, columns = 4;
  PlateGrid grid{.rows = rows + 1, .columns = columns + 1};
  const double low = std::max(from, 0.06), high = std::min(to, 0.95);
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double s = low + (high - low) * r / rows, across = 1.0 - 2.0 * double(c) / columns;
      const double half = 1.0 * lines_.half_breadth_m(s), y = length_m_ * (s - 0.5);
      const double z = lines_.top_m(s) + 0.12 * lines_.beam_m * (1.0 - 0.9 * across * across);
      grid.add({0.97 * half * across, y, z}, 0.13 * lines_.beam_m);
    }
  solids_.plate(grid);
}

void Wreck::upper_works(double from, double to) {
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

void Wreck::house(double at) {
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
                    {0.0, y - 0.4 * house_length_ * length_m_ - 0.1 * high, base + tier + high}, r,
                    r, sides_);
  }
}

/// A prism with rounded ends.
void Wreck::tower(const Vector3d& foot, double half_wide_m, double long_m, double high_m) {
  std::vector<std::vector<Vector3d>> rings(2);
  for (const Vector2d& p : circle(1.0, 20))
    for (std::size_t i = 0; i < 2; ++i)
      rings[i].push_back(foot + Vector3d((i ? 0.85 : 1.0) * half_wide_m * p.x(),
                                         0.5 * (i ? 0.85 : 1.0) * long_m * p.y(),
                                         i ? high_m : 0.0));
  solids_.skin(rings);
}

void Wreck::forecastle() {
  constexpr int rows = 6;
  PlateGrid grid{.rows = rows + 1, .columns = 3};
  const double from = 0.86;
  for (int r = 0; r <= rows; ++r) {
    const double s = from + (0.985 - from) * r / rows;
    for (const double across : {1.0, 0.0, -1.0}) {
      const double z = lines_.top_m(s) + 0.02 * lines_.beam_m * (1.0 - across * across);
      grid.add(
          {0.99 * lines_.half_breadth_m(s) * across,
           length_m_ * (s - 0.5) + lines_.rake_m * std::pow((s - 0.8) / 0.2, 2.0) * (s > 0.8), z},
          plate_m_);
    }
  }
  solids_.plate(grid);
}

/// Masts that are upright, broken off, or fallen over the side.
void Wreck::masts(double from, double to) {
  if (type_ == Type::barge || type_ == Type::submarine) return;
  solids_.begin_part(mast);
  const bool sailing = type_ == Type::sailing_ship;
  const std::array<double, 3> at{0.72, sailing ? 0.45 : 0.25, 0.2};
  const int count = sailing ? 2 + draws_.one_of(2) : 1 + draws_.one_of(2);
  for (int i = 0; i < count; ++i) {
    const double s = at[static_cast<std::size_t>(i)];
    const double high = length_m_ * draws_.between(0.25, sailing ? 0.6 : 0.4);
    const double state = draws_.between(0.0, 1.0), side = draws_.side();
    const double fall = draws_.between(0.8, 1.5), swing = draws_.between(-0.6, 0.6);
    if (s < from + 0.02 || s > to - 0.02) continue;
    const double r = std::max(0.05, 0.012 * high), base = deck_m(s, 0.0) - 0.2 * lines_.depth_m;
    const Vector3d foot(0.0, length_m_ * (s - 0.5), base);
    if (state < 0.35) {
      solids_.taper(foot, foot + Vector3d(0.0, -0.04 * high, high), r, 0.5 * r, 8);
      if (!sailing)  // a derrick boom
        solids_.taper(foot + Vector3d(0.0, 0.0, 0.25 * high),
                      foot + Vector3d(0.0, 0.5 * high * side, 0.45 * high), 0.6 * r, 0.5 * r, 8);
    } else {
      solids_.taper(foot, foot + Vector3d(0.0, 0.0, (0.2 + 0.3 * state) * high), r, 0.9 * r, 8);
      if (state < 0.8) {  // fallen over the side
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
void Wreck::deck_gear(double from, double to) {
  if (open_ || type_ == Type::submarine) return;
  solids_.begin_part(machinery);
  const int count = 2 + draws_.one_of(4);
  for (int i = 0; i < count; ++i) {
    const double s = draws_.between(0.1, 0.92), across = draws_.between(-0.5, 0.5);
    const double size = std::clamp(0.07 * lines_.beam_m, 0.2, 1.2) * draws_.between(0.6, 1.4);
    if (s < from + 0.03 || s > to - 0.03) continue;
    const Vector3d at(across * lines_.half_breadth_m(s), length_m_ * (s - 0.5), deck_m(s, across));
    solids_.block(at + Vector3d(0.0, 0.0, 0.4 * size), {size, 0.8 * size, size});
    solids_.taper(at + Vector3d(-0.9 * size, 0.0, 0.6 * size),
                  at + Vector3d(0.9 * size, 0.0, 0.6 * size), 0.35 * size, 0.35 * size, 10);
  }
}

/// Remains of the rail along the gunwale: posts, and pieces of its upper bar.
void Wreck::rails(double from, double to) {
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

/// Planks and boxes that have fallen on the deck, or on the bottom of an open hull.
void Wreck::clutter(double from, double to) {
  if (type_ == Type::submarine) return;
  solids_.begin_part(wreck_debris);
  const int count = static_cast<int>((to - from) * draws_.between(35.0, 60.0 + 70.0 * wear_));
  for (int i = 0; i < count; ++i) {
    const std::size_t mark = solids_.mark();
    const double s = draws_.between(from + 0.04, to - 0.04);
    const double across = draws_.between(-0.9, 0.9), long_m = draws_.between(0.04, 0.3);
    const double thick = std::clamp(0.03 * lines_.beam_m, 0.06, 0.6) * draws_.between(0.4, 1.6);
    const bool box = draws_.chance(0.3), beam = draws_.chance(0.5);
    // Half of the pieces lie nearly across or along the ship.
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

}  // namespace ensonify::engine
