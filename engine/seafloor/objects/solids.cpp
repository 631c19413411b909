#include <ensonify/engine/seafloor/objects/solids.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace ensonify::engine {

using Eigen::Vector2d, Eigen::Vector3d;
using std::numbers::pi;

CrossSection circle(double radius_m, int sides) {
  const double step = 2.0 * pi / sides;
  const double corner_m = radius_m * std::sqrt(step / std::sin(step));
  CrossSection points;
  for (int k = 0; k < sides; ++k)
    points.emplace_back(corner_m * std::cos(k * step), corner_m * std::sin(k * step));
  return points;
}

CrossSection rectangle(double width_m, double shape_height_m) {
  const double x = 0.5 * width_m, y = 0.5 * shape_height_m;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

std::uint32_t Solids::add(const Vector3d& point) {
  mesh.positions.emplace_back(point.cast<float>());
  exact.push_back(point);
  return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

void Solids::skin(std::span<const std::vector<Vector3d>> rings, bool loop) {
  const auto n = static_cast<std::uint32_t>(rings.front().size());
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const std::vector<Vector3d>& ring : rings)
    for (const Vector3d& point : ring) add(point);
  const auto vertex = [&](std::size_t ring, std::uint32_t k) {
    return first + static_cast<std::uint32_t>(ring % rings.size()) * n + k % n;
  };
  for (std::size_t i = 0; i + (loop ? 0 : 1) < rings.size(); ++i)
    for (std::uint32_t k = 0; k < n; ++k) {
      mesh.faces.push_back({vertex(i, k), vertex(i, k + 1), vertex(i + 1, k + 1)});
      mesh.faces.push_back({vertex(i, k), vertex(i + 1, k + 1), vertex(i + 1, k)});
    }
  if (loop) return;
  const auto cap = [&](std::size_t ring, bool forward) {
    Vector3d middle = Vector3d::Zero();
    for (const Vector3d& point : rings[ring]) middle += point / n;
    const std::uint32_t tip = add(middle);
    for (std::uint32_t k = 0; k < n; ++k)
      mesh.faces.push_back(forward ? refine::Face{tip, vertex(ring, k), vertex(ring, k + 1)}
                                   : refine::Face{tip, vertex(ring, k + 1), vertex(ring, k)});
  };
  cap(0, false);
  cap(rings.size() - 1, true);
}

void Solids::sweep(std::span<const Vector3d> points, const CrossSection& section,
                   const Vector3d& up, bool loop) {
  const std::size_t n = points.size();
  const auto way_from = [&](std::size_t i) {
    return (points[(i + 1) % n] - points[i]).normalized().eval();
  };
  std::vector<std::vector<Vector3d>> rings(n);
  Vector3d upright = up, before = loop ? way_from(n - 1) : way_from(0);
  for (std::size_t i = 0; i < n; ++i) {
    const bool begins = i == 0 && !loop, ends = i + 1 == n && !loop;
    const Vector3d in = begins ? way_from(0) : way_from((i + n - 1) % n);
    const Vector3d out = ends ? in : way_from(i);
    upright = Eigen::Quaterniond::FromTwoVectors(before, in) * upright;
    upright = (upright - upright.dot(in) * in).normalized();
    before = in;
    const Vector3d right = in.cross(upright);
    // The plane of the mitre halves the corner. At a turn of more than about 130 degrees, the
    // section is perpendicular to the incoming direction.
    Vector3d across = in + out;
    const bool sharp = across.norm() < 0.8;
    across = sharp ? in : across.normalized();
    for (auto corner = section.rbegin(); corner != section.rend(); ++corner) {
      const Vector3d offset = corner->x() * right + corner->y() * upright;
      rings[i].push_back(points[i] + offset - in * (offset.dot(across) / in.dot(across)));
    }
  }
  skin(rings, loop);
}

void Solids::revolve(std::span<const Vector2d> profile, int segments, bool loop) {
  std::vector<std::vector<Vector3d>> rings;
  for (const Vector2d& place : profile) {
    std::vector<Vector3d>& ring = rings.emplace_back();
    for (const Vector2d& p : circle(place.x(), segments))
      ring.emplace_back(p.x(), p.y(), place.y());
  }
  skin(rings, loop);
}

void Solids::ball(const Vector3d& middle, double radius_m, int level) {
  const double g = std::numbers::phi;
  std::vector<Vector3d> points;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-g, g}) {
      points.emplace_back(a, b, 0.0);
      points.emplace_back(0.0, a, b);
      points.emplace_back(b, 0.0, a);
    }
  for (Vector3d& p : points) p.normalize();
  std::vector<refine::Face> faces;
  const double edge = 1.01 * 2.0 / std::sqrt(1.0 + g * g);
  const auto near = [&](std::uint32_t a, std::uint32_t b) {
    return (points[a] - points[b]).norm() < edge;
  };
  for (std::uint32_t a = 0; a < 12; ++a)
    for (std::uint32_t b = a + 1; b < 12; ++b)
      for (std::uint32_t c = b + 1; c < 12; ++c)
        if (near(a, b) && near(b, c) && near(c, a)) {
          const bool outwards = points[a].dot(points[b].cross(points[c])) > 0.0;
          faces.push_back(outwards ? refine::Face{a, b, c} : refine::Face{a, c, b});
        }
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> halves;
    const auto half = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, isnew] =
          halves.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (isnew) points.push_back((points[a] + points[b]).normalized());
      return at->second;
    };
    std::vector<refine::Face> finer;
    for (const auto& [a, b, c] : faces) {
      const std::uint32_t ab = half(a, b), bc = half(b, c), ca = half(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vector3d& p : points) add(middle + radius_m * p);
  for (const auto& [a, b, c] : faces) mesh.faces.push_back({first + a, first + b, first + c});
}

void Solids::block(const Vector3d& middle, const Vector3d& size_m) {
  const Vector3d half(0.0, 0.5 * size_m.y(), 0.0);
  sweep(std::array<Vector3d, 2>{middle - half, middle + half}, rectangle(size_m.x(), size_m.z()));
}

void Solids::taper(const Vector3d& from, const Vector3d& to, double from_radius_m,
                   double to_radius_m, int sides) {
  const Vector3d way = (to - from).normalized();
  const Vector3d right = way.unitOrthogonal(), up = way.cross(right);
  std::vector<std::vector<Vector3d>> rings(2);
  for (const Vector2d& p : circle(1.0, sides)) {
    const Vector3d out = p.x() * right + p.y() * up;
    rings[0].push_back(from + from_radius_m * out);
    rings[1].push_back(to + to_radius_m * out);
  }
  skin(rings);
}

namespace {

/// Which cells of a grid exist.
class Cells {
 public:
  explicit Cells(const PlateGrid& grid)
      : rows_(grid.rows - 1), columns_(grid.columns - 1), cut_(grid.cut) {
    if (cut_.empty()) cut_.assign(static_cast<std::size_t>(rows_ * columns_), false);
    while (part_corners()) {
    }
  }
  bool has(int row, int column) const {
    return row >= 0 && column >= 0 && row < rows_ && column < columns_ && !cut_[at(row, column)];
  }

 private:
  std::size_t at(int row, int column) const {
    return static_cast<std::size_t>(row * columns_ + column);
  }
  /// Cuts one of two cells that touch only at a corner, because four walls would meet in one edge
  /// there. Returns whether any cell was cut.
  bool part_corners() {
    bool any = false;
    for (int r = 0; r + 1 < rows_; ++r)
      for (int c = 0; c + 1 < columns_; ++c) {
        const bool a = has(r, c), b = has(r + 1, c + 1), d = has(r, c + 1), e = has(r + 1, c);
        if (a && b && !d && !e) cut_[at(r, c)] = any = true;
        if (d && e && !a && !b) cut_[at(r, c + 1)] = any = true;
      }
    return any;
  }

  int rows_, columns_;
  std::vector<bool> cut_;
};

}  // namespace

void Solids::plate(const PlateGrid& grid) {
  const Cells cells(grid);
  constexpr std::uint32_t none = 0xffffffff;
  std::vector<std::uint32_t> front(grid.front.size(), none), back(grid.back.size(), none);
  const auto vertex = [&](std::vector<std::uint32_t>& of, const std::vector<Vector3d>& points,
                          std::size_t i) {
    if (of[i] == none) of[i] = add(points[i]);
    return of[i];
  };
  for (int r = 0; r + 1 < grid.rows; ++r)
    for (int c = 0; c + 1 < grid.columns; ++c) {
      if (!cells.has(r, c)) continue;
      const auto at = [&](int row, int column) {
        return static_cast<std::size_t>(row * grid.columns + column);
      };
      const std::array<std::size_t, 4> corner{at(r, c), at(r + 1, c), at(r + 1, c + 1),
                                              at(r, c + 1)};
      const std::array<bool, 4> inside{cells.has(r, c - 1), cells.has(r + 1, c),
                                       cells.has(r, c + 1), cells.has(r - 1, c)};
      std::array<std::uint32_t, 4> f{}, b{};
      for (std::size_t k = 0; k < 4; ++k) {
        f[k] = vertex(front, grid.front, corner[k]);
        b[k] = vertex(back, grid.back, corner[k]);
      }
      mesh.faces.push_back({f[0], f[1], f[2]});
      mesh.faces.push_back({f[0], f[2], f[3]});
      mesh.faces.push_back({b[0], b[2], b[1]});
      mesh.faces.push_back({b[0], b[3], b[2]});
      for (std::size_t k = 0; k < 4; ++k) {
        if (inside[k]) continue;
        const std::size_t next = (k + 1) % 4;
        mesh.faces.push_back({f[next], f[k], b[k]});
        mesh.faces.push_back({f[next], b[k], b[next]});
      }
    }
}

std::size_t Solids::begin_part(std::size_t number) {
  face_part_.resize(mesh.faces.size(), part_);
  part_ = static_cast<std::uint8_t>(number);
  return mark();
}

std::vector<std::uint8_t> Solids::face_parts() {
  if (face_part_.empty() && part_ == 0) return {};
  face_part_.resize(mesh.faces.size(), part_);
  return face_part_;
}

void Solids::move(std::size_t from, const Eigen::Isometry3d& motion) {
  for (std::size_t i = from; i < mesh.positions.size(); ++i)
    mesh.positions[i] = (motion * mesh.positions[i].cast<double>()).cast<float>();
}

Eigen::AlignedBox3d Solids::box(std::size_t from) const {
  Eigen::AlignedBox3d box;
  for (std::size_t i = from; i < mesh.positions.size(); ++i)
    box.extend(mesh.positions[i].cast<double>().eval());
  return box;
}

}  // namespace ensonify::engine
