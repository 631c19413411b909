#include <ensonify/engine/seafloor/objects/laid_line.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/base/csv_table.h>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;

std::vector<double> hang(std::span<const double> along_m, std::span<const double> ground_m,
                         double sag_radius_m) {
  const auto bend = [&](std::size_t i) { return along_m[i] * along_m[i] / (2.0 * sag_radius_m); };
  const auto u = [&](std::size_t i) { return ground_m[i] - bend(i); };
  std::vector<std::size_t> hull;  // the points at which the line touches the ground
  for (std::size_t i = 0; i < along_m.size(); ++i) {
    const auto below = [&](std::size_t a, std::size_t b) {  // b is under the chord from a to i
      return (u(b) - u(a)) * (along_m[i] - along_m[a]) <= (u(i) - u(a)) * (along_m[b] - along_m[a]);
    };
    while (hull.size() > 1 && below(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(i);
  }
  std::vector<double> z_m(along_m.size());
  for (std::size_t h = 0; h + 1 < hull.size(); ++h) {
    const std::size_t a = hull[h], b = hull[h + 1];
    for (std::size_t i = a + 1; i < b; ++i) {
      const double share = (along_m[i] - along_m[a]) / (along_m[b] - along_m[a]);
      z_m[i] = std::max(ground_m[i], u(a) + share * (u(b) - u(a)) + bend(i));
    }
  }
  for (const std::size_t i : hull) z_m[i] = ground_m[i];
  return z_m;
}

std::vector<Vector3d> laid_line(std::span<const Vector2d> path, double diameter_m, double step_m,
                                double sag_radius_m, double lift_m,
                                const std::function<double(const Vector2d&)>& ground_m) {
  constexpr std::array offsets = {-0.9, -0.5, 0.0, 0.5, 0.9};  // across the tube / radius
  const double radius_m = 0.5 * diameter_m;
  std::vector<Vector2d> places;
  std::vector<double> along_m, bed_m;
  const auto add = [&](const Vector2d& place, const Vector2d& way, double at_m) {
    double rests_m = -std::numeric_limits<double>::infinity();
    for (const double offset : offsets) {
      const Vector2d beside = place + offset * radius_m * Vector2d(way.y(), -way.x());
      rests_m = std::max(rests_m, ground_m(beside) + radius_m * std::sqrt(1.0 - offset * offset));
    }
    places.push_back(place);
    along_m.push_back(at_m);
    bed_m.push_back(rests_m);
  };
  double at_m = 0.0;
  Vector2d way = Vector2d::Zero();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double piece_m = (path[i + 1] - path[i]).norm();
    if (!(piece_m > 0.0)) continue;
    way = (path[i + 1] - path[i]) / piece_m;
    const double steps = std::ceil(piece_m / step_m);
    for (double k = 0.0; k < steps; ++k)
      add(path[i] + k / steps * piece_m * way, way, at_m + k / steps * piece_m);
    at_m += piece_m;
  }
  if (places.empty()) throw std::invalid_argument("the path has no length");
  add(path.back(), way, at_m);

  const std::vector<double> z_m = hang(along_m, bed_m, sag_radius_m);
  std::vector<Vector3d> line;
  for (std::size_t i = 0; i < places.size(); ++i)
    line.emplace_back(places[i].x(), places[i].y(), z_m[i] + lift_m);
  return line;
}

std::vector<Vector2d> read_path(const std::filesystem::path& file) {
  static constexpr std::array<CsvColumn, 2> path_columns{{{"east_m"}, {"north_m"}}};
  constexpr CsvFormat path_format{.row = "point", .columns = path_columns, .max_bytes = 4 << 20};
  constexpr double farthest_m = 1e6;
  const CsvTable table = CsvTable::read(file, path_format);
  std::vector<Vector2d> path;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    path.emplace_back(table.at(row, 0), table.at(row, 1));
    if (path.back().cwiseAbs().maxCoeff() > farthest_m)
      throw table.fault(row, fmt::format("a point at {}, {}, expected at most {:g} m from 0, 0",
                                         path.back().x(), path.back().y(), farthest_m));
  }
  if (path.size() > 1 && std::ranges::count(path, path.front()) == std::ssize(path))
    throw table.fault(1, "the same point again, expected two different points or more");
  if (path.size() < 2) throw table.fault(0, "a single point, expected a path of two or more");
  return path;
}

}  // namespace ensonify::engine
