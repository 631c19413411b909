#include <ensonify/engine/seafloor/objects/shape_family.h>

#include <array>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

Eigen::Isometry3d motion(const Vector3d& shift_m, double about_x_rad, double about_y_rad,
                         double about_z_rad) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = (Eigen::AngleAxisd(about_z_rad, Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(about_y_rad, Vector3d::UnitY()) *
                     Eigen::AngleAxisd(about_x_rad, Vector3d::UnitX()))
                        .toRotationMatrix();
  motion.translation() = shift_m;
  return motion;
}

void rest(Solids& solids, std::size_t mark, double sunk_share) {
  const Eigen::AlignedBox3d box = solids.box(mark);
  if (box.isEmpty()) return;
  const double lift_m = -box.min().z() - sunk_share * box.sizes().z();
  solids.move(mark, motion({0.0, 0.0, lift_m}));
}

void bar(Solids& solids, const Vector3d& from, const Vector3d& to, double width_m, double thick_m) {
  const bool upright = std::abs((to - from).normalized().z()) > 0.9;
  solids.sweep(std::array{from, to}, rectangle(width_m, thick_m),
               upright ? Vector3d::UnitY() : Vector3d::UnitZ());
}

void turned(Solids& solids, std::span<const Vector2d> profile, int sides) {
  std::vector<std::vector<Vector3d>> rings;
  for (const Vector2d& place : profile) {
    std::vector<Vector3d>& ring = rings.emplace_back();
    for (const Vector2d& p : circle(place.x(), sides)) ring.emplace_back(p.y(), place.y(), p.x());
  }
  solids.skin(rings);
}

void bent_plate(Solids& solids, double width_m, double length_m, double thick_m, double bend_m,
                double twist_m, bool torn, Draws& draws) {
  constexpr int cells = 5;
  PlateGrid grid{.rows = cells + 1, .columns = cells + 1};
  for (int r = 0; r <= cells; ++r)
    for (int c = 0; c <= cells; ++c) {
      const double u = double(c) / cells - 0.5, v = double(r) / cells - 0.5;
      const double z = bend_m * (0.25 - v * v) * 4.0 + twist_m * u * v * 4.0;
      // Columns are numbered towards -x, so the front is the upper side.
      grid.front.emplace_back(-width_m * u, length_m * v, z + 0.5 * thick_m);
      grid.back.emplace_back(-width_m * u, length_m * v, z - 0.5 * thick_m);
    }
  for (int r = 0; r < cells; ++r)
    for (int c = 0; c < cells; ++c) {
      const bool at_edge = r == 0 || c == 0 || r == cells - 1 || c == cells - 1;
      grid.cut.push_back(draws.chance(0.35) && torn && at_edge);
    }
  solids.plate(grid);
}

void scatter_debris(Solids& solids, int count, double longest_m, const Vector2d& half_axes_m,
                    Draws& draws) {
  for (int i = 0; i < count; ++i) {
    const std::size_t mark = solids.mark();
    const double size_m = longest_m * std::pow(draws.between(0.2, 1.0), 2.0);
    const double kind = draws.between(0.0, 1.0);
    const double thick_m = std::max(0.02, 0.02 * size_m);
    const double around = draws.between(0.0, 2.0 * pi), away = draws.between(0.15, 1.0);
    const double heading = draws.between(0.0, 2.0 * pi), tilt = draws.between(-0.35, 0.35);
    const double sunk = draws.between(0.1, 0.4), slim = draws.between(0.3, 0.8);
    const double bend = draws.between(-0.15, 0.15), twist = draws.between(-0.1, 0.1);
    if (kind < 0.55) {
      bent_plate(solids, slim * size_m, size_m, thick_m, bend * size_m, twist * size_m, true,
                 draws);
    } else if (kind < 0.8) {
      bar(solids, {0.0, -0.5 * size_m, 0.0}, {0.0, 0.5 * size_m, 0.0}, 0.06 * size_m, 0.1 * size_m);
    } else {
      solids.taper({0.0, -0.5 * size_m, 0.0}, {0.0, 0.5 * size_m, 0.0}, 0.05 * size_m,
                   0.05 * size_m, 10);
    }
    solids.move(mark, motion({away * half_axes_m.x() * std::cos(around),
                              away * half_axes_m.y() * std::sin(around), 0.0},
                             tilt, 0.5 * tilt, heading));
    rest(solids, mark, sunk);
  }
}

}  // namespace ensonify::engine
