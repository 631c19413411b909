#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

enum CarPart { car_body, car_wheel, car_frame };

/// A block with rounded corners, smaller at the top. y_m and z_m are the ends in y and z.
void rounded_block(Solids& solids, const Vector2d& y_m, const Vector2d& z_m, double half_m,
                   double corner, double top_inset_front_m, double top_inset_back_m) {
  std::vector<std::vector<Vector3d>> rings(2);
  constexpr int points = 20;
  const double middle = 0.5 * (y_m.x() + y_m.y()), half_long = 0.5 * (y_m.y() - y_m.x());
  const auto squared = [&](double v) { return std::copysign(std::pow(std::abs(v), corner), v); };
  for (int k = 0; k < points; ++k) {
    const double angle = 2.0 * pi * (k + 0.5) / points;
    const double x = squared(std::cos(angle)) * half_m, y = squared(std::sin(angle)) * half_long;
    const double inset = y > 0.0 ? top_inset_front_m : top_inset_back_m;
    rings[0].emplace_back(x, middle + y, z_m.x());
    rings[1].emplace_back(0.9 * x, middle + y * (half_long - inset) / half_long, z_m.y());
  }
  solids.skin(rings);
}

}  // namespace

void make_car(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m, half = 0.5 * l * draws.between(0.37, 0.41);
  const bool van = form.variant == "van", pickup = form.variant == "pickup";
  const double high = l * (van ? draws.between(0.38, 0.46) : draws.between(0.31, 0.36));
  const double sill = 0.12 * high, belt = (van ? 0.5 : 0.58) * high;
  const double wheel = 0.07 * l, axle = 0.3 * l;
  solids.begin_part(car_body);
  rounded_block(solids, {-0.5 * l, 0.5 * l}, {sill + 0.1 * wheel, belt}, half, 0.3, 0.05 * l,
                0.03 * l);
  // The cabin is closed, or only the roof and its pillars are left.
  const double front = (van ? 0.4 : 0.2) * l, back = (van ? -0.49 : pickup ? -0.06 : -0.36) * l;
  const double rake_front = (van ? 0.1 : 0.15) * l, rake_back = (van ? 0.02 : 0.08) * l;
  const bool closed = van || draws.chance(0.4);
  if (closed) {
    rounded_block(solids, {back, front}, {belt - 0.02 * high, high}, 0.92 * half, 0.35, rake_front,
                  rake_back);
  } else {
    solids.block({0.0, 0.5 * (back + rake_back + front - rake_front), high - 0.02 * high},
                 {1.6 * half, front - back - rake_front - rake_back, 0.04 * high});
    solids.begin_part(car_frame);
    const double middle = 0.5 * (front + back);
    for (const double side : {-1.0, 1.0})
      for (const Vector2d& y : {Vector2d(front, front - rake_front), Vector2d(middle, middle),
                                Vector2d(back, back + rake_back)})
        bar(solids, {side * 0.88 * half, y.x(), 0.95 * belt},
            {side * 0.78 * half, y.y(), 0.98 * high}, 0.015 * l, 0.02 * l);
    for (const double y : {0.03 * l, -0.2 * l})  // seats
      solids.block({0.0, y, belt}, {1.3 * half, 0.04 * l, 0.35 * high});
    solids.begin_part(car_body);
  }
  if (pickup)
    for (const double side : {-1.0, 1.0}) {
      solids.block({side * 0.88 * half, -0.27 * l, belt}, {0.06 * half, 0.4 * l, 0.3 * high});
      if (side < 0.0) solids.block({0.0, -0.465 * l, belt}, {1.7 * half, 0.012 * l, 0.28 * high});
    }
  for (const double side : {-1.0, 1.0})
    if (draws.chance(0.25)) {  // an open door
      const double open = draws.between(0.5, 1.2);
      const std::size_t mark = solids.mark();
      solids.block({0.0, -0.11 * l, 0.5 * (belt + sill)}, {0.02 * l, 0.22 * l, belt - sill});
      solids.move(mark, motion({side * 0.97 * half, 0.12 * l, 0.0}, 0.0, 0.0, side * open));
    }
  solids.begin_part(car_wheel);
  for (const double side : {-1.0, 1.0})
    for (const double end : {-1.0, 1.0})
      if (!draws.chance(0.08))
        solids.taper({side * 0.72 * half, end * axle, wheel},
                     {side * 1.01 * half, end * axle, wheel}, wheel, wheel, form.sides());
  const double drawn = draws.between(0.0, 1.0), side = draws.side();
  const double list = drawn < 0.6    ? radians(draws.between(0.0, 8.0))
                      : drawn < 0.85 ? radians(draws.between(172.0, 188.0))
                                     : radians(draws.between(82.0, 98.0));
  solids.move(0, motion(Vector3d::Zero(), radians(draws.between(-4.0, 4.0)), side * list, 0.0));
  rest(solids, 0, draws.between(0.05, 0.3));
}

}  // namespace ensonify::engine
