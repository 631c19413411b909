#pragma once

#include <array>
#include <vector>

#include <ensonify/engine/seafloor/objects/hull.h>
#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {

/// Makes one wreck. The parts are made in an upright ship with its keel at z = 0. Shares of the
/// ship's length are 0 at the stern and 1 at the bow.
class Wreck {
 public:
  explicit Wreck(FamilyForm& form);
  void make();

 private:
  enum Part { hull, deck, superstructure, mast, frame, cargo, machinery, wreck_debris };
  enum class Type { steamer, trawler, barge, sailing_ship, submarine };

  // The lines of the ship.
  void choose_lines();
  double noise(double s, double t) const;
  static int stations(double from, double to);
  double deck_m(double s, double across) const;
  bool in_hatch(double s, double across) const;
  void choose_hatches();
  double house_at() const;

  // The hull of the upright ship, and things in it.
  void stretch(double from, double to);
  void inside(double from, double to);
  void infill(double from, double to);
  void rib(double s, double lost);
  void heap(const Eigen::Vector2d& hold);
  void stern_gear();

  // The deck of the upright ship, and things on it.
  void deck_of(double from, double to);
  void coamings(double from, double to);
  void submarine_deck(double from, double to);
  void upper_works(double from, double to);
  void house(double at);
  void tower(const Eigen::Vector3d& foot, double half_wide_m, double long_m, double high_m);
  void forecastle();
  void masts(double from, double to);
  void deck_gear(double from, double to);
  void rails(double from, double to);
  void clutter(double from, double to);

  // The wreck on the bed, by variant.
  void lie(std::size_t mark, double list, double trim, double heading, double sunk_m,
           const Eigen::Vector2d& place);
  void whole();
  void broken();
  void frames_alone();
  void collapsed();
  void fallen_sides();
  void engine_room();
  void field(int count, double reach);

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
  std::vector<Eigen::Vector2d> hatches_;
};

}  // namespace ensonify::engine
