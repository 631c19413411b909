#include <ensonify/engine/seafloor/objects/hull.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/engine/seafloor/objects/draws.h>

namespace ensonify::engine {

using Eigen::Vector3d;

double HullLines::half_breadth_m(double s) const {
  const bool ahead = s > 0.5;
  const double u = std::abs(2.0 * s - 1.0);
  const double end = ahead ? bow_width : stern_width;
  return 0.5 * beam_m * (end + (1.0 - end) * (1.0 - std::pow(u, ahead ? bow_power : stern_power)));
}

double HullLines::top_m(double s) const {
  const double u = 2.0 * s - 1.0;
  return depth_m + sheer_m * u * u * (u > 0.0 ? 1.0 : 0.5);
}

double HullLines::keel_m(double s) const {
  constexpr double run = 0.2;  // share of the length over which the keel rises
  const double u = std::max(0.0, (run - s) / run);
  return stern_rise_m * u * u;
}

double HullLines::exponent(double s) const {
  const double u = std::max(0.0, 2.0 * s - 1.0);
  return section + (end_section - section) * u * u;
}

double HullLines::half_breadth_m(double s, double below_top_m) const {
  const double n = exponent(s);
  const double down = std::min(1.0, below_top_m / (top_m(s) - keel_m(s)));
  return half_breadth_m(s) * std::pow(1.0 - std::pow(down, n), 1.0 / n);
}

Vector3d HullLines::point(double s, double t, double inset_m) const {
  const double n = exponent(s), depth = top_m(s) - keel_m(s), half = half_breadth_m(s);
  const double angle = 0.5 * std::numbers::pi * (1.0 - std::abs(t));
  const double across = t == 0.0 ? 0.0 : std::cos(angle), down = std::sin(angle);
  const double power = n / (n - 1.0);
  const double norm = std::pow(std::pow(across, power) + std::pow(down, power), 1.0 / n);
  // The section shrinks towards the middle of its top. The factor 1 / (1 + inset / size) is
  // positive even for a narrow section.
  const double x =
      std::copysign(std::pow(across, 1.0 / (n - 1.0)) / norm, t) * half / (1.0 + inset_m / half);
  const double z =
      top_m(s) - std::pow(down, 1.0 / (n - 1.0)) / norm * depth / (1.0 + inset_m / depth);
  const double ahead = std::max(0.0, (s - 0.8) / 0.2);
  return {x, length_m * (s - 0.5) + rake_m * ahead * ahead * (z - keel_m(s)) / depth, z};
}

void add_plating(Solids& solids, const HullLines& lines, const HullPlating& plating, Draws& draws) {
  constexpr int half = 8, columns = 2 * half + 1;
  const int rows = plating.stations + 1;
  const double step = (plating.to - plating.from) / plating.stations;
  PlateGrid grid{.rows = rows, .columns = columns};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double t = double(c - half) / half;
      const bool torn = (r == 0 && plating.from_torn) || (r + 1 == rows && plating.to_torn);
      const double tear = torn ? draws.between(0.0, 0.9) * step * (r == 0 ? 1.0 : -1.0) : 0.0;
      const double s = plating.from + r * step + tear;
      grid.front.push_back(lines.point(s, t, plating.inset_m));
      grid.back.push_back(lines.point(s, t, plating.inset_m + plating.thick_m));
    }
  if (plating.missing)
    for (int r = 0; r + 1 < rows; ++r)
      for (int c = 0; c + 1 < columns; ++c)
        grid.cut.push_back(
            plating.missing(plating.from + (r + 0.5) * step, (c + 0.5 - half) / half));
  solids.plate(grid);
}

}  // namespace ensonify::engine
