#include <ensonify/engine/seafloor/bed/tessellate.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <fmt/format.h>

namespace ensonify::engine {

refine::TriangleMesh tessellate(const Heightfield& field) {
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> vertex(field.z_m.size(), unused);
  std::size_t cells = 0;
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column)
      if (field.whole(column, row)) {
        ++cells;
        for (const int north : {0, 1})
          for (const int east : {0, 1}) vertex[field.index(column + east, row + north)] = 0;
      }
  if (cells == 0)
    throw refine::MeshError(fmt::format(
        "seafloor: none of the {} x {} grid points form a whole cell, so there is no bed; at least "
        "four neighbouring points need heights",
        field.columns, field.rows));

  refine::TriangleMesh mesh;
  mesh.world_origin = field.world_origin;
  mesh.positions.reserve(vertex.size() -
                         static_cast<std::size_t>(std::ranges::count(vertex, unused)));
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      std::uint32_t& index = vertex[field.index(column, row)];
      if (index == unused) continue;
      const Eigen::Vector3f position(static_cast<float>(field.x_m(column)),
                                     static_cast<float>(field.y_m(row)),
                                     static_cast<float>(field.at(column, row)));
      if (!position.allFinite() || mesh.positions.size() == unused)
        throw refine::MeshError(fmt::format(
            "seafloor: point {} (column {}, row {}) at {}, {}, {} m does not fit the mesh's types",
            mesh.positions.size(), column, row, field.x_m(column), field.y_m(row),
            field.at(column, row)));
      index = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.push_back(position);
    }

  mesh.faces.reserve(2 * cells);
  for (int row = 0; row + 1 < field.rows; ++row)
    for (int column = 0; column + 1 < field.columns; ++column) {
      if (!field.whole(column, row)) continue;
      const std::size_t south = field.index(column, row), north = field.index(column, row + 1);
      const std::uint32_t sw = vertex[south], se = vertex[south + 1];
      const std::uint32_t nw = vertex[north], ne = vertex[north + 1];
      // Both diagonals have the same length on the map, so the one with the smaller height step is
      // shorter.
      if (std::abs(field.z_m[north + 1] - field.z_m[south]) <=
          std::abs(field.z_m[north] - field.z_m[south + 1])) {
        mesh.faces.push_back({sw, se, ne});
        mesh.faces.push_back({sw, ne, nw});
      } else {
        mesh.faces.push_back({sw, se, nw});
        mesh.faces.push_back({se, ne, nw});
      }
    }
  return mesh;
}

}  // namespace ensonify::engine
