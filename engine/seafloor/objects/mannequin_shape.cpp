#include <array>

#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

/// A limb of two bones with round joints.
void limb(Solids& solids, const Vector3d& from, const Vector3d& joint, const Vector3d& to,
          double r_from, double r_joint, double r_to, int sides) {
  solids.taper(from, joint, r_from, r_joint, sides);
  solids.taper(joint, to, r_joint, r_to, sides);
  solids.ball(from, 1.02 * r_from, 2);
  solids.ball(joint, 1.02 * r_joint, 2);
  solids.ball(to, 1.1 * r_to, 2);
}

}  // namespace

void make_mannequin(FamilyForm& form) {
  enum { torso, head, limbs };
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m;
  const int sides = form.sides();
  // Proportions of an adult (Drillis and Contini 1966), lying on the back, the head towards y.
  const double hip = 0.03 * l, shoulder = 0.318 * l, z = 0.06 * l;
  const double drawn = draws.between(0.0, 1.0);
  const bool on_back = drawn < 0.5, on_side = drawn >= 0.8;
  solids.begin_part(torso);
  std::vector<std::vector<Vector3d>> rings;
  const std::array<Vector3d, 5> trunk{Vector3d(0.07, 0.0, 0.05), Vector3d(0.1, 0.04, 0.06),
                                      Vector3d(0.08, 0.15, 0.055), Vector3d(0.115, 0.28, 0.06),
                                      Vector3d(0.06, 0.33, 0.045)};
  for (const Vector3d& at : trunk) {
    std::vector<Vector3d>& ring = rings.emplace_back();
    for (const Vector2d& p : circle(1.0, sides))
      ring.emplace_back(at.x() * l * p.y(), at.y() * l, z + at.z() * l * p.x());
  }
  solids.skin(rings);
  solids.begin_part(head);
  solids.taper({0.0, 0.32 * l, z}, {0.0, 0.38 * l, z}, 0.03 * l, 0.03 * l, sides);
  solids.ball({0.0, 0.43 * l, z}, 0.065 * l, 3);
  solids.begin_part(limbs);
  for (const double side : {-1.0, 1.0}) {
    // If the body lies on a side, the limbs are in front of it, so they neither carry it nor stand
    // up. Knees are raised only if the body lies on its back.
    const auto spread = [&](double aside, double along, double up) {
      return on_side ? Vector3d(0.0, along, aside + up) : Vector3d(side * aside, along, up);
    };
    const double swing = draws.between(0.15, on_side ? 1.2 : 2.4);
    const double bend = draws.between(0.0, on_side ? 1.0 : 1.6);
    const Vector3d from(side * 0.12 * l, shoulder - 0.02 * l, z);
    const auto way = [&](double angle) { return spread(std::sin(angle), -std::cos(angle), 0.0); };
    const Vector3d elbow =
        from + 0.186 * l * way(swing) + Vector3d(0.0, 0.0, draws.between(-0.02, 0.03) * l);
    limb(solids, from, elbow, elbow + 0.2 * l * way(swing + bend), 0.03 * l, 0.024 * l, 0.018 * l,
         sides);
    const double apart = draws.between(0.0, 0.5);
    const double raised = draws.chance(0.35) && on_back ? draws.between(0.2, 0.9) : 0.0;
    const Vector3d hip_at(side * 0.055 * l, hip, z);
    const Vector3d knee =
        hip_at +
        0.245 * l * spread(std::sin(apart), -std::cos(apart) * std::cos(raised), std::sin(raised));
    const Vector3d foot =
        knee +
        0.25 * l * spread(std::sin(0.5 * apart), -std::cos(0.8 * raised), -std::sin(0.8 * raised));
    limb(solids, hip_at, knee, foot, 0.048 * l, 0.033 * l, 0.022 * l, sides);
    const Vector3d toes = on_back ? Vector3d(side * 0.03, -0.02, 0.09)   // pointing up
                                  : Vector3d(side * 0.01, -0.09, 0.02);  // stretched
    bar(solids, foot, foot + toes * l, 0.04 * l, 0.05 * l);
  }
  const double posture = on_back ? 0.0 : on_side ? draws.side() * pi / 2 : pi;
  const double roll = posture + draws.between(-0.1, 0.1) * (on_side ? 3.0 : 1.0);
  solids.move(0, motion(Vector3d::Zero(), 0.0, roll, 0.0));
  rest(solids, 0, draws.between(0.0, 0.25));
}

}  // namespace ensonify::engine
