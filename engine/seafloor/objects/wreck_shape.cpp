#include <ensonify/engine/seafloor/objects/wreck.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;

Wreck::Wreck(FamilyForm& form)
    : variant_(form.variant),
      draws_(form.draws),
      solids_(form.solids),
      sides_(form.sides()),
      length_m_(form.size_m) {
  choose_lines();
}

void Wreck::make() {
  if (variant_ == "broken")
    broken();
  else if (variant_ == "collapsed")
    collapsed();
  else if (variant_ == "frames")
    frames_alone();
  else
    whole();
}

/// Turns everything since a mark by list, trim and heading, and sinks it into the bed.
void Wreck::lie(std::size_t mark, double list, double trim, double heading, double sunk_m,
                const Vector2d& place) {
  solids_.move(mark, motion({0.0, 0.0, -0.5 * lines_.depth_m}));
  solids_.move(mark, motion(Vector3d::Zero(), 0.0, list, 0.0));
  solids_.move(mark, motion({place.x(), place.y(), 0.0}, trim, 0.0, heading));
  // By the lowest point of the midship section, because a mast over the side may be lower.
  double low = 0.0;
  for (int k = -16; k <= 16; ++k) {
    const Vector3d p = lines_.point(0.5, k / 16.0);
    low = std::min(low, (p.z() - 0.5 * lines_.depth_m) * std::cos(list) - p.x() * std::sin(list));
  }
  solids_.move(mark, motion({0.0, 0.0, -low - sunk_m}));
}

void Wreck::whole() {
  choose_hatches();
  const double side = draws_.side();
  const double list =
      variant_ == "listing"
          ? radians(draws_.chance(0.5) ? draws_.between(15.0, 50.0) : draws_.between(60.0, 105.0))
          : radians(draws_.between(0.0, 9.0));
  const double depth = lines_.depth_m, reach = draws_.between(0.0, 0.7);
  const double trim = draws_.side() * reach * depth / (0.5 * length_m_);  // one end buried
  const std::size_t mark = solids_.begin_part(hull);
  stretch(0.0, 1.0);
  lie(mark, side * list, trim, 0.0, (draws_.between(0.05, 0.3) + 0.6 * reach) * depth, {0.0, 0.0});
  field(10 + draws_.one_of(40), 1.1);
}

void Wreck::broken() {
  choose_hatches();
  const double at = draws_.between(0.3, 0.7), gap = draws_.between(0.0, 0.1) * length_m_;
  for (const bool bow : {false, true}) {
    const std::size_t mark = solids_.mark();
    stretch(bow ? at : 0.0, bow ? 1.0 : at);
    // Move the middle of this half to the origin.
    const double middle = length_m_ * (0.5 * (bow ? at + 1.0 : at) - 0.5);
    solids_.move(mark, motion({0.0, -middle, 0.0}));
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
  solids_.move(mark, motion({0.0, length_m_ * (at - 0.5), 0.0}));
}

/// A wooden ship of which the frames, the bottom and the keelson are left.
void Wreck::frames_alone() {
  open_ = true;
  const std::size_t mark = solids_.begin_part(hull);
  const double left = draws_.between(0.15, 0.45);
  add_plating(solids_, lines_,
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
  bar(solids_, {0.0, -0.47 * length_m_, 0.0}, {0.0, -0.48 * length_m_, 0.8 * stem}, 4.0 * plate_m_,
      5.0 * plate_m_);
  solids_.begin_part(cargo);
  if (draws_.chance(0.6)) heap({0.35, 0.6});  // ballast
  const double sunk_m = draws_.between(0.0, 0.25) * lines_.depth_m;
  lie(mark, radians(draws_.between(-25.0, 25.0)), 0.0, 0.0, sunk_m, {0.0, 0.0});
  field(15 + draws_.one_of(40), 1.0);
}

/// A ship whose sides have fallen outwards; boilers, engine, bow and stern stand higher.
void Wreck::collapsed() {
  open_ = true;
  const HullLines ship = lines_;
  std::size_t mark = solids_.begin_part(hull);
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
  solids_.move(mark, motion({0.0, 0.0, -0.5 * lines_.depth_m}));
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
    solids_.move(mark, motion({0.0, -middle, 0.0}));
    const double sunk_m = draws_.between(0.15, 0.4) * lines_.depth_m;
    const double heading = radians(draws_.between(-20.0, 20.0));
    const double side = draws_.side(), list = side * radians(draws_.between(20.0, 95.0));
    lie(mark, list, 0.0, heading, sunk_m, {0.0, middle});
  }
  field(40 + draws_.one_of(60), 0.9);
}

void Wreck::fallen_sides() {
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

void Wreck::engine_room() {
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
    solids_.taper({0.0, y - 1.1 * r * (i - 1), 0.5 * high}, {0.0, y - 1.1 * r * (i - 1), high}, r_i,
                  r_i, 12);
  }
  solids_.block({0.0, y, 0.3 * high}, {0.9 * r, 3.4 * r, 0.6 * high});
  solids_.taper({0.0, y - 1.7 * r, 0.25 * r}, {0.0, -0.42 * length_m_, 0.25 * r}, 0.1 * r, 0.1 * r,
                8);
}

void Wreck::field(int count, double reach) {
  solids_.begin_part(wreck_debris);
  scatter_debris(solids_, count, std::min(0.35 * lines_.beam_m, 5.0),
                 {reach * lines_.beam_m, 0.48 * length_m_}, draws_);
}

void make_wreck(FamilyForm& form) { Wreck(form).make(); }

}  // namespace ensonify::engine
