#include <ensonify/engine/trace/grid_scan/grid_scan.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

namespace ensonify::engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How much of the slope at which a plane's line could turn back is allowed. The rounding of a
// crossing grows by 1 / (1 - usual_slope), for which `rounding` has room.
constexpr double usual_slope = 0.95;
// Moving the points may make faces steeper across a plane.
constexpr double slope_of_moved = 0.5;
// A bound, with much to spare, on the rounding of a crossing, relative to the range and to the
// length of the edge.
constexpr double rounding = 1e-11;
constexpr std::size_t fans_together = 2;  // the sides of a sonar
constexpr auto all_rays = std::int64_t{std::numeric_limits<std::uint32_t>::max()};

/// A dot product as the kernels compute it.
double dot(const Vector3d& a, const Vector3d& b) {
  return std::fma(a.x(), b.x(), std::fma(a.y(), b.y(), a.z() * b.z()));
}

/// The distance between two arrays of numbers of 64 bits, counted in numbers.
std::int64_t numbers_between(const void* from, const void* to) {
  return (reinterpret_cast<std::intptr_t>(to) - reinterpret_cast<std::intptr_t>(from)) /
         std::int64_t{sizeof(double)};
}

// An interval of rays, as in GridWalkArgs.
std::int64_t begin_of(std::uint64_t interval) {
  return static_cast<std::int64_t>(interval & 0xffffffff);
}
std::int64_t end_of(std::uint64_t interval) { return static_cast<std::int64_t>(interval >> 32); }

double widest_step(std::span<const float> lines) {
  double widest = 0.0;
  for (std::size_t i = 1; i < lines.size(); ++i)
    widest = std::max(widest, double{lines[i]} - double{lines[i - 1]});
  return widest;
}

}  // namespace

/// How a plane of a fan cuts a bed: directions in space, and directions in the plane, with their
/// components along elevation 0 and along the pole.
struct GridScan::Line {
  Line(const RayFan& fan, std::size_t plane)
      : sin_azimuth(fan.grid->planes[plane].sin_azimuth),
        cos_azimuth(fan.grid->planes[plane].cos_azimuth),
        normal(cos_azimuth * fan.array_axis - sin_azimuth * fan.middle) {
    const Vector3d level = fan.plane_direction(plane);
    up = Vector2d(level.z(), fan.pole.z()).normalized();
    ahead = {up.y(), -up.x()};
    up_in_space = up.x() * level + up.y() * fan.pole;
    ahead_in_space = ahead.x() * level + ahead.y() * fan.pole;
  }
  /// Whether a point, relative to the origin, is on the positive side of the plane, with the bits
  /// of off_plane().
  bool positive(const RayFan& fan, const Vector3d& from) const {
    return std::fma(cos_azimuth, dot(fan.array_axis, from),
                    -(sin_azimuth * dot(fan.middle, from))) >= 0.0;
  }
  double sin_azimuth, cos_azimuth;
  Vector3d normal, up_in_space, ahead_in_space;
  Vector2d up, ahead;  // unit: steepest up, and level in the order of elevation
};

struct GridScan::FanWalks {
  const RayFan* fan;
  const FanTables* tables;
  std::span<PlaneWalks> planes;
};

GridScan::GridScan(const refine::HeightGrid& grid) : grid_(&grid) {
  const auto cells_across = static_cast<std::size_t>(grid.columns() - 1),
             cells_up = static_cast<std::size_t>(grid.rows() - 1);
  const std::size_t tiles =
      static_cast<std::size_t>(grid.tile_columns()) * static_cast<std::size_t>(grid.tile_rows());
  constexpr std::size_t tile_floats = sizeof(refine::HeightGrid::Tile) / sizeof(float);
  usable_ = grid.tiles_in_file() == nullptr && grid.faces() == 2 * cells_across * cells_up &&
            tiles * tile_floats <= std::numeric_limits<std::int32_t>::max();
  if (!usable_) return;
  const refine::HeightGrid::Tile& first = grid.tile(0, 0);
  arrays_ = {.x = grid.x().data(),
             .y = grid.y().data(),
             .z = first.z_m.data(),
             .rising = first.rising.data(),
             .cells_across = static_cast<std::int64_t>(cells_across),
             .cells_up = static_cast<std::int64_t>(cells_up),
             .tiles_across = grid.tile_columns()};
  diagonal_m_ = std::hypot(widest_step(grid.x()), widest_step(grid.y()));
  longest_edge_m_ = diagonal_m_ * std::hypot(1.0, grid.steepest().norm());
}

bool GridScan::take(std::span<const RayFan> fans) {
  if (!usable_) return false;
  if (runs_.size() < fans.size()) runs_.resize(fans.size());
  row_count_ = other_count_;
  make_room(most_rows(fans));
  for (std::size_t i = 0; i < fans.size(); i += fans_together) {
    const std::size_t some = std::min(fans_together, fans.size() - i);
    if (!take(fans.subspan(i, some), std::span(runs_).subspan(i, some))) return false;
  }
  return true;
}

bool GridScan::take(const RayFan& fan, const MovedPoints& moved) {
  if (!usable_) return false;
  if (runs_.empty()) runs_.resize(1);
  row_count_ = other_count_;
  make_room(most_rows({&fan, 1}));
  arrays_.moved = &moved;
  const bool taken = take({&fan, 1}, std::span(runs_).first(1));
  arrays_.moved = nullptr;
  return taken;
}

FanFrame GridScan::frame(const RayFan& fan) const {
  FanFrame frame = frame_of(fan);
  if (arrays_.moved) frame.origin = {};  // moved positions are relative to it
  return frame;
}

double GridScan::allowed_slope() const { return arrays_.moved ? slope_of_moved : usual_slope; }

/// A point of the grid from the fan's origin; not finite if it is not among the moved ones.
Vector3d GridScan::from_origin(const RayFan& fan, std::ptrdiff_t column, std::ptrdiff_t row) const {
  if (!arrays_.moved)
    return grid_->point(static_cast<int>(column), static_cast<int>(row)).cast<double>() -
           fan.origin;
  const MovedPoints& moved = *arrays_.moved;
  const std::uint64_t columns = moved.columns[row];
  if (column < static_cast<std::ptrdiff_t>(columns & 0xffffffff) ||
      column >= static_cast<std::ptrdiff_t>(columns >> 32))
    return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const float* const place = moved.positions + 4 * (moved.column_0[row] + column);
  return {double{place[0]}, double{place[1]}, double{place[2]}};
}

/// Does the walks of several fans together, because the walks of one fan may leave lanes of a
/// register empty.
bool GridScan::take(std::span<const RayFan> fans, std::span<FanRuns> runs) {
  std::array<FanWalks, fans_together> room{};
  const std::span<FanWalks> some = std::span(room).first(fans.size());
  std::size_t planes = 0, elevations = 0;
  for (const RayFan& fan : fans) {
    planes += fan.planes();
    elevations = std::max(elevations, fan.elevations());
  }
  of_plane_.assign(planes, {});
  std::span<PlaneWalks> rest = of_plane_;
  for (std::size_t i = 0; i < fans.size(); ++i) {
    some[i] = {&fans[i], &tables_.of(fans[i].grid), rest.first(fans[i].planes())};
    rest = rest.subspan(fans[i].planes());
  }
  order_ = some.front().tables->order();
  walk_count_ = 0;
  for (const FanWalks& walks : some)
    if (!plan_walks(walks)) return false;
  // The walks of one SIMD group end together: short ones wait for the longest, so they come last.
  for (const bool whole : {true, false})
    for (const FanWalks& walks : some)
      for (std::size_t plane = 0; plane < walks.planes.size(); ++plane) {
        const PlaneWalks& its = walks.planes[plane];
        if (its.below_nadir < its.end && (its.end == walks.fan->elevations()) == whole &&
            !begin_walk(walks, Line(*walks.fan, plane), plane, true))
          return false;
      }
  for (const FanWalks& walks : some)
    for (std::size_t plane = 0; plane < walks.planes.size(); ++plane)
      if (walks.planes[plane].below_nadir > 0 &&
          !begin_walk(walks, Line(*walks.fan, plane), plane, false))
        return false;
  const auto lanes = static_cast<std::size_t>(walks_together());
  const std::size_t groups = (walk_count_ + lanes - 1) / lanes;
  room_of_walk_ = elevations + 1;
  const std::size_t found = groups * lanes * room_of_walk_ + widest_vector;
  if (intervals_.size() < found) {
    intervals_.resize(found);
    seen_.resize(found);
  }
  walk_grid({.grid = arrays_,
             .ascending = order_.ascending,
             .lines = order_.lines,
             .walks = walks_.data(),
             .groups = static_cast<std::int64_t>(groups),
             .intervals = intervals_.data(),
             .faces = seen_.data(),
             .room = static_cast<std::int64_t>(room_of_walk_)});
  for (std::size_t i = 0; i < fans.size(); ++i) {
    if (!stayed_on_grid(some[i])) return false;
    collect(some[i], runs[i]);
  }
  return true;
}

/// Finds the rays that the walks of each plane are for. Returns false if a plane cannot be
/// followed.
bool GridScan::plan_walks(const FanWalks& walks) {
  const RayFan& fan = *walks.fan;
  const FanTables& tables = *walks.tables;
  const std::size_t elevations = fan.elevations();
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    if (tables.uneven[plane]) return false;
    if (tables.left_out_from[plane] == 0 &&
        tables.left_out_until[plane] == static_cast<std::int64_t>(elevations))
      continue;
    const Line line(fan, plane);
    // Only the slope of the bed along the horizontal part of the plane's normal counts.
    const Vector2d level = line.normal.head<2>();
    if (!(std::abs(line.normal.z()) * level.cwiseAbs().dot(grid_->steepest()) <=
          allowed_slope() * level.squaredNorm()))
      return false;
    // The rays below the direction straight down in the plane.
    const Vector2d down = -line.up;
    std::size_t& below = walks.planes[plane].below_nadir;
    if (down.x() > 0.0) {
      const double q = down.y() / (down.x() + std::abs(down.y()));
      const auto first = tables.ascending.begin() + 1;
      below = static_cast<std::size_t>(
          std::lower_bound(first, first + static_cast<std::ptrdiff_t>(elevations), q) - first);
    } else {
      // All rays go outwards, unless the sonar is upside down or the last ray is beyond the zenith.
      const Vector2d last_ray(fan.grid->cos_elevation.back(), fan.grid->sin_elevation.back());
      if (down.y() > 0.0 || last_ray.dot(line.ahead) < 0.0) return false;
    }
    // In the outer planes of a fan only the lowest and the highest rays are within the beam. The
    // walk may end before the highest rays if these cannot reach the bed. Rays that are past
    // straight down rise with elevation, so the first of them decides.
    const auto last_below = static_cast<std::size_t>(tables.left_out_from[plane]);
    const auto first_above = static_cast<std::size_t>(tables.left_out_until[plane]);
    const auto reaches_bed = [&](std::size_t ray) {
      const double sink =
          -Vector2d(fan.grid->cos_elevation[ray], fan.grid->sin_elevation[ray]).dot(line.up) *
          line.up_in_space.z();
      return arrays_.moved ||
             sink * fan.range_m * (1.0 + 1e-9) >= fan.origin.z() - grid_->bounds().highest.z();
    };
    const bool no_more = last_below < first_above && below <= first_above &&
                         (first_above == elevations || !reaches_bed(first_above));
    walks.planes[plane].end = no_more ? last_below : elevations;
  }
  return true;
}

/// Whether no walk was doubtful, and none left the grid where its plane may come back.
bool GridScan::stayed_on_grid(const FanWalks& of_fan) const {
  const auto lanes = static_cast<std::size_t>(walks_together());
  for (std::size_t plane = 0; plane < of_fan.planes.size(); ++plane) {
    const Line line(*of_fan.fan, plane);
    for (const std::size_t walk : {of_fan.planes[plane].outwards, of_fan.planes[plane].inwards}) {
      if (walk == PlaneWalks::none) continue;
      const GridWalks& walks = walks_[walk / lanes];
      const std::size_t lane = walk % lanes;
      if (walks.doubtful[lane] != 0) return false;
      if (walks.left_grid[lane] == 0) continue;
      const int along = walks.left_column[lane] == walks.right_column[lane] ? 1 : 0;
      const double across = std::abs(line.normal[along]);
      if (!(std::abs(line.normal.z()) * grid_->steepest()[along] <= allowed_slope() * across &&
            across > 0.0))
        return false;
    }
  }
  return true;
}

/// Starts a walk at an edge before the first face that a ray can hit, if rays can hit any. Returns
/// false if there is no such edge.
bool GridScan::begin_walk(const FanWalks& of_fan, const Line& line, std::size_t plane,
                          bool outwards) {
  const RayFan& fan = *of_fan.fan;
  PlaneWalks& of_plane = of_fan.planes[plane];
  double lowest = grid_->bounds().lowest.z(), highest = grid_->bounds().highest.z();
  const double up_z = line.up_in_space.z();
  const Vector2d ray0(fan.grid->cos_elevation.front(), fan.grid->sin_elevation.front());
  const double sign = outwards ? 1.0 : -1.0;
  const double ray0_ahead = sign * ray0.dot(line.ahead), ray0_up = ray0.dot(line.up);
  // Distances along the walk from the origin: the lowest ray hits nothing nearer than start_m or
  // farther than reach_m.
  double start_m = 0.0, reach_m = fan.range_m;
  if (arrays_.moved) {
    if (!is_above_bed(fan.origin)) return false;
    constexpr double most_moved = 0.5;  // up or down, as a share of the depth
    lowest -= most_moved * (fan.origin.z() - lowest);
    highest += most_moved * (fan.origin.z() - highest);
  } else if (outwards && ray0_ahead > 0.0 && fan.origin.z() > highest) {
    if (ray0_up >= 0.0) return true;  // there is nothing to hit
    start_m = (fan.origin.z() - highest) / up_z * ray0_ahead / -ray0_up;
  } else if (!is_above_bed(fan.origin)) {
    return false;
  }
  if (!outwards && ray0_ahead > 0.0 && ray0_up < 0.0)
    reach_m = std::min(reach_m, (fan.origin.z() - lowest) / up_z * ray0_ahead / -ray0_up);
  if (start_m >= reach_m) return true;

  // The grid line to begin at: a column or a row, whichever the plane crosses more steeply.
  const Vector2d ahead = sign * line.ahead_in_space.head<2>();
  const int axis = std::abs(ahead.x()) >= std::abs(ahead.y()) ? 0 : 1;
  const std::span<const float> lines = axis == 0 ? grid_->x() : grid_->y();
  const std::span<const float> along = axis == 0 ? grid_->y() : grid_->x();
  const auto shift = [&](double z) {  // of the plane at that height
    return (z - fan.origin.z()) / up_z * line.up_in_space[axis];
  };
  const double straight = fan.origin[axis] + start_m * ahead[axis];
  std::ptrdiff_t number;
  if (ahead[axis] > 0.0) {
    const double before = straight + std::min(shift(lowest), shift(highest));
    number = std::lower_bound(lines.begin(), lines.end(), before) - lines.begin() - 1;
  } else {
    const double before = straight + std::max(shift(lowest), shift(highest));
    number = std::upper_bound(lines.begin(), lines.end(), before) - lines.begin();
  }
  const auto end = std::ssize(lines), last = std::ssize(along) - 1;
  if (number < 0 || number >= end) return false;

  // The edge of this grid line that crosses the plane. The signed distances of the line's points
  // from the plane are in order.
  const auto positive = [&](std::ptrdiff_t i) {
    return line.positive(fan,
                         axis == 0 ? from_origin(fan, number, i) : from_origin(fan, i, number));
  };
  const bool ascending = line.normal[1 - axis] > 0.0;
  const double middle = 0.5 * (lowest + highest);
  const double guess = fan.origin[1 - axis] + start_m * ahead[1 - axis] +
                       (middle - fan.origin.z()) / up_z * line.up_in_space[1 - axis];
  std::ptrdiff_t i = std::clamp<std::ptrdiff_t>(
      std::lower_bound(along.begin(), along.end(), guess) - along.begin(), 0, last - 1);
  while (i > 0 && positive(i) == ascending) --i;  // the crossing is before i
  while (i < last && positive(i + 1) != ascending) ++i;
  if (i == last || positive(i) == ascending || positive(i + 1) != ascending) return false;

  const auto lanes = static_cast<std::size_t>(walks_together());
  const std::size_t lane = walk_count_ % lanes;
  if (walks_.size() <= walk_count_ / lanes) walks_.emplace_back();
  GridWalks& walks = walks_[walk_count_ / lanes];
  if (lane == 0) walks = {};
  const FanFrame frame = this->frame(fan);
  for (std::size_t k = 0; k < walks.origin.size(); ++k) walks.origin[k][lane] = frame.origin[k];
  for (std::size_t k = 0; k < walks.axes.size(); ++k) walks.axes[k][lane] = frame.axes[k];
  walks.range_m2[lane] = fan.range_m * fan.range_m * (1.0 - 1e-9);
  walks.doubt_m2[lane] = rounding * longest_edge_m_ * fan.range_m;
  walks.elevations[lane] = static_cast<std::int64_t>(fan.elevations());
  const ElevationOrder order = of_fan.tables->order();
  walks.ascending[lane] = numbers_between(order_.ascending, order.ascending);
  walks.lines[lane] = numbers_between(order_.lines, order.lines);
  walks.first_q[lane] = order.first_q;
  walks.steps_per_q[lane] = order.steps_per_q;
  walks.last_step[lane] = order.steps - 1.0;
  walks.sin_azimuth[lane] = line.sin_azimuth;
  walks.cos_azimuth[lane] = line.cos_azimuth;
  walks.ahead_x[lane] = sign * line.ahead.x();
  walks.ahead_y[lane] = sign * line.ahead.y();
  const Vector2d cells(
      ahead.x() * static_cast<double>(arrays_.cells_across) /
          (grid_->x().back() - grid_->x().front()),
      ahead.y() * static_cast<double>(arrays_.cells_up) / (grid_->y().back() - grid_->y().front()));
  const double max_cells = cells.cwiseAbs().maxCoeff();
  walks.columns_ahead[lane] = cells.x() / max_cells;
  walks.rows_ahead[lane] = cells.y() / max_cells;
  walks.reach_m[lane] = reach_m * (1.0 + 1e-9) + 1e-9;
  const bool positive_left = line.normal.x() * -ahead.y() + line.normal.y() * ahead.x() > 0.0;
  walks.positive_left[lane] = positive_left ? -1 : 0;
  walks.outwards[lane] = outwards ? -1 : 0;
  walks.active[lane] = -1;
  const bool first_left = !ascending == positive_left;  // the end at i
  const std::ptrdiff_t left = first_left ? i : i + 1, right = first_left ? i + 1 : i;
  walks.left_column[lane] = axis == 0 ? number : left;
  walks.left_row[lane] = axis == 0 ? left : number;
  walks.right_column[lane] = axis == 0 ? number : right;
  walks.right_row[lane] = axis == 0 ? right : number;
  walks.from[lane] = outwards ? static_cast<std::int64_t>(of_plane.below_nadir) : 0;
  walks.until[lane] = static_cast<std::int64_t>(outwards ? of_plane.end : of_plane.below_nadir);
  (outwards ? of_plane.outwards : of_plane.inwards) = walk_count_++;
  return true;
}

/// Whether a point is above the cell that is under it.
bool GridScan::is_above_bed(const Vector3d& place) const {
  const auto cell = [](std::span<const float> lines, double at) {
    return static_cast<int>(std::upper_bound(lines.begin(), lines.end(), at) - lines.begin()) - 1;
  };
  const int column = cell(grid_->x(), place.x()), row = cell(grid_->y(), place.y());
  if (column < 0 || row < 0 || column >= grid_->columns() - 1 || row >= grid_->rows() - 1)
    return false;
  for (const int north : {0, 1})
    for (const int east : {0, 1})
      if (!(grid_->point(column + east, row + north).z() < place.z())) return false;
  return true;
}

void GridScan::keep_first(const refine::Triangles& others, std::uint64_t version,
                          std::span<const RayFan> fans) {
  if (std::exchange(others_, version) == version) return;
  other_count_ = others.faces.size();
  make_room(most_rows(fans));
  const std::size_t rows = corners_.size();
  for (std::size_t i = 0; i < other_count_; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      positions_[k * rows + i] = others.positions[others.faces[i][k]];
    numbers_[i] = others.number(static_cast<std::uint32_t>(i));
  }
}

/// How many rows the other faces and the runs of some fans may take.
std::size_t GridScan::most_rows(std::span<const RayFan> fans) const {
  std::size_t most = other_count_;
  for (const RayFan& fan : fans) most += fan.grid->rays();
  return most;
}

void GridScan::make_room(std::size_t faces) {
  if (faces <= room_) return;
  const std::vector<Eigen::Vector3f> before = std::move(positions_);
  const std::size_t rows_before = corners_.size();
  room_ = faces;
  const std::size_t rows = room_ + widest_vector;
  numbers_.resize(rows);
  positions_.resize(3 * rows);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < std::min(other_count_, rows_before); ++i)
      positions_[k * rows + i] = before[k * rows_before + i];
  corners_.resize(rows);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t corner = 0; corner < 3; ++corner)
      corners_[i][corner] = static_cast<std::uint32_t>(corner * rows + i);
}

/// Appends the faces that a walk has found, as runs of the rays within the beam.
void lay_in_beam(const FanTables& tables, std::size_t plane, const FoundFaces& found,
                 GridRunArgs& args) {
  const std::int64_t out_from = tables.left_out_from[plane],
                     out_until = tables.left_out_until[plane];
  if (out_from == out_until) return lay_runs(args, found, 0, all_rays);
  const std::uint64_t *const first = found.intervals, *const end = first + found.count;
  const std::int64_t before =
      std::partition_point(first, end,
                           [&](std::uint64_t interval) { return begin_of(interval) < out_from; }) -
      first;
  const std::int64_t behind =
      std::partition_point(first, end,
                           [&](std::uint64_t interval) { return end_of(interval) <= out_until; }) -
      first;
  lay_runs(args, {found.intervals, found.faces, before}, 0, out_from);
  lay_runs(args, {found.intervals + behind, found.faces + behind, found.count - behind}, out_until,
           all_rays);
}

/// Removes rays at the ends of runs that meet their face beyond the range, as list_runs() of
/// fan_scan does, and then runs without rays. `far` lists the runs that may have such rays. Returns
/// the new end of the runs before `end`.
std::int64_t trim(const RayFan& fan, std::span<const std::uint32_t> far, std::int64_t end,
                  FanRuns& runs) {
  if (far.empty()) return end;
  const auto beyond = [&](std::uint32_t run, std::uint32_t ray) {
    const double facing = std::fma(runs.level[run], fan.grid->cos_elevation[ray],
                                   runs.pole[run] * fan.grid->sin_elevation[ray]);
    return !(runs.distance[run] / facing <= fan.range_m);
  };
  for (const std::uint32_t run : far) {
    std::uint32_t &begin = runs.begin[run], &last = runs.end[run];
    while (begin < last && beyond(run, begin)) ++begin;
    while (begin < last && beyond(run, last - 1)) --last;
  }
  std::size_t to = far.front();
  for (std::size_t run = to; run < static_cast<std::size_t>(end); ++run) {
    if (runs.begin[run] == runs.end[run]) continue;
    runs.begin[to] = runs.begin[run], runs.end[to] = runs.end[run];
    runs.copy_face(to++, runs, run);
  }
  return static_cast<std::int64_t>(to);
}

/// Appends the runs of a fan, from its walks.
void GridScan::collect(const FanWalks& of_fan, FanRuns& runs) {
  const RayFan& fan = *of_fan.fan;
  runs.start(*fan.grid);
  far_.resize(fan.elevations() + widest_vector);
  GridRunArgs args{.grid = arrays_,
                   .frame = frame(fan),
                   .row = static_cast<std::int64_t>(row_count_),
                   .begin = runs.begin.data(),
                   .end = runs.end.data(),
                   .index = runs.index.data(),
                   .face = runs.face.data(),
                   .level = runs.level.data(),
                   .pole = runs.pole.data(),
                   .distance = runs.distance.data(),
                   .numbers = numbers_.data(),
                   .positions = positions_.front().data(),
                   .rows = static_cast<std::int64_t>(corners_.size()),
                   .far = far_.data()};
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    args.sin_azimuth = of_fan.tables->sin_azimuth[plane];
    args.cos_azimuth = of_fan.tables->cos_azimuth[plane];
    args.far_count = 0;
    FoundFaces inwards = found_by(of_fan.planes[plane].inwards);
    FoundFaces outwards = found_by(of_fan.planes[plane].outwards);
    // Both walks may see the face below the origin.
    if (inwards.count > 0 && outwards.count > 0 && inwards.faces[0] == outwards.faces[0] &&
        end_of(inwards.intervals[0]) == begin_of(outwards.intervals[0])) {
      outwards.intervals[0] =
          (outwards.intervals[0] >> 32 << 32) | (inwards.intervals[0] & 0xffffffff);
      ++inwards.intervals, ++inwards.faces, --inwards.count;
    }
    std::reverse(inwards.intervals, inwards.intervals + inwards.count);
    std::reverse(inwards.faces, inwards.faces + inwards.count);
    for (const FoundFaces& found : {inwards, outwards})
      lay_in_beam(*of_fan.tables, plane, found, args);
    args.run = trim(fan, {far_.data(), static_cast<std::size_t>(args.far_count)}, args.run, runs);
    runs.first.push_back(static_cast<std::size_t>(args.run));
  }
  row_count_ = static_cast<std::size_t>(args.row);
}

/// What a walk has found.
FoundFaces GridScan::found_by(std::size_t walk) {
  if (walk == PlaneWalks::none) return {};
  const auto lanes = static_cast<std::size_t>(walks_together());
  return {.intervals = intervals_.data() + walk * room_of_walk_,
          .faces = seen_.data() + walk * room_of_walk_,
          .count = walks_[walk / lanes].count[walk % lanes]};
}

refine::Triangles GridScan::triangles() const {
  return {positions_, std::span(corners_).first(row_count_), std::span(numbers_).first(row_count_)};
}

}  // namespace ensonify::engine
