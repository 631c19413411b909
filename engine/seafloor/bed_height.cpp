#include <ensonify/engine/seafloor/bed_height.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/exact/exact_side.h>

namespace ensonify::engine {
namespace {

constexpr double faces_per_cell = 2.0;
constexpr double max_cells_per_face = 8.0;  // on average: long faces need larger cells

/// The highest of the faces seen so far above or below one place.
class Topmost {
 public:
  Topmost(refine::Triangles triangles, double x_m, double y_m)
      : triangles_(triangles), place_(x_m, y_m, 0.0) {}

  void look_at(std::uint32_t face) {
    const refine::Face& corners = triangles_.faces[face];
    const auto side = [&](std::size_t from, std::size_t to) {
      return exact_side(place_, Eigen::Vector3d::UnitZ(), triangles_.positions[corners[from]],
                        triangles_.positions[corners[to]]);
    };
    const int first = side(0, 1);
    if (first == 0 || side(1, 2) != first || side(2, 0) != first) return;
    const Eigen::Vector3d a = triangles_.corner(face, 0);
    const Eigen::Vector3d normal =
        (triangles_.corner(face, 1) - a).cross(triangles_.corner(face, 2) - a);
    const double height_m =
        a.z() +
        (normal.x() * (a.x() - place_.x()) + normal.y() * (a.y() - place_.y())) / normal.z();
    highest_m_ = std::max(highest_m_, height_m);
  }

  double height_m() const {
    return std::isfinite(highest_m_) ? highest_m_ : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  refine::Triangles triangles_;
  Eigen::Vector3d place_;
  double highest_m_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

BedGrid::BedGrid(const Seafloor& seafloor)
    : bed_{seafloor.mesh.positions, std::span(seafloor.mesh.faces).first(seafloor.bed_faces), {}} {
  const refine::Bounds box = refine::bounds(bed_);
  lowest_ = box.lowest.head<2>().cast<double>();
  const Eigen::Vector2d extent = box.highest.head<2>().cast<double>() - lowest_;
  const auto faces = static_cast<double>(bed_.faces.size());
  cell_m_ = std::max({std::sqrt(extent.prod() * faces_per_cell / faces),
                      extent.maxCoeff() * faces_per_cell / faces, 1e-6});
  for (double entries = 2.0 * max_cells_per_face * faces; entries > max_cells_per_face * faces;) {
    cells_ = (extent / cell_m_).array().floor().cast<std::int64_t>() + 1;
    entries = 0.0;
    for (std::uint32_t face = 0; face < bed_.faces.size(); ++face) {
      const auto [low, high] = cells_of(face);
      entries += (high - low + 1).cast<double>().prod();
    }
    if (entries > max_cells_per_face * faces) cell_m_ *= 2.0;
  }

  first_.assign(static_cast<std::size_t>(cells_.prod()) + 1, 0);
  for (std::uint32_t face = 0; face < bed_.faces.size(); ++face)
    for_each_cell(face, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  faces_.resize(first_.back());
  std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t face = 0; face < bed_.faces.size(); ++face)
    for_each_cell(face, [&](std::size_t cell) { faces_[next[cell]++] = face; });
}

BedGrid::Cells BedGrid::cell_of(const Eigen::Vector2d& place) const {
  return ((place - lowest_) / cell_m_).array().floor().cast<std::int64_t>();
}

std::array<BedGrid::Cells, 2> BedGrid::cells_of(std::uint32_t face) const {
  const refine::Face& corners = bed_.faces[face];
  const Eigen::Vector2f a = bed_.positions[corners[0]].head<2>(),
                        b = bed_.positions[corners[1]].head<2>(),
                        c = bed_.positions[corners[2]].head<2>();
  return {cell_of(a.cwiseMin(b).cwiseMin(c).cast<double>()),
          cell_of(a.cwiseMax(b).cwiseMax(c).cast<double>()).min(cells_ - 1)};
}

template <class F>
void BedGrid::for_each_cell(std::uint32_t face, F&& f) const {
  const auto [low, high] = cells_of(face);
  for (std::int64_t row = low[1]; row <= high[1]; ++row)
    for (std::int64_t column = low[0]; column <= high[0]; ++column)
      f(static_cast<std::size_t>(row * cells_[0] + column));
}

double BedGrid::height_m(double x_m, double y_m) const {
  const Cells at = cell_of({x_m, y_m});
  if ((at < 0).any() || (at >= cells_).any()) return std::numeric_limits<double>::quiet_NaN();
  Topmost topmost(bed_, x_m, y_m);
  const auto cell = static_cast<std::size_t>(at[1] * cells_[0] + at[0]);
  for (std::uint64_t i = first_[cell]; i < first_[cell + 1]; ++i) topmost.look_at(faces_[i]);
  return topmost.height_m();
}

PlumbLine::PlumbLine(const Seafloor& seafloor)
    : mesh_(seafloor.progressive),
      bed_faces_(seafloor.bed_faces),
      highest_m_(seafloor.bounds().highest.z()),
      lowest_m_(seafloor.bounds().lowest.z()),
      footprint_(*mesh_) {}

double PlumbLine::height_m(double x_m, double y_m) {
  // A fan of zero width: its slack is larger than the rounding of the place.
  const refine::FanVolume down{.apex = {x_m, y_m, highest_m_ + 1.0},
                               .array_axis = Eigen::Vector3d::UnitX(),
                               .middle = -Eigen::Vector3d::UnitZ(),
                               .pole = Eigen::Vector3d::UnitY(),
                               .range_m = highest_m_ - lowest_m_ + 2.0};
  const refine::ExactFaces faces = footprint_.query({&down, 1});
  Topmost topmost({faces.points, faces.faces, faces.source_faces}, x_m, y_m);
  for (std::uint32_t i = 0; i < faces.faces.size(); ++i)
    if (faces.source_faces[i] < bed_faces_) topmost.look_at(i);
  return topmost.height_m();
}

std::vector<Eigen::Vector3f> BedGrid::vertices_within(const refine::Bounds& box) const {
  const Cells low = cell_of(box.lowest.head<2>().cast<double>()).max(0);
  const Cells high = cell_of(box.highest.head<2>().cast<double>()).min(cells_ - 1);
  std::vector<std::uint32_t> numbers;
  for (std::int64_t row = low[1]; row <= high[1]; ++row)
    for (std::int64_t column = low[0]; column <= high[0]; ++column) {
      const auto cell = static_cast<std::size_t>(row * cells_[0] + column);
      for (std::uint64_t i = first_[cell]; i < first_[cell + 1]; ++i)
        for (const std::uint32_t vertex : bed_.faces[faces_[i]]) {
          const Eigen::Vector3f& p = bed_.positions[vertex];
          if ((p.head<2>().array() >= box.lowest.head<2>().array()).all() &&
              (p.head<2>().array() <= box.highest.head<2>().array()).all())
            numbers.push_back(vertex);
        }
    }
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  std::vector<Eigen::Vector3f> places;
  for (const std::uint32_t vertex : numbers) places.push_back(bed_.positions[vertex]);
  return places;
}

}  // namespace ensonify::engine
