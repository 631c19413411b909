#include <array>

#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

/// Adds to a profile a cylinder from `back` to `front` and, ahead of it, a nose of the length
/// `nose_m`: an ogive or half an ellipse.
std::vector<Vector2d> with_nose(std::vector<Vector2d> profile, double r, double back, double front,
                                double nose_m, bool ogive) {
  profile.emplace_back(r, back);
  constexpr int steps = 7;
  for (int k = 0; k <= steps; ++k) {
    const double u = double(k) / steps;
    const double share = ogive ? 1.0 - 0.93 * u * u : std::sqrt(std::max(0.006, 1.0 - u * u));
    profile.emplace_back(r * share, front + nose_m * u);
  }
  return profile;
}

/// Turns what was made about its axis, tilts the axis, and sinks it into the bed.
void lie(FamilyForm& form, double min_sunk, double max_sunk, double tilt_deg) {
  Draws& draws = form.draws;
  const double tilt = radians(draws.between(-tilt_deg, tilt_deg));
  form.solids.move(0, motion(Vector3d::Zero(), 0.0, draws.between(0.0, 2.0 * pi), 0.0));
  form.solids.move(0, motion(Vector3d::Zero(), tilt, 0.0, 0.0));
  rest(form.solids, 0, draws.between(min_sunk, max_sunk));
}

/// Tilts what was made about both horizontal axes, and sinks it into the bed.
void tilt_and_sink(FamilyForm& form, double tilt_deg, double max_sunk) {
  const double about_y = radians(form.draws.between(-tilt_deg, tilt_deg));
  const double about_x = radians(form.draws.between(-tilt_deg, tilt_deg));
  form.solids.move(0, motion(Vector3d::Zero(), about_x, about_y, 0.0));
  rest(form.solids, 0, form.draws.between(0.0, max_sunk));
}

enum OrdnancePart { ordnance_body, ordnance_tail };

/// A tapered fin. `root` is the middle of the root chord, `out` the unit vector from root to tip.
void fin(Solids& solids, const Vector3d& root, const Vector3d& out, double span_m,
         double root_chord_m) {
  constexpr int stations = 5, points = 14;
  // Tangent of the angle by which the middle line is swept back; thickness / chord.
  constexpr double sweep = 0.3, thickness = 0.06;
  const double tip_chord_m = 0.7 * root_chord_m;
  const Vector3d along = Vector3d::UnitY(), up = out.cross(along).normalized();
  std::vector<std::vector<Vector3d>> rings;
  for (int i = 0; i <= stations; ++i) {
    const double u = double(i) / stations;
    const double chord = root_chord_m + (tip_chord_m - root_chord_m) * u;
    std::vector<Vector3d>& ring = rings.emplace_back();
    for (int k = 0; k < points; ++k) {
      const double angle = 2.0 * pi * k / points;
      // Thickest at about two fifths of the chord from the leading edge.
      const double y = 0.5 * chord * std::cos(angle);
      const double z = 0.5 * thickness * chord * std::sin(angle) * (0.75 + 0.25 * std::cos(angle));
      ring.emplace_back(root + span_m * (u * out - sweep * u * along) + y * along + z * up);
    }
  }
  solids.skin(rings);
}

void fins(FamilyForm& form, double y, double chord, double r, double reach) {
  constexpr int count = 4;
  const double turn = form.draws.between(0.0, pi);
  for (int k = 0; k < count; ++k) {
    if (form.draws.chance(0.08)) continue;  // lost
    const double angle = turn + 2.0 * pi * k / count;
    const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
    fin(form.solids, {0.3 * r * out.x(), y, 0.3 * r * out.z()}, out, reach, chord);
  }
}

/// A ring about y, open at both ends.
void ring(Solids& solids, double r, double y, double long_m, double thick_m, int sides) {
  const std::size_t mark = solids.mark();
  const std::array profile{Vector2d(r - thick_m, -0.5 * long_m), Vector2d(r, -0.5 * long_m),
                           Vector2d(r, 0.5 * long_m), Vector2d(r - thick_m, 0.5 * long_m)};
  solids.revolve(profile, sides, true);
  solids.move(mark, motion({0.0, y, 0.0}, -pi / 2, 0.0, 0.0));
}

void bomb(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m > 0.0 ? form.size_m : draws.between(1.0, 2.4);
  const double r = 0.5 * l * draws.between(0.19, 0.27);
  solids.begin_part(ordnance_body);
  turned(solids,
         with_nose({{0.25 * r, -0.4 * l}, {0.6 * r, -0.28 * l}, {0.9 * r, -0.16 * l}}, r, -0.08 * l,
                   0.22 * l, 0.28 * l, draws.chance(0.6)),
         form.sides(24));
  for (const double y : {-0.02 * l, 0.12 * l})  // suspension lugs
    solids.block({0.0, y, 1.02 * r}, {0.05 * l, 0.05 * l, 0.25 * r});
  solids.begin_part(ordnance_tail);
  if (!draws.chance(0.3)) {  // otherwise the tail was torn off on impact
    fins(form, -0.4 * l, 0.2 * l, r, 0.95 * r);
    if (draws.chance(0.5)) ring(solids, 1.0 * r, -0.43 * l, 0.12 * l, 0.06 * r, form.sides(24));
  }
  lie(form, 0.1, 0.5, 25.0);
}

void shell(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m > 0.0 ? form.size_m : draws.between(0.4, 1.4);
  const double r = 0.5 * l * draws.between(0.22, 0.3), tail = draws.between(0.0, 0.2);
  solids.begin_part(ordnance_body);
  const std::vector base{Vector2d((1.0 - tail) * r, -0.5 * l), Vector2d(r, -0.4 * l),
                         Vector2d(r, -0.36 * l),  // the driving band follows
                         Vector2d(1.05 * r, -0.35 * l), Vector2d(1.05 * r, -0.31 * l)};
  turned(solids, with_nose(base, r, -0.3 * l, 0.02 * l, 0.48 * l, true), form.sides(24));
  lie(form, 0.0, 0.5, 15.0);
}

void torpedo(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m > 0.0 ? form.size_m : draws.between(5.2, 7.4);
  const double r = 0.5 * l * draws.between(0.071, 0.085);
  solids.begin_part(ordnance_body);
  turned(solids,
         with_nose({{0.18 * r, -0.47 * l}, {0.55 * r, -0.4 * l}, {0.85 * r, -0.34 * l}}, r,
                   -0.28 * l, 0.46 * l, 0.04 * l, false),
         form.sides(24));
  solids.begin_part(ordnance_tail);
  fins(form, -0.42 * l, 0.06 * l, r, 0.9 * r);
  for (const double y : {-0.475 * l, -0.49 * l})  // two screws
    for (int k = 0; k < 3; ++k) {
      const double angle = 2.0 * pi * k / 3.0 + 40.0 * y / l;
      solids.taper({0.0, y, 0.0}, {0.75 * r * std::cos(angle), y, 0.75 * r * std::sin(angle)},
                   0.15 * r, 0.22 * r, 6);
    }
  solids.taper({0.0, -0.5 * l, 0.0}, {0.0, -0.46 * l, 0.0}, 0.12 * r, 0.16 * r, 10);
  lie(form, 0.05, 0.5, 2.0);
}

enum MinePart { mine_body, mine_fitting, mine_sinker };

void cylindrical_mine(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m > 0.0 ? form.size_m : draws.between(1.6, 3.0);
  const double r = 0.5 * std::min(0.3 * l, draws.between(0.45, 0.66));
  const double nose = r * draws.between(0.25, 1.0);
  solids.begin_part(mine_body);
  std::vector<Vector2d> profile{Vector2d(0.8 * r, -0.5 * l), Vector2d(r, -0.47 * l)};
  for (const double y : {-0.2, 0.1}) {  // bands
    profile.emplace_back(r, y * l);
    profile.emplace_back(1.03 * r, (y + 0.003) * l);
    profile.emplace_back(1.03 * r, (y + 0.02) * l);
    profile.emplace_back(r, (y + 0.023) * l);
  }
  turned(solids, with_nose(profile, r, 0.125 * l, 0.5 * l - nose, nose, false), form.sides(32));
  solids.begin_part(mine_fitting);
  if (draws.chance(0.5)) {  // the tail section of an air-dropped mine
    ring(solids, 0.98 * r, -0.53 * l, 0.12 * l, 0.06 * r, form.sides(32));
    if (draws.chance(0.6)) fins(form, -0.52 * l, 0.12 * l, r, 1.1 * r);
  }
  for (const double y : {-0.12 * l, 0.18 * l})
    solids.block({0.0, y, 1.04 * r}, {0.3 * r, 0.3 * r, 0.3 * r});
  if (draws.chance(0.4))  // the cover of the instruments
    solids.taper({0.5 * r, -0.33 * l, 0.8 * r}, {0.62 * r, -0.33 * l, 1.0 * r}, 0.35 * r, 0.3 * r,
                 form.sides());
  lie(form, 0.05, 0.5, 6.0);
}

void conical_mine(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double d = form.size_m > 0.0 ? form.size_m : draws.between(0.9, 1.05);
  const double r = 0.5 * d, high = d * draws.between(0.42, 0.5), top = r * draws.between(0.4, 0.58);
  solids.begin_part(mine_body);
  const std::array profile{Vector2d(0.94 * r, 0.0),           Vector2d(r, 0.05 * high),
                           Vector2d(r, 0.14 * high),          Vector2d(0.93 * r, 0.17 * high),
                           Vector2d(1.08 * top, 0.86 * high), Vector2d(0.9 * top, 0.95 * high),
                           Vector2d(0.45 * top, high)};
  solids.revolve(profile, form.sides(40));
  solids.begin_part(mine_fitting);
  solids.taper({0.0, 0.0, 0.95 * high}, {0.0, 0.0, 1.06 * high}, 0.35 * top, 0.3 * top,
               form.sides());
  const double turn = draws.between(0.0, pi);
  for (int k = 0; k < 3; ++k) {  // lifting lugs
    const double angle = turn + 2.0 * pi * k / 3.0, at = 0.78 * r;
    solids.block({at * std::cos(angle), at * std::sin(angle), 0.45 * high},
                 {0.06 * d, 0.06 * d, 0.14 * high});
  }
  tilt_and_sink(form, 9.0, 0.4);
}

void wedge_mine(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m > 0.0 ? form.size_m : draws.between(0.95, 1.1);
  const double w = l * draws.between(0.72, 0.85), high = l * draws.between(0.34, 0.42);
  solids.begin_part(mine_body);
  // Sections along y: low in front and highest behind the middle, with rounded corners.
  std::vector<std::vector<Vector3d>> rings;
  for (const Vector3d& at :
       {Vector3d(-0.5, 0.72, 0.8), Vector3d(-0.46, 0.92, 0.97), Vector3d(-0.2, 1.0, 1.0),
        Vector3d(0.25, 0.98, 0.6), Vector3d(0.46, 0.8, 0.28), Vector3d(0.5, 0.66, 0.22)}) {
    std::vector<Vector3d>& ring = rings.emplace_back();
    constexpr int points = 20;
    for (int k = 0; k < points; ++k) {
      const double angle = 2.0 * pi * (k + 0.5) / points;
      const auto squared = [](double v) { return std::copysign(std::pow(std::abs(v), 0.4), v); };
      ring.emplace_back(0.5 * w * at.y() * squared(std::sin(angle)), l * at.x(),
                        0.5 * high * at.z() * (1.0 + squared(std::cos(angle))));
    }
  }
  solids.skin(rings);
  solids.begin_part(mine_fitting);
  for (const double side : {-1.0, 1.0}) {
    bar(solids, {side * 0.46 * w, -0.3 * l, 0.05 * high}, {side * 0.46 * w, 0.3 * l, 0.05 * high},
        0.06 * w, 0.08 * high);  // skids
    solids.block({side * 0.3 * w, -0.3 * l, 0.97 * high}, {0.05 * l, 0.07 * l, 0.14 * high});
  }
  solids.taper({0.0, -0.15 * l, 0.9 * high}, {0.0, -0.15 * l, 1.08 * high}, 0.12 * l, 0.1 * l,
               form.sides());
  tilt_and_sink(form, 6.0, 0.35);
}

/// A contact mine with horns, above its sinker or on the bed next to it.
void moored_mine(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double d = form.size_m > 0.0 ? form.size_m : draws.between(0.85, 1.15);
  const double r = 0.5 * d, box = draws.between(0.7, 0.85) * d;
  const bool down = draws.chance(0.35);
  const std::size_t mark = solids.begin_part(mine_sinker);
  solids.block({0.0, 0.0, 0.3 * box}, {box, box, 0.6 * box});
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      solids.taper({x * 0.4 * box, y * 0.4 * box, 0.1 * box},
                   {x * 0.62 * box, y * 0.4 * box, 0.1 * box}, 0.13 * box, 0.13 * box, 12);
  rest(solids, mark, draws.between(0.05, 0.3));
  const double up = draws.between(1.5, 4.0) * d, lean = draws.between(0.0, 0.2) * up;
  const double turn = draws.between(0.0, 2.0 * pi), aside = draws.between(0.1, 1.2) * d;
  const Vector3d middle =
      down ? Vector3d((box + aside) * std::cos(turn), (box + aside) * std::sin(turn), 0.8 * r)
           : Vector3d(lean * std::cos(turn), lean * std::sin(turn), up);
  solids.begin_part(mine_fitting);
  if (!down) solids.taper({0.0, 0.0, 0.3 * box}, middle, 0.012 * d, 0.012 * d, 8);
  const double tilt = down ? draws.between(0.0, pi) : 0.2 * lean / up;
  const std::size_t from = solids.mark();
  solids.taper({0.0, 0.0, -1.12 * r}, {0.0, 0.0, -0.8 * r}, 0.35 * r, 0.45 * r, form.sides());
  for (int k = 0; k < 8; ++k) {  // horns: five above, three about the middle
    const double angle = 2.0 * pi * (k < 5 ? k / 5.0 : (k - 5) / 3.0),
                 rise = radians(k < 5 ? 45.0 : 0.0);
    const Vector3d out(std::cos(rise) * std::cos(angle), std::cos(rise) * std::sin(angle),
                       std::sin(rise));
    if (!draws.chance(0.15)) solids.taper(0.97 * r * out, 1.22 * r * out, 0.07 * r, 0.05 * r, 8);
  }
  solids.begin_part(mine_body);
  solids.ball(Vector3d::Zero(), r, 3);
  solids.move(from, motion(middle, tilt, 0.0, turn));
}

}  // namespace

void make_ordnance(FamilyForm& form) {
  if (form.variant == "bomb")
    bomb(form);
  else if (form.variant == "shell")
    shell(form);
  else
    torpedo(form);
}

void make_mine(FamilyForm& form) {
  if (form.variant == "cylindrical")
    cylindrical_mine(form);
  else if (form.variant == "conical")
    conical_mine(form);
  else if (form.variant == "wedge")
    wedge_mine(form);
  else
    moored_mine(form);
}

}  // namespace ensonify::engine
