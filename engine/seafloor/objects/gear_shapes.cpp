#include <array>

#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

void make_cable_drum(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double d = form.size_m, r = 0.5 * d, w = d * draws.between(0.45, 0.75);
  const double flange = 0.05 * d, core = r * draws.between(0.35, 0.5),
               full = draws.between(0.0, 1.0);
  const int sides = form.sides(40);
  // The drum is made with its axle along y, and turned below.
  enum { flanges, cable };
  solids.begin_part(flanges);
  for (const double side : {-1.0, 1.0}) {
    const double y = side * 0.5 * (w - flange);
    turned(solids, std::array{Vector2d(r, y - 0.5 * flange), Vector2d(r, y + 0.5 * flange)}, sides);
    turned(solids,
           std::array{Vector2d(0.12 * r, y - 0.7 * flange), Vector2d(0.12 * r, y + 0.7 * flange)},
           12);
  }
  turned(
      solids,
      std::array{Vector2d(core, -0.5 * w + 0.4 * flange), Vector2d(core, 0.5 * w - 0.4 * flange)},
      sides);
  solids.begin_part(cable);
  if (full > 0.25) {  // turns of the cable
    const double wound = core + (0.9 * r - core) * full, inner = w - 2.0 * flange;
    const int turns = std::max(4, static_cast<int>(inner / std::max(0.05, 0.035 * d)));
    std::vector<Vector2d> profile;
    for (int k = 0; k <= 2 * turns; ++k)
      profile.emplace_back(wound - (k % 2 ? 0.0 : 0.012 * d),
                           inner * (double(k) / (2 * turns) - 0.5));
    turned(solids, profile, sides);
  }
  if (draws.chance(0.3) && full > 0.25)  // a loose end
    solids.taper({r * 0.5, 0.1 * w, -0.8 * r}, {r * 0.7, 0.2 * w, 0.9 * r}, 0.015 * d, 0.015 * d,
                 8);
  const bool lying = form.variant == "lying";
  const double lean = radians(draws.between(-8.0, 8.0));
  // If the drum lies, the axle is horizontal; otherwise it is upright.
  solids.move(0, lying ? motion(Vector3d::Zero(), pi / 2 + lean, 0.0, 0.0)
                       : motion(Vector3d::Zero(), 0.0, draws.between(0.0, pi), pi / 2));
  if (!lying) solids.move(0, motion(Vector3d::Zero(), 0.0, lean, 0.0));
  rest(solids, 0, draws.between(0.02, 0.2));
}

void make_ladder(FamilyForm& form) {
  enum { rail, rung };
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m, w = std::min(draws.between(0.35, 0.5), 0.3 * l);
  const double bend = draws.chance(0.4) ? l * draws.between(0.02, 0.1) : 0.0;
  const double sweep = draws.chance(0.3) ? l * draws.between(-0.08, 0.08) : 0.0;
  const auto at = [&](double side, double v) {
    return Vector3d(side * 0.5 * w + 4.0 * sweep * v * v, l * v, 4.0 * bend * v * v);
  };
  solids.begin_part(rail);
  for (const double side : {-1.0, 1.0}) {
    std::vector<Vector3d> way;
    for (int k = 0; k <= 8; ++k) way.push_back(at(side, k / 8.0 - 0.5));
    solids.sweep(way, rectangle(0.03, 0.07));
  }
  solids.begin_part(rung);
  const int rungs = std::max(4, static_cast<int>(l / 0.28));
  for (int k = 0; k < rungs; ++k) {
    const double v = (k + 0.5) / rungs - 0.5;
    if (!draws.chance(0.06)) solids.taper(at(-1.0, v), at(1.0, v), 0.016, 0.016, 8);
  }
  solids.move(0, motion(Vector3d::Zero(), 0.0, radians(draws.between(-12.0, 12.0)), 0.0));
  rest(solids, 0, draws.between(0.0, 0.3));
}

void make_mooring(FamilyForm& form) {
  enum { sinker, line, buoy };
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double high = form.size_m,
               size = std::clamp(0.2 * high, 0.4, 1.2) * draws.between(0.7, 1.3);
  const std::size_t mark = solids.begin_part(sinker);
  if (draws.chance(0.6)) {
    std::vector<std::vector<Vector3d>> rings(2);
    for (const Vector2d& p : {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)})
      for (std::size_t i = 0; i < 2; ++i)
        rings[i].emplace_back((i ? 0.4 : 0.5) * size * p.x(), (i ? 0.4 : 0.5) * size * p.y(),
                              i ? 0.6 * size : 0.0);
    solids.skin(rings);
  } else {
    solids.taper(Vector3d::Zero(), {0.0, 0.0, 0.35 * size}, 0.6 * size, 0.5 * size, form.sides());
  }
  rest(solids, mark, draws.between(0.1, 0.6));
  // The line bends in the current. Chain lies in a heap around its lower end.
  solids.begin_part(line);
  const double lean = draws.between(0.0, 0.5) * high, turn = draws.between(0.0, 2.0 * pi);
  const double rope = std::clamp(0.008 * high, 0.012, 0.04), r = draws.between(0.05, 0.09) * high;
  const auto at = [&](double v) {
    const double out = lean * v * v;
    return Vector3d(out * std::cos(turn), out * std::sin(turn),
                    0.25 * size + v * (high - r - 0.25 * size));
  };
  std::vector<Vector3d> way;
  for (int k = 0; k <= 10; ++k) way.push_back(at(k / 10.0));
  solids.sweep(way, circle(rope, 8), Vector3d::UnitX());
  std::vector<Vector3d> heap;
  const double bight = draws.between(0.5, 1.2) * size;
  for (int k = 0; k <= 14; ++k) {
    const double angle = 0.45 * k;
    heap.emplace_back(bight * (0.5 + 0.05 * k) * std::cos(angle),
                      bight * (0.5 + 0.05 * k) * std::sin(angle), 1.2 * rope);
  }
  solids.sweep(heap, circle(1.6 * rope, 8));
  solids.begin_part(buoy);
  if (draws.chance(0.7)) {
    solids.ball(at(1.0), r, 3);
  } else {
    const std::size_t from = solids.mark();
    solids.taper({0.0, 0.0, -1.4 * r}, {0.0, 0.0, 1.4 * r}, 0.7 * r, 0.7 * r, form.sides());
    solids.move(from, motion(at(1.0) - Vector3d(0.0, 0.0, 0.4 * r), 0.1, 0.1, 0.0));
  }
  if (draws.chance(0.4)) solids.ball(at(draws.between(0.4, 0.8)), 0.5 * r, 2);
}

}  // namespace ensonify::engine
