#include <ensonify/engine/trace/refraction/straightened_bed.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/face_sources/exact_faces.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t most_points = 1 << 20;  // of a fan; more take longer than listing the faces
constexpr double behind_depths = 0.25;  // how far behind the origin walks may begin, in depths
constexpr double cells_around = 1.25;   // of points around the planes' lines over the bed

/// The index of the last of these places that is not beyond x, or the first one.
std::uint32_t last_before(std::span<const float> places, double x) {
  const auto after = std::ranges::upper_bound(places, x);
  return static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(after - places.begin(), 1) - 1);
}

/// Points whose hull, seen from above, holds the lines in which the planes of a fan meet a bed
/// between two heights, from some way behind the origin to the end of the range.
std::array<Vector2d, 8> outline(const RayFan& fan, double lowest_m, double highest_m,
                                double behind_m) {
  std::array<Vector2d, 8> points;
  auto next = points.begin();
  for (const std::size_t plane : {std::size_t{0}, fan.planes() - 1}) {
    const Vector3d in_plane = fan.plane_direction(plane);
    // Level in the plane, and steepest up.
    const Vector2d up = Vector2d(in_plane.z(), fan.pole.z()).normalized();
    const Vector3d ahead = up.y() * in_plane - up.x() * fan.pole;
    const Vector3d upwards = up.x() * in_plane + up.y() * fan.pole;
    for (const double height_m : {lowest_m, highest_m})
      for (const double along_m : {-behind_m, fan.range_m * fan.bend.lengthening}) {
        const Vector3d below = (height_m - fan.origin.z()) / upwards.z() * upwards;
        *next++ = (fan.origin + below + along_m * ahead).head<2>();
      }
  }
  return points;
}

/// The least and the greatest x of the hull of some points between two values of y. The first is
/// greater than the second if the hull does not lie there.
Vector2d extent_between(std::span<const Vector2d> points, double south_m, double north_m) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Vector2d extent(inf, -inf);
  for (const Vector2d& a : points)
    for (const Vector2d& b : points) {
      const double low = std::max(a.y(), south_m), high = std::min(b.y(), north_m);
      if (low > high) continue;
      const double slope = b.y() > a.y() ? (b.x() - a.x()) / (b.y() - a.y()) : 0.0;
      for (const double y : {low, high}) {
        const double x = a.x() + (y - a.y()) * slope;
        extent = {std::min(extent.x(), x), std::max(extent.y(), x)};
      }
    }
  return extent;
}

}  // namespace

StraightenedBed::StraightenedBed(const refine::HeightGrid& grid, Straightening& straightening,
                                 double tolerance_m)
    : grid_(&grid),
      straightening_(&straightening),
      most_bow8_m2_(Straightening::most_bow8_m2(tolerance_m)),
      scan_(grid),
      column_0_(static_cast<std::size_t>(grid.rows())),
      east_m_(static_cast<std::size_t>(grid.columns()) + points_padding) {}

/// Whether every ray that may hit something is a known one (Straightening::flattest()).
bool StraightenedBed::decides_all(const RayFan& fan) const {
  const double flattest = straightening_->flattest();
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const Vector3d in_plane = fan.plane_direction(plane);
    for (std::size_t elevation = fan.elevations(); elevation-- > 0;) {
      const Vector3d direction = fan.direction(in_plane, elevation);
      const double level = direction.head<2>().norm(), down = -direction.z();
      if (level < flattest * down) break;
      if (fan.grid->within_beam(plane, elevation) && straightening_->may_hit(level, down))
        return false;
    }
  }
  return true;
}

/// Finds the points near the fan's planes. False if they are too many.
bool StraightenedBed::find_points(const RayFan& fan) {
  const double lowest_m = grid_->bounds().lowest.z(), highest_m = grid_->bounds().highest.z();
  // About how far the volume of the bent rays reaches sideways beyond the planes. StraightenedSpace
  // takes all faces that this volume touches: a fan with which it needs chords is refused here too.
  const refine::FanVolume volume = fan_volume_of(fan);
  const double straight = fan.grid->sin_truncation * (1.0 - fan.bend.turn_rad);
  const double bent_m = volume.range_m * (std::sin(volume.truncation_rad) - straight);
  const double around_m = cells_around * scan_.diagonal_m() + bent_m;
  const std::array<Vector2d, 8> points =
      outline(fan, lowest_m, highest_m, around_m + behind_depths * (fan.origin.z() - lowest_m));
  const auto [south, north] = std::ranges::minmax(points, {}, [](const auto& p) { return p.y(); });
  first_row_ = last_before(grid_->y(), south.y() - around_m);
  end_row_ = last_before(grid_->y(), north.y() + around_m) + 1;
  columns_.assign(static_cast<std::size_t>(grid_->rows()), 0);
  std::size_t count = 0;
  for (std::size_t row = first_row_; row < end_row_; ++row) {
    const double y = double{grid_->y()[row]};
    const Vector2d extent = extent_between(points, y - around_m, y + around_m);
    if (extent.x() > extent.y()) continue;
    const std::uint64_t first = last_before(grid_->x(), extent.x() - around_m);
    const std::uint64_t end = last_before(grid_->x(), extent.y() + around_m) + 1;
    columns_[row] = end << 32 | first;
    column_0_[row] = static_cast<std::int32_t>(count) - static_cast<std::int32_t>(first);
    count += end - first;
    if (count > most_points) return false;
  }
  room_ = count + points_padding;
  moved_.resize(room_);
  heights_m_.resize(room_);
  jacobians_.resize(9 * room_);
  return true;
}

std::array<std::int32_t, 2> StraightenedBed::columns_of(std::size_t row) const {
  return {static_cast<std::int32_t>(columns_[row] & 0xffffffff),
          static_cast<std::int32_t>(columns_[row] >> 32)};
}

/// Calls with_west(point, the next point to its west) and with_south(point, the next point to its
/// south) for the points of a row.
template <class WithWest, class WithSouth>
void StraightenedBed::with_neighbours(std::size_t row, WithWest&& with_west,
                                      WithSouth&& with_south) const {
  const auto index = [](std::int32_t point) { return static_cast<std::size_t>(point); };
  const auto [first, end] = columns_of(row);
  const std::int32_t point = column_0_[row];
  for (std::int32_t i = first + 1; i < end; ++i) with_west(index(point + i), index(point + i - 1));
  if (row == first_row_) return;
  const auto [first_south, end_south] = columns_of(row - 1);
  const std::int32_t south = column_0_[row - 1];
  for (std::int32_t i = std::max(first, first_south); i < std::min(end, end_south); ++i)
    with_south(index(point + i), index(south + i));
}

/// A bound on the length of the edges between the points, whose heights it takes from the grid.
float StraightenedBed::find_longest_edge_m() {
  float east_m = 0.0f, north_m = 0.0f;  // rises, at most
  for (std::size_t row = first_row_; row < end_row_; ++row) {
    const auto [first, end] = columns_of(row);
    if (first == end) continue;
    grid_->heights(static_cast<int>(row), first,
                   std::span(heights_m_)
                       .subspan(static_cast<std::size_t>(column_0_[row] + first),
                                static_cast<std::size_t>(end - first)));
    const auto take = [&](float& most_m) {
      return [&](std::size_t a, std::size_t b) {
        most_m = std::max(most_m, std::abs(heights_m_[a] - heights_m_[b]));
      };
    };
    with_neighbours(row, take(east_m), take(north_m));
  }
  return std::hypot(static_cast<float>(scan_.diagonal_m()), east_m + north_m);
}

/// Moves the points. False if one of them stands too high, if no known ray reaches it, or if a face
/// between them may not be flat in straightened space.
bool StraightenedBed::move_points() {
  const float longest_m = find_longest_edge_m();
  if (longest_m > Straightening::longest_edge_m) return false;
  float east = 0.0f, north = 0.0f;  // squared changes of the Jacobian, at most
  for (std::size_t row = first_row_; row < end_row_; ++row) {
    const auto [first, end] = columns_of(row);
    if (first == end) continue;
    const auto count = static_cast<std::size_t>(end - first);
    const auto point = static_cast<std::size_t>(column_0_[row] + first);
    std::ranges::copy(grid_->x().subspan(static_cast<std::size_t>(first), count), east_m_.begin());
    if (!straightening_->move(std::span(east_m_).first(count), double{grid_->y()[row]},
                              std::span(heights_m_).subspan(point, count),
                              {moved_[point].data(), &jacobians_[point], room_}))
      return false;
    const auto take = [&](float& most) {
      return [&](std::size_t a, std::size_t b) {
        float sum = 0.0f;
        for (std::size_t k = 0; k < 9 * room_; k += room_) {
          const float change = jacobians_[k + a] - jacobians_[k + b];
          sum += change * change;
        }
        most = std::max(most, sum);
      };
    };
    with_neighbours(row, take(east), take(north));
  }
  // Along a diagonal it changes by no more than along two sides of its cell.
  const float bow8_m = (std::sqrt(east) + std::sqrt(north)) * longest_m;
  return bow8_m * bow8_m <= most_bow8_m2_;
}

bool StraightenedBed::trace(const RayFan& fan, std::span<Hit> hits) {
  if (!decides_all(fan) || !find_points(fan) || !move_points()) return false;
  const MovedPoints moved{columns_.data(), column_0_.data(), moved_.front().data()};
  if (!scan_.take(fan, moved)) return false;
  scan_.runs(0).give_hits(fan, hits);
  return true;
}

RayIncidence StraightenedBed::incidence_of(std::size_t number, Hit& hit) {
  const refine::Triangles faces = scan_.triangles();
  const std::uint32_t cell = hit.face / 2,
                      across = static_cast<std::uint32_t>(grid_->columns() - 1);
  const auto column = static_cast<std::int32_t>(cell % across);
  const auto row = static_cast<std::int32_t>(cell / across);
  const refine::Face& corners = grid_->cell(column, row).faces[hit.face % 2];
  Straightening::Piece piece;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto east = static_cast<std::int32_t>(corners[k] & 1),
               north = static_cast<std::int32_t>(corners[k] >> 1);
    const std::int32_t point = column_0_[static_cast<std::size_t>(row + north)] + column + east;
    piece.in_sea[k] = faces.corner(hit.index, static_cast<int>(k));
    piece.straightened[k] = moved_[static_cast<std::size_t>(point)].head<3>();
  }
  return straightening_->incidence(number, piece, hit);
}

}  // namespace ensonify::engine
