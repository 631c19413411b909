#include <ensonify/engine/seafloor/objects/hull.h>
#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

enum BoatPart { boat_hull, boat_deck, boat_engine };

/// The tube of an inflatable, with floor and transom.
void inflatable(FamilyForm& form, double l, double beam) {
  Solids& solids = form.solids;
  const double r = 0.13 * beam, half = 0.5 * beam - r;
  std::vector<Vector3d> way;
  for (const double y : {-0.5, 0.0, 0.18}) way.emplace_back(-half, y * l, r);
  for (int k = 1; k < 8; ++k) {
    const double angle = pi * k / 8.0;
    way.emplace_back(-half * std::cos(angle), (0.2 + 0.26 * std::sin(angle)) * l,
                     r * (1.0 + 0.6 * std::sin(angle)));
  }
  for (const double y : {0.18, 0.0, -0.5}) way.emplace_back(half, y * l, r);
  solids.sweep(way, circle(r, form.sides(12)));
  solids.block({0.0, -0.05 * l, 0.5 * r}, {2.0 * half, 0.75 * l, 0.3 * r});
  solids.block({0.0, -0.42 * l, 1.1 * r}, {2.0 * half, 0.02 * l, 2.0 * r});
}

void thwarts(FamilyForm& form, const HullLines& lines, double plank_m) {
  form.solids.begin_part(boat_deck);
  for (const double s : {0.22, 0.42, 0.62}) {
    if (form.draws.chance(0.15)) continue;
    const double below = 0.3 * lines.depth_m;
    const double half = lines.half_breadth_m(s, below) - 0.5 * plank_m;
    form.solids.block({0.0, lines.length_m * (s - 0.5), lines.top_m(s) - below},
                      {2.0 * half, 0.06 * lines.length_m, 1.5 * plank_m});
  }
}

void foredeck_and_cabin(FamilyForm& form, const HullLines& lines, double plank_m) {
  Solids& solids = form.solids;
  solids.begin_part(boat_deck);
  constexpr int rows = 8;
  PlateGrid grid{.rows = rows + 1, .columns = 3};
  for (int r = 0; r <= rows; ++r) {
    const double s = 0.5 + 0.46 * r / rows;
    for (const double across : {1.0, 0.0, -1.0}) {
      grid.add({across * (lines.half_breadth_m(s) - 0.5 * plank_m), lines.length_m * (s - 0.5),
                lines.top_m(s) + 0.04 * lines.beam_m * (1.0 - across * across)},
               plank_m);
    }
  }
  solids.plate(grid);
  if (!form.draws.chance(0.6)) return;
  const double high = form.draws.between(0.5, 0.9) * lines.depth_m, l = lines.length_m;
  const double wide = 0.62 * lines.beam_m;
  std::vector<std::vector<Vector3d>> rings(2);
  for (const Vector2d& p : {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)})
    for (const double up : {0.0, 1.0})
      rings[up > 0.0 ? 1 : 0].emplace_back((0.5 - 0.08 * up) * wide * p.x(),
                                           l * (0.1 + (p.y() > 0.0 ? 0.13 - 0.06 * up : -0.13)),
                                           lines.top_m(0.6) - 0.1 * high + up * high);
  solids.skin(rings);
}

}  // namespace

void make_boat(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m;
  const std::string_view kind = form.variant;
  HullLines lines{.length_m = l, .beam_m = l * draws.between(0.3, 0.4), .depth_m = 0.0};
  lines.depth_m = lines.beam_m * draws.between(0.3, 0.42);
  lines.section = draws.between(2.2, 3.0);
  lines.bow_power = draws.between(2.0, 2.6);
  lines.stern_power = draws.between(2.5, 6.0);
  lines.stern_width = kind == "rowing" && draws.chance(0.4) ? 0.08 : draws.between(0.6, 0.85);
  lines.sheer_m = draws.between(0.15, 0.4) * lines.depth_m;
  lines.rake_m = draws.between(0.3, 0.9) * lines.depth_m;
  lines.stern_rise_m = 0.1 * lines.depth_m;
  const double plank_m = std::max(0.02, 0.015 * lines.beam_m);
  solids.begin_part(boat_hull);
  if (kind == "inflatable") {
    inflatable(form, l, lines.beam_m);
  } else {
    add_plating(solids, lines, {.thick_m = plank_m}, draws);
    const double half = lines.half_breadth_m(0.0);
    solids.block({0.0, -0.5 * l + 0.5 * plank_m, 0.5 * (lines.keel_m(0.0) + lines.top_m(0.0))},
                 {1.3 * half, 2.0 * plank_m, 0.8 * lines.depth_m});
    solids.block({0.0, -0.05 * l, -0.03 * lines.depth_m},
                 {2.0 * plank_m, 0.8 * l, 0.12 * lines.depth_m});  // keel
    if (kind == "sailing") {
      solids.begin_part(boat_deck);
      const double high = draws.between(0.6, 1.2) * l;
      if (draws.chance(0.5))
        solids.taper({0.0, 0.1 * l, 0.1 * lines.depth_m}, {0.0, 0.08 * l, high}, 0.012 * l,
                     0.008 * l, 8);
      else  // lying over the gunwale
        solids.taper({0.1 * lines.beam_m, -0.4 * l, 0.9 * lines.depth_m},
                     {1.2 * lines.beam_m, 0.4 * l, 0.8 * lines.depth_m}, 0.012 * l, 0.008 * l, 8);
    }
    if (kind == "motor" || draws.chance(0.2))
      foredeck_and_cabin(form, lines, plank_m);
    else
      thwarts(form, lines, plank_m);
  }
  solids.begin_part(boat_engine);
  if ((kind == "motor" || kind == "inflatable") && draws.chance(0.75)) {  // an outboard motor
    const double size = std::clamp(0.09 * l, 0.2, 0.5), y = -0.5 * l - 0.3 * size;
    const double top = kind == "inflatable" ? 0.3 * lines.beam_m : lines.depth_m;
    solids.block({0.0, y, top + 0.4 * size}, {0.6 * size, size, 0.9 * size});
    bar(solids, {0.0, y, top + 0.1 * size}, {0.0, y, top - 1.6 * size}, 0.35 * size, 0.2 * size);
  }
  const double drawn = draws.between(0.0, 1.0), side = draws.side();
  const double list = drawn < 0.65   ? radians(draws.between(0.0, 25.0))
                      : drawn < 0.85 ? radians(draws.between(155.0, 200.0))  // capsized
                                     : radians(draws.between(60.0, 100.0));
  solids.move(0, motion(Vector3d::Zero(), radians(draws.between(-4.0, 4.0)), side * list, 0.0));
  rest(solids, 0, draws.between(0.02, 0.3));
}

}  // namespace ensonify::engine
