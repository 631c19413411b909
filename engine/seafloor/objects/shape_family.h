#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Geometry>

#include <ensonify/engine/seafloor/objects/draws.h>
#include <ensonify/engine/seafloor/objects/solids.h>

namespace ensonify::engine {

/// What a family needs to make one of its members: the main size, the variant, the random numbers,
/// and the Solids to which it adds surfaces. The family makes the member in metres, with about the
/// main size and with the bed at z = 0. The part below z = 0 is sunk into the bed.
struct FamilyForm {
  double size_m;  ///< the first dimension of the kind; 0: the variant defines it
  std::string_view variant;
  std::optional<double> facet_rad;  ///< as in ShapeSize
  Draws draws;
  Solids solids;

  /// The number of sides of a round part.
  int sides(int usual = 16) const {
    return facet_rad
               ? std::max(usual, static_cast<int>(std::ceil(2.0 * std::numbers::pi / *facet_rad)))
               : usual;
  }
};

// The families. The parts have the numbers that they have in shape_kinds().
void make_wreck(FamilyForm& form);
void make_aircraft(FamilyForm& form);
void make_boat(FamilyForm& form);
void make_car(FamilyForm& form);
void make_container(FamilyForm& form);
void make_cable_drum(FamilyForm& form);
void make_ladder(FamilyForm& form);
void make_mooring(FamilyForm& form);
void make_mannequin(FamilyForm& form);
void make_ordnance(FamilyForm& form);
void make_mine(FamilyForm& form);

// What several families use.

inline double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

/// A rotation about x, then y, then z, and then a shift.
Eigen::Isometry3d motion(const Eigen::Vector3d& shift_m, double about_x_rad = 0.0,
                         double about_y_rad = 0.0, double about_z_rad = 0.0);
/// Shifts everything since a mark up or down, so that this share of its height is below z = 0.
void rest(Solids& solids, std::size_t mark, double sunk_share);
/// A straight bar between two points.
void bar(Solids& solids, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double width_m,
         double thick_m);
/// A body of revolution about y, from a profile of (radius, y) with y rising.
void turned(Solids& solids, std::span<const Eigen::Vector2d> profile, int sides);
/// A bent and twisted plate about the origin, nearly in the xy plane, with missing cells if `torn`.
void bent_plate(Solids& solids, double width_m, double length_m, double thick_m, double bend_m,
                double twist_m, bool torn, Draws& draws);
/// `count` torn plates, beams and pipes with lengths up to `longest_m` that lie on z = 0 in an
/// ellipse with these half axes, more of them near its middle.
void scatter_debris(Solids& solids, int count, double longest_m, const Eigen::Vector2d& half_axes_m,
                    Draws& draws);

}  // namespace ensonify::engine
