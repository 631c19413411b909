#include <ensonify/engine/seafloor/bed_height.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <Eigen/Geometry>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/trace/exact/exact_side.h>
#include <ensonify/refine/height_grid.h>

namespace ensonify::engine {
namespace {

constexpr double faces_per_cell = 2.0;
constexpr double max_cells_per_face = 8.0;  // on average; if more, the cells are made larger

/// The highest of the faces that look_at() was given and that are above or below one place.
class Topmost {
 public:
  Topmost(double x_m, double y_m) : place_(x_m, y_m, 0.0) {}

  void look_at(std::span<const Eigen::Vector3f> positions, const refine::Face& face,
               std::uint32_t number) {
    const auto side = [&](std::size_t from, std::size_t to) {
      return exact_side(place_, Eigen::Vector3d::UnitZ(), positions[face[from]],
                        positions[face[to]]);
    };
    const int first = side(0, 1);
    if (first == 0 || side(1, 2) != first || side(2, 0) != first) return;
    const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
      return positions[face[k]].cast<double>();
    };
    const Eigen::Vector3d a = corner(0);
    const Eigen::Vector3d normal = (corner(1) - a).cross(corner(2) - a);
    const double height_m =
        a.z() +
        (normal.x() * (a.x() - place_.x()) + normal.y() * (a.y() - place_.y())) / normal.z();
    if (!highest_ || height_m > highest_->height_m) highest_ = {height_m, number};
  }

  const std::optional<BedPoint>& highest() const { return highest_; }

 private:
  Eigen::Vector3d place_;
  std::optional<BedPoint> highest_;
};

/// First and end of the grid lines from `low` to `high`.
std::array<int, 2> lines_within(std::span<const float> lines, double low, double high) {
  const auto first = std::ranges::lower_bound(lines, low) - lines.begin();
  const auto end = std::ranges::upper_bound(lines, high) - lines.begin();
  return {static_cast<int>(first), static_cast<int>(end)};
}

/// First and end of the cells that touch places from `low` to `high`.
std::array<int, 2> cells_within(std::span<const float> lines, double low, double high) {
  const auto [first, end] = lines_within(lines, low, high);
  return {std::max(0, first - 1), std::min(static_cast<int>(lines.size()) - 1, end)};
}

double height_of(const std::optional<BedPoint>& point) {
  return point ? point->height_m : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

BedGrid::BedGrid(const Seafloor& seafloor, const std::function<void()>& stop_check)
    : heights_(seafloor.grid) {
  if (heights_) return;
  bed_ = {seafloor.mesh.positions, std::span(seafloor.mesh.faces).first(seafloor.bed_faces), {}};
  make_cells(stop_check);
}

void BedGrid::make_cells(const std::function<void()>& stop_check) {
  RareStopCheck check_stop(stop_check);
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
      check_stop();
      const auto [low, high] = cells_of(face);
      entries += (high - low + 1).cast<double>().prod();
    }
    if (entries > max_cells_per_face * faces) cell_m_ *= 2.0;
  }

  first_.assign(static_cast<std::size_t>(cells_.prod()) + 1, 0);
  for (std::uint32_t face = 0; face < bed_.faces.size(); ++face)
    for_each_cell(cells_of(face), [&](std::size_t cell) {
      check_stop();
      ++first_[cell + 1];
    });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  faces_.resize(first_.back());
  std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t face = 0; face < bed_.faces.size(); ++face)
    for_each_cell(cells_of(face), [&](std::size_t cell) {
      check_stop();
      faces_[next[cell]++] = face;
    });
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
void BedGrid::for_each_cell(const std::array<Cells, 2>& ends, F&& f) const {
  const auto& [low, high] = ends;
  for (std::int64_t row = low[1]; row <= high[1]; ++row)
    for (std::int64_t column = low[0]; column <= high[0]; ++column)
      f(static_cast<std::size_t>(row * cells_[0] + column));
}

refine::Bounds BedGrid::bounds() const {
  return heights_ ? heights_->bounds() : refine::bounds(bed_);
}

std::optional<BedPoint> BedGrid::top_in_grid(double x_m, double y_m) const {
  Topmost topmost(x_m, y_m);
  // One column and row, or two if the place is on a grid line.
  const auto columns = cells_within(heights_->x(), x_m, x_m),
             rows = cells_within(heights_->y(), y_m, y_m);
  for (int row = rows[0]; row < rows[1]; ++row)
    for (int column = columns[0]; column < columns[1]; ++column) {
      const refine::HeightGrid::Cell cell = heights_->cell(column, row);
      if (!cell.whole) continue;
      const std::array corners{heights_->point(column, row), heights_->point(column + 1, row),
                               heights_->point(column, row + 1),
                               heights_->point(column + 1, row + 1)};
      topmost.look_at(corners, cell.faces[0], cell.first_face);
      topmost.look_at(corners, cell.faces[1], cell.first_face + 1);
    }
  return topmost.highest();
}

double BedGrid::height_m(double x_m, double y_m) const { return height_of(top(x_m, y_m)); }

std::optional<BedPoint> BedGrid::top(double x_m, double y_m) const {
  if (heights_) return top_in_grid(x_m, y_m);
  const Cells at = cell_of({x_m, y_m});
  if ((at < 0).any() || (at >= cells_).any()) return std::nullopt;
  Topmost topmost(x_m, y_m);
  const auto cell = static_cast<std::size_t>(at[1] * cells_[0] + at[0]);
  for (std::uint64_t i = first_[cell]; i < first_[cell + 1]; ++i)
    topmost.look_at(bed_.positions, bed_.faces[faces_[i]], faces_[i]);
  return topmost.highest();
}

PlumbLine::PlumbLine(const Seafloor& seafloor)
    : mesh_(seafloor.progressive),
      bed_faces_(seafloor.bed_faces),
      highest_m_(seafloor.bounds().highest.z()),
      lowest_m_(seafloor.bounds().lowest.z()),
      footprint_(*mesh_) {}

double PlumbLine::height_m(double x_m, double y_m) { return height_of(top(x_m, y_m)); }

std::optional<BedPoint> PlumbLine::top(double x_m, double y_m) {
  // A fan of zero width: the slack of FanVolume is larger than the rounding of the place.
  const refine::FanVolume down{.apex = {x_m, y_m, highest_m_ + 1.0},
                               .array_axis = Eigen::Vector3d::UnitX(),
                               .middle = -Eigen::Vector3d::UnitZ(),
                               .pole = Eigen::Vector3d::UnitY(),
                               .range_m = highest_m_ - lowest_m_ + 2.0};
  const refine::ExactFaces faces = footprint_.query({&down, 1});
  Topmost topmost(x_m, y_m);
  for (std::size_t i = 0; i < faces.faces.size(); ++i)
    if (faces.source_faces[i] < bed_faces_)
      topmost.look_at(faces.points, faces.faces[i], faces.source_faces[i]);
  return topmost.highest();
}

std::vector<Eigen::Vector3f> BedGrid::grid_vertices_within(const refine::Bounds& box) const {
  const double west = double(box.lowest.x()), east = double(box.highest.x());
  const auto columns = lines_within(heights_->x(), west, east);
  const auto rows = lines_within(heights_->y(), double(box.lowest.y()), double(box.highest.y()));
  const auto [first_cell, end_cell] = cells_within(heights_->x(), west, east);
  std::vector<Eigen::Vector3f> places;
  if (columns[0] >= columns[1]) return places;
  std::vector<std::uint8_t> used;
  for (int row = rows[0]; row < rows[1]; ++row) {
    heights_->used_points(row, first_cell, end_cell, 0, heights_->rows() - 1, used);
    for (int column = columns[0]; column < columns[1]; ++column)
      if (used[static_cast<std::size_t>(column - first_cell)] != 0)
        places.push_back(heights_->point(column, row));
  }
  return places;
}

std::vector<Eigen::Vector3f> BedGrid::vertices_within(const refine::Bounds& box) const {
  if (heights_) return grid_vertices_within(box);
  const Cells low = cell_of(box.lowest.head<2>().cast<double>()).max(0);
  const Cells high = cell_of(box.highest.head<2>().cast<double>()).min(cells_ - 1);
  std::vector<std::uint32_t> numbers;
  for_each_cell({low, high}, [&](std::size_t cell) {
    for (std::uint64_t i = first_[cell]; i < first_[cell + 1]; ++i)
      for (const std::uint32_t vertex : bed_.faces[faces_[i]]) {
        const Eigen::Array2f p = bed_.positions[vertex].head<2>().array();
        if ((p >= box.lowest.head<2>().array()).all() && (p <= box.highest.head<2>().array()).all())
          numbers.push_back(vertex);
      }
  });
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  std::vector<Eigen::Vector3f> places;
  for (const std::uint32_t vertex : numbers) places.push_back(bed_.positions[vertex]);
  return places;
}

}  // namespace ensonify::engine
