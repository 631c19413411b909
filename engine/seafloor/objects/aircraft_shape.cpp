#include <array>

#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

enum AircraftPart { fuselage, wing, tail, engine, canopy, gear, aircraft_debris };

/// A wing, tailplane or fin.
struct Wing {
  Vector3d root;  ///< middle of the root chord
  Vector3d out;   ///< unit, from root to tip; not along y
  double span_m, root_chord_m, tip_chord_m;
  double sweep = 0.0;  ///< tangent of the angle by which the middle line is swept back
  double thickness = 0.12;
  double from = 0.0, to = 1.0;  ///< the part of the span that exists; if from > 0, ragged there
  bool torn = false;            ///< ragged at `to`
};

/// Makes one aircraft with its nose towards y. The parts are made in an upright position, with the
/// axis of the fuselage at z = 0.
class Aircraft {
 public:
  explicit Aircraft(FamilyForm& form)
      : variant_(form.variant),
        draws_(form.draws),
        solids_(form.solids),
        sides_(form.sides()),
        length_m_(form.size_m) {
    radius_m_ = length_m_ * draws_.between(0.052, 0.075);
    wing_y_m_ = length_m_ * draws_.between(0.08, 0.16);
    engines_ = length_m_ < 11.0   ? 1
               : length_m_ < 17.0 ? 1 + draws_.one_of(2)
                                  : 2 + 2 * draws_.one_of(2);
    if (variant_ == "swept") engines_ = draws_.chance(0.5) ? 0 : 2;  // 0: in the fuselage
    const bool swept = variant_ == "swept";
    half_span_m_ =
        0.5 * length_m_ * (swept ? draws_.between(0.62, 0.95) : draws_.between(1.05, 1.45));
    chord_m_ = length_m_ * (swept ? draws_.between(0.24, 0.34) : draws_.between(0.18, 0.25));
    tip_share_ = swept ? draws_.between(0.25, 0.5) : draws_.between(0.4, 0.85);
    sweep_ = swept ? std::tan(radians(draws_.between(30.0, 48.0))) : draws_.between(0.0, 0.08);
    dihedral_rad_ = radians(draws_.between(swept ? -3.0 : 1.0, swept ? 2.0 : 6.0));
    // The wings are below, at the middle of, or above the fuselage.
    wing_z_m_ = radius_m_ * (draws_.chance(0.6) ? -low_wing : draws_.between(-0.2, 0.7));
    worn_ = draws_.between(0.1, 1.0);
  }

  void make() {
    if (variant_ == "flying_wing")
      flying_wing();
    else
      with_fuselage();
  }

 private:
  /// The radius of the fuselage / its radius amidships. u is 0 at the tail and 1 at the nose.
  static double slimness(double u, bool blunt) {
    if (u > 0.62) {
      const double v = (u - 0.62) / 0.38;
      return blunt ? 1.0 - 0.25 * v * v : std::sqrt(std::max(0.004, 1.0 - v * v));
    }
    const double v = (0.62 - u) / 0.62;
    return 1.0 - 0.85 * std::pow(v, 1.6);
  }

  void body(double from, double to, bool torn_front, bool torn_back) {
    constexpr int stations = 18;
    const bool blunt = variant_ == "straight" && engines_ == 1;
    std::vector<std::vector<Vector3d>> rings;
    for (int i = 0; i <= stations; ++i) {
      const double u = from + (to - from) * i / stations;
      const double r = radius_m_ * slimness(u, blunt);
      std::vector<Vector3d>& ring = rings.emplace_back();
      for (const Vector2d& p : circle(r, sides_)) {
        const bool torn = (i == 0 && torn_back) || (i == stations && torn_front);
        const double jag = torn ? draws_.between(-0.4, 0.4) * (to - from) / stations : 0.0;
        const double buckled = 1.0 + worn_ * draws_.between(-0.06, 0.06);
        // Higher than wide, and rising towards the tail.
        const double rise = 0.35 * radius_m_ * std::pow(std::max(0.0, 0.5 - u), 1.5);
        ring.emplace_back(buckled * p.y(), length_m_ * (u + jag - 0.5),
                          1.15 * buckled * p.x() + rise);
      }
    }
    solids_.skin(rings);
  }

  Wing wing_of(double side) const {
    return {.root = {side * 0.3 * radius_m_, wing_y_m_, wing_z_m_},
            .out = {side * std::cos(dihedral_rad_), 0.0, std::sin(dihedral_rad_)},
            .span_m = half_span_m_ - 0.3 * radius_m_,
            .root_chord_m = chord_m_,
            .tip_chord_m = tip_share_ * chord_m_,
            .sweep = sweep_,
            .thickness = variant_ == "swept" ? 0.09 : 0.14};
  }

  /// Adds a wing. The skin of a worn wing is buckled and has holes, and its tip hangs down.
  void add_wing(const Wing& wing) {
    const Vector3d along = Vector3d::UnitY(), up = wing.out.cross(along).normalized();
    const double sag = worn_ * draws_.between(-0.07, 0.02);  // of the tip / span
    PlateGrid grid{.rows = wing_cells + 1, .columns = chord_cells + 1};
    for (int i = 0; i <= wing_cells; ++i)
      for (int k = 0; k <= chord_cells; ++k) {
        const double u = wing.from + (wing.to - wing.from) * i / wing_cells;
        const double chord = wing.root_chord_m + (wing.tip_chord_m - wing.root_chord_m) * u;
        const double ahead = 2.0 * k / chord_cells - 1.0;  // from the trailing to the leading edge
        // Thickest ahead of the middle, sharper behind.
        const double profile = std::sqrt(1.0 - ahead * ahead) * (0.75 + 0.25 * ahead);
        const double half = (0.5 * wing.thickness * profile + 0.008) * chord;
        const double buckle = worn_ * draws_.between(-0.02, 0.02) * chord;
        const double lift = (up.z() < 0.0 ? -sag : sag) * u * u * wing.span_m + buckle;
        const Vector3d middle = wing.root + wing.span_m * u * (wing.out - wing.sweep * along) +
                                0.5 * ahead * chord * along + lift * up;
        grid.front.emplace_back(middle + half * up);
        grid.back.emplace_back(middle - half * up);
      }
    grid.cut = lost_cells(wing);
    solids_.plate(grid);
  }

  /// Whether each cell of a wing is missing. Rows are from root to tip, and the cells of a row
  /// begin at the trailing edge.
  std::vector<bool> lost_cells(const Wing& wing) {
    std::vector<bool> lost(wing_cells * chord_cells);
    const auto lose = [&](int from, int to, int behind, int ahead) {
      for (int i = from; i < std::min(to, wing_cells); ++i)
        for (int k = behind; k < std::min(ahead, chord_cells); ++k) {
          const int cell = i * chord_cells + k;
          lost[static_cast<std::size_t>(cell)] = true;
        }
    };
    for (const int from : {1, 11}) {  // a flap, an aileron
      const int wide = 4 + draws_.one_of(5), deep = 1 + draws_.one_of(2);
      if (draws_.chance(0.4 * worn_)) lose(from, from + wide, 0, deep);
    }
    constexpr int ribs = 5, bay = wing_cells / ribs;
    const int holes = draws_.one_of(1 + static_cast<int>(6.0 * worn_));
    for (int n = 0; n < holes; ++n) {  // the skin between some ribs, but not the ribs
      const int first = draws_.one_of(ribs), bays = 1 + draws_.one_of(2);
      const int behind = 1 + draws_.one_of(chord_cells - 4), deep = 1 + draws_.one_of(3);
      for (int rib = first; rib < first + bays; ++rib)
        lose(rib * bay + 1, (rib + 1) * bay, behind, behind + deep);
    }
    for (int k = 0; k < chord_cells; ++k) {  // where the wing broke
      if (wing.from > 0.0) lose(0, draws_.one_of(4), k, k + 1);
      if (wing.torn) lose(wing_cells - draws_.one_of(5), wing_cells, k, k + 1);
    }
    return lost;
  }

  Vector3d on_wing(const Wing& wing, double u, double ahead) const {
    const double chord = wing.root_chord_m + (wing.tip_chord_m - wing.root_chord_m) * u;
    return wing.root + wing.span_m * u * wing.out +
           Vector3d(0.0, 0.5 * ahead * chord - wing.sweep * u * wing.span_m, 0.0);
  }

  /// Adds an engine with its cowling and, unless it is a jet engine, its propeller.
  void engine_at(const Vector3d& nose, double long_m, double r, bool jet) {
    const std::size_t mark = solids_.begin_part(engine);
    const std::array profile{Vector2d((jet ? 0.7 : 0.3) * r, -long_m),
                             Vector2d(0.8 * r, -0.75 * long_m), Vector2d(r, -0.4 * long_m),
                             Vector2d(r, -0.08 * long_m), Vector2d((jet ? 0.85 : 0.7) * r, 0.0)};
    turned(solids_, profile, sides_);
    if (!jet) propeller(r);
    solids_.move(mark, motion(nose));
  }

  void propeller(double r) {
    if (draws_.chance(0.2)) return;  // lost
    solids_.taper({0.0, -0.1 * r, 0.0}, {0.0, 0.5 * r, 0.0}, 0.3 * r, 0.1 * r, 10);
    const int blades = 2 + draws_.one_of(3);
    const double turn = draws_.between(0.0, pi);
    for (int k = 0; k < blades; ++k) {
      const double angle = turn + 2.0 * pi * k / blades;
      const Vector3d out(std::cos(angle), draws_.between(-0.8, 0.1), std::sin(angle));  // bent back
      bar(solids_, {0.0, 0.2 * r, 0.0}, Vector3d(0.0, 0.2 * r, 0.0) + 2.2 * r * out, 0.28 * r,
          0.08 * r);
    }
  }

  void tail_unit() {
    solids_.begin_part(tail);
    const double y = -0.43 * length_m_, chord = 0.5 * chord_m_;
    const double high = length_m_ * draws_.between(0.12, 0.18), sweep = std::max(0.3, sweep_);
    const double z = 0.2 * radius_m_;
    if (draws_.chance(engines_ >= 2 && variant_ == "straight" ? 0.4 : 0.0)) {
      for (const double side : {-1.0, 1.0})  // twin fins at the ends of the tailplane
        add_wing({.root = {side * 0.33 * half_span_m_, y, z - 0.4 * high},
                  .out = Vector3d::UnitZ(),
                  .span_m = high,
                  .root_chord_m = 1.1 * chord,
                  .tip_chord_m = 0.6 * chord});
    } else if (!draws_.chance(0.15)) {
      add_wing({.root = {0.0, y, 0.1 * radius_m_},
                .out = Vector3d::UnitZ(),
                .span_m = high + 0.3 * radius_m_,
                .root_chord_m = 1.3 * chord,
                .tip_chord_m = 0.6 * chord,
                .sweep = sweep});
    }
    for (const double side : {-1.0, 1.0}) {
      const double left = draws_.chance(0.15) ? draws_.between(0.3, 0.7) : 1.0;
      add_wing({.root = {0.0, y, z},
                .out = {side, 0.0, 0.0},
                .span_m = 0.36 * half_span_m_,
                .root_chord_m = chord,
                .tip_chord_m = 0.55 * chord,
                .sweep = 0.2 + 0.7 * sweep_,
                .to = left,
                .torn = left < 1.0});
    }
  }

  void with_fuselage() {
    const bool inverted = draws_.chance(0.25), breaks = draws_.chance(0.18);
    const double broken_at = draws_.between(0.28, 0.42);
    const std::size_t mark = solids_.begin_part(fuselage);
    body(breaks ? broken_at : 0.0, 1.0, false, breaks);
    const std::array<double, 2> left = wings();
    noses();
    cockpit();
    if (inverted || draws_.chance(0.25)) undercarriage();
    if (!breaks) tail_unit();
    lie(mark, inverted);
    if (breaks) {
      const std::size_t aft = solids_.begin_part(fuselage);
      body(0.0, broken_at, true, false);
      tail_unit();
      const double middle = length_m_ * (0.5 * broken_at - 0.5);
      solids_.move(aft, motion({0.0, -middle, 0.0}));
      lie(aft, draws_.chance(0.2));
      const double turn = radians(draws_.between(-50.0, 50.0));
      const double aside_m = draws_.between(-0.12, 0.12) * length_m_;
      const double ahead_m = draws_.between(-0.03, 0.02) * length_m_;
      solids_.move(aft, motion({aside_m, middle + ahead_m, 0.0}, 0.0, 0.0, turn));
    }
    torn_off(left);
    field();
  }

  /// Adds the wings, and returns which share of each is left.
  std::array<double, 2> wings() {
    solids_.begin_part(wing);
    std::array<double, 2> left{1.0, 1.0};
    for (std::size_t i = 0; i < 2; ++i) {
      if (draws_.chance(0.15)) left[i] = draws_.between(0.3, 0.8);
      Wing one = wing_of(i ? 1.0 : -1.0);
      one.to = left[i];
      one.torn = left[i] < 1.0;
      add_wing(one);
    }
    return left;
  }

  void noses() {
    const double r = 0.75 * radius_m_;
    if (variant_ == "swept") {
      for (int k = 0; k < engines_; ++k) {
        const Wing one = wing_of(k % 2 ? 1.0 : -1.0);
        const Vector3d at = on_wing(one, 0.3, 1.2) - Vector3d(0.0, 0.0, 1.1 * r);
        engine_at(at, 0.28 * length_m_, 0.7 * r, true);
      }
      return;
    }
    if (engines_ == 1) {
      engine_at({0.0, 0.56 * length_m_, 0.0}, 0.14 * length_m_, 0.92 * radius_m_, false);
      return;
    }
    for (int k = 0; k < engines_; ++k) {
      if (draws_.chance(0.12)) continue;  // torn off
      const Wing one = wing_of(k % 2 ? 1.0 : -1.0);
      engine_at(on_wing(one, k < 2 ? 0.28 : 0.55, 1.9), 1.1 * chord_m_, r, false);
    }
  }

  void cockpit() {
    solids_.begin_part(canopy);
    const double at = engines_ == 1 ? 0.58 : 0.8, long_m = 0.14 * length_m_;
    const std::size_t mark = solids_.mark();
    const double r = 0.55 * radius_m_;
    const std::array profile{Vector2d(0.15 * r, -0.5 * long_m), Vector2d(0.8 * r, -0.2 * long_m),
                             Vector2d(r, 0.1 * long_m), Vector2d(0.7 * r, 0.35 * long_m),
                             Vector2d(0.15 * r, 0.5 * long_m)};
    turned(solids_, profile, sides_);
    solids_.move(mark, motion({0.0, length_m_ * (at - 0.5), 0.85 * radius_m_}));
  }

  void undercarriage() {
    solids_.begin_part(gear);
    const double r = 0.45 * radius_m_;
    for (const double side : {-1.0, 1.0}) {
      const Wing one = wing_of(side);
      const Vector3d top = on_wing(one, 0.25, 0.3);
      const Vector3d foot = top - Vector3d(-side * 0.2 * r, 0.0, 2.4 * r + radius_m_);
      solids_.taper(top, foot, 0.18 * r, 0.14 * r, 8);
      solids_.taper(foot - Vector3d(0.3 * r, 0.0, 0.0), foot + Vector3d(0.3 * r, 0.0, 0.0), r, r,
                    sides_);
    }
  }

  /// Puts everything that was made since a mark on the bed: upright or inverted, a little tilted.
  void lie(std::size_t mark, bool inverted) {
    const double roll = radians(draws_.between(-8.0, 8.0)) + (inverted ? pi : 0.0);
    const double pitch = radians(draws_.between(-7.0, 5.0));
    solids_.move(mark, motion(Vector3d::Zero(), 0.0, roll, 0.0));
    solids_.move(mark, motion(Vector3d::Zero(), pitch, 0.0, 0.0));
    // The fuselage is sunk into the bed by a share of its radius, but low wings are not buried.
    const double up =
        draws_.between(low_wing, 1.0) * radius_m_ + (inverted ? 0.3 * radius_m_ : 0.0);
    solids_.move(mark, motion({0.0, 0.0, up}));
  }

  /// Adds the outer wings that were torn off, near the aircraft.
  void torn_off(const std::array<double, 2>& left) {
    solids_.begin_part(wing);
    for (std::size_t i = 0; i < 2; ++i) {
      const double away = draws_.between(0.5, 1.1), ahead = draws_.between(-0.5, 0.3);
      const double turn = draws_.between(-1.2, 1.2);
      if (left[i] == 1.0 || draws_.chance(0.35)) continue;
      const double side = i ? 1.0 : -1.0;
      const std::size_t mark = solids_.mark();
      Wing outer = wing_of(side);
      outer.from = left[i];
      add_wing(outer);
      const Vector3d middle = solids_.box(mark).center();
      solids_.move(mark, motion(-middle));
      const double roll = draws_.between(-0.15, 0.15), pitch = draws_.between(-0.1, 0.1);
      solids_.move(mark,
                   motion({side * away * half_span_m_, ahead * length_m_, 0.0}, pitch, roll, turn));
      rest(solids_, mark, draws_.between(0.1, 0.4));
    }
  }

  void flying_wing() {
    half_span_m_ = length_m_ * draws_.between(1.1, 1.5);
    chord_m_ = length_m_ * draws_.between(0.5, 0.62);
    tip_share_ = draws_.between(0.15, 0.3);
    sweep_ = (length_m_ - 0.5 * chord_m_ * (1.0 + tip_share_)) / half_span_m_;
    wing_y_m_ = 0.5 * (length_m_ - chord_m_);
    wing_z_m_ = 0.0;
    radius_m_ = 0.09 * length_m_;
    const std::size_t mark = solids_.mark();
    const bool inverted = draws_.chance(0.25);
    const std::array<double, 2> left = wings();
    cockpit();
    for (const double side : {-1.0, 1.0})
      engine_at({side * 0.16 * length_m_, wing_y_m_ + 0.45 * chord_m_, 0.04 * length_m_},
                0.9 * chord_m_, 0.055 * length_m_, true);
    solids_.begin_part(tail);
    if (draws_.chance(0.4))
      for (const double side : {-1.0, 1.0})
        if (left[side > 0.0 ? 1 : 0] == 1.0)
          add_wing({.root = on_wing(wing_of(side), 0.95, -0.2),
                    .out = Vector3d::UnitZ(),
                    .span_m = 0.14 * length_m_,
                    .root_chord_m = 0.16 * length_m_,
                    .tip_chord_m = 0.08 * length_m_,
                    .sweep = 0.5});
    lie(mark, inverted);
    torn_off(left);
    field();
  }

  void field() {
    solids_.begin_part(aircraft_debris);
    scatter_debris(solids_, 2 + draws_.one_of(12), 0.1 * length_m_,
                   {0.8 * half_span_m_, 0.48 * length_m_}, draws_);
  }

  static constexpr int wing_cells = 20, chord_cells = 9;  // along the span and the chord
  static constexpr double low_wing = 0.6;  // distance below the fuselage's axis / its radius
  std::string_view variant_;
  Draws& draws_;
  Solids& solids_;
  int sides_, engines_ = 1;
  double length_m_, radius_m_ = 0.0, wing_y_m_ = 0.0, wing_z_m_ = 0.0, half_span_m_ = 0.0;
  double chord_m_ = 0.0, tip_share_ = 0.0, sweep_ = 0.0, dihedral_rad_ = 0.0;
  double worn_ = 0.0;  ///< 0 to 1: how buckled and torn the skin is
};

}  // namespace

void make_aircraft(FamilyForm& form) { Aircraft(form).make(); }

}  // namespace ensonify::engine
