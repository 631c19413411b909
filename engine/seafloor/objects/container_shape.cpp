#include <array>

#include <ensonify/engine/seafloor/objects/shape_family.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

enum ContainerPart { container_wall, container_frame, container_door };

/// A corrugated wall about the origin: `width_m` along x, `length_m` along y, outside at z <= 0.
void corrugated(Solids& solids, double width_m, double length_m, double dent_m, bool along_y) {
  constexpr double depth_m = 0.045, thick_m = 0.02;
  const double across_m = along_y ? length_m : width_m;
  const int waves = std::max(4, static_cast<int>(across_m / 0.28)), fine = 2 * waves + 1;
  const int rows = along_y ? fine : 4, columns = along_y ? 4 : fine;
  PlateGrid grid{.rows = rows, .columns = columns};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double v = double(r) / (rows - 1), u = double(c) / (columns - 1);
      const double ridge = ((along_y ? r : c) % 2) ? 0.0 : depth_m;
      const double dent = dent_m * std::sin(pi * u) * std::sin(pi * v);
      grid.add({width_m * (0.5 - u), length_m * (v - 0.5), -ridge - dent}, thick_m);
    }
  solids.plate(grid);
}

}  // namespace

void make_container(FamilyForm& form) {
  Draws& draws = form.draws;
  Solids& solids = form.solids;
  const double l = form.size_m, w = 2.438 * std::min(1.0, l / 6.0),
               h = 2.591 * std::min(1.0, l / 6.0);
  const double post = 0.07 * w, in = 0.5 * post;
  solids.begin_part(container_wall);
  struct Wall {
    double width_m, length_m;
    bool along_y;
    Eigen::Isometry3d place;
  };
  const double dent = draws.between(0.0, 0.25);
  const std::array<Wall, 5> walls{{
      {w - post, l - post, true, motion({0, 0, h - 0.02}, 0, 0, 0)},                   // roof
      {w - post, l - post, true, motion({0, 0, 0.02}, 0, pi, 0)},                      // floor
      {h - post, l - post, true, motion({0.5 * w - 0.01, 0, 0.5 * h}, 0, pi / 2, 0)},  // sides
      {h - post, l - post, true, motion({-0.5 * w + 0.01, 0, 0.5 * h}, 0, -pi / 2, 0)},
      {w - post, h - post, false, motion({0, 0.5 * l - 0.01, 0.5 * h}, -pi / 2, 0, 0)},  // front
  }};
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const std::size_t mark = solids.mark();
    const bool dented = i != 1 && draws.chance(0.5);
    corrugated(solids, walls[i].width_m, walls[i].length_m, dented ? dent : 0.0, walls[i].along_y);
    solids.move(mark, walls[i].place);
  }
  solids.begin_part(container_frame);
  for (const double x : {-1.0, 1.0}) {
    for (const double z : {in, h - in})
      solids.block({x * (0.5 * w - in), 0.0, z}, {post, 0.999 * l, 0.999 * post});
    for (const double y : {-1.0, 1.0})
      solids.block({x * (0.5 * w - in), y * (0.5 * l - in), 0.5 * h}, {1.01 * post, post, h});
  }
  for (const double y : {-1.0, 1.0})
    for (const double z : {in, h - in})
      solids.block({0.0, y * (0.5 * l - in), z}, {0.99 * w, 0.98 * post, 0.98 * post});
  solids.begin_part(container_door);
  for (const double side : {-1.0, 1.0}) {
    const double state = draws.between(0.0, 1.0), swing = draws.between(0.5, 2.6);
    if (state < 0.15) continue;  // lost
    const double open = state < 0.6 ? 0.0 : swing;
    const std::size_t mark = solids.mark();
    solids.block({-side * 0.24 * w, 0.0, 0.5 * h}, {0.47 * w, 0.04, h - 2.0 * post});
    solids.move(mark, motion({side * 0.485 * w, -0.5 * l + 0.03, 0.0}, 0.0, 0.0, side * open));
  }
  const bool tilted = form.variant == "tilted";
  const double roll = radians(tilted ? draws.between(12.0, 40.0) : draws.between(0.0, 3.0));
  const double pitch = radians(tilted ? draws.between(-8.0, 8.0) : draws.between(-2.0, 2.0));
  const double turn = draws.chance(0.25) ? pi / 2 : 0.0;  // on its side
  solids.move(0, motion(Vector3d::Zero(), 0.0, turn + draws.side() * roll, 0.0));
  solids.move(0, motion(Vector3d::Zero(), pitch, 0.0, 0.0));
  rest(solids, 0, draws.between(0.03, 0.35));
}

}  // namespace ensonify::engine
