#include <ensonify/engine/sonar/echo/visibility_counter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr double faces_per_ping = 2e3;
constexpr double parts_per_sr = 0x1p44;
constexpr double rounding = 1e-12;  // far above a tangent's rounding

/// The solid angle of a ray.
double solid_angle_sr(const FanGrid& grid, std::size_t plane, std::size_t elevation) {
  const std::size_t last = grid.elevation_rad.size() - 1;
  const double step_rad = 0.5 * (grid.elevation_rad[std::min(elevation + 1, last)] -
                                 grid.elevation_rad[elevation > 0 ? elevation - 1 : 0]);
  return grid.cos_elevation[elevation] * step_rad * grid.planes[plane].width_rad;
}

/// Cuts a line to its part within the range; false if there is no such part.
bool cut_to_range(std::array<Eigen::Vector2d, 2>& ends, double range_m) {
  const double range2 = range_m * range_m;
  if (ends[0].squaredNorm() <= range2 && ends[1].squaredNorm() <= range2) return true;
  const Eigen::Vector2d from = ends[0], way = ends[1] - ends[0];
  const double way2 = way.squaredNorm(), nearest = -from.dot(way);  // times way2: the share
  const double root2 = nearest * nearest - way2 * (from.squaredNorm() - range2);
  if (!(way2 > 0.0 && root2 > 0.0)) return false;
  const double root = std::sqrt(root2);
  const double first = std::max((nearest - root) / way2, 0.0),
               last = std::min((nearest + root) / way2, 1.0);
  if (!(first < last)) return false;
  ends = {from + first * way, from + last * way};
  return true;
}

}  // namespace

VisibilityCounter::VisibilityCounter(const Seafloor& seafloor)
    : visibilities_(seafloor.objects.size()) {
  if (visibilities_.empty()) return;
  for (const ObjectRecord& record : seafloor.objects)
    objects_.push_back({record.middle_m, 0.5 * record.size_m.norm(), 0, 0, 1});
  // The objects' faces come after the bed's, object by object.
  for (auto face = static_cast<std::uint32_t>(seafloor.bed_faces); face < seafloor.faces; ++face) {
    const std::size_t instance = seafloor.labels[seafloor.label_of(face)].instance;
    if (instance == 0 || instance > objects_.size()) continue;
    Object& object = objects_[instance - 1];
    if (object.faces++ == 0) object.first_face = face;
  }
  for (std::size_t i = 1; i < objects_.size(); ++i)
    if (objects_[i].faces == 0) objects_[i].first_face = objects_[i - 1].first_face;
  for (Object& object : objects_)
    object.every = 1 + static_cast<std::uint64_t>(object.faces / faces_per_ping);
}

bool VisibilityCounter::in_view(const Object& object, const RayFan& fan) const {
  const Vector3d away = object.middle - fan.origin;
  const double distance_m = away.norm(), beside_m = away.dot(fan.array_axis);
  if (distance_m > fan.range_m + object.radius_m ||
      std::abs(beside_m) > object.radius_m + fan.grid->sin_truncation * distance_m)
    return false;
  // What is behind both outermost planes is behind the planes between them: their directions are
  // sums of positive shares of these two directions, and the shares add up to at least 1.
  const double before_m = away.dot(fan.middle);
  const auto is_behind = [&](const FanGrid::Plane& plane) {
    return plane.sin_azimuth * beside_m + plane.cos_azimuth * before_m < -object.radius_m;
  };
  return !is_behind(fan.grid->planes.front()) || !is_behind(fan.grid->planes.back());
}

/// Finds the faces of the wanted objects among the triangles of a ping, object by object.
void VisibilityCounter::find_faces(refine::Triangles triangles) {
  their_faces_.clear();
  if (triangles.numbers.empty()) {  // all, in order
    for (const std::uint32_t number : wanted_)
      for (std::uint32_t i = 0; i < objects_[number].faces; ++i)
        their_faces_.emplace_back(number, objects_[number].first_face + i);
    return;
  }
  const auto is_of = [](const Object& object, std::uint32_t face) {
    return face >= object.first_face && face - object.first_face < object.faces;
  };
  found_.clear();
  first_of_wanted_.assign(wanted_.size() + 1, 0);
  // The index in wanted_ of the last face's object, and a gap between the faces of objects. The
  // next face is mostly in the same object or gap.
  std::size_t wanted = 0;
  std::uint32_t gap = 0, gap_end = 0;
  for (std::uint32_t place = 0; place < triangles.numbers.size(); ++place) {
    const std::uint32_t face = triangles.numbers[place];
    if (face >= gap && face < gap_end) continue;
    if (!is_of(objects_[wanted_[wanted]], face)) {
      const auto behind = std::ranges::upper_bound(
          wanted_, face, {}, [this](std::uint32_t number) { return objects_[number].first_face; });
      const Object* before = behind == wanted_.begin() ? nullptr : &objects_[*(behind - 1)];
      if (!before || !is_of(*before, face)) {
        gap = before ? before->first_face + before->faces : 0;
        gap_end = behind == wanted_.end() ? std::numeric_limits<std::uint32_t>::max()
                                          : objects_[*behind].first_face;
        continue;
      }
      wanted = static_cast<std::size_t>(behind - wanted_.begin() - 1);
    }
    found_.emplace_back(static_cast<std::uint32_t>(wanted), place);
    ++first_of_wanted_[wanted + 1];
  }
  std::partial_sum(first_of_wanted_.begin(), first_of_wanted_.end(), first_of_wanted_.begin());
  their_faces_.resize(found_.size());
  for (const auto& [of, place] : found_)
    their_faces_[first_of_wanted_[of]++] = {wanted_[of], place};
}

void VisibilityCounter::look(const RayFan& fan, refine::Triangles triangles, const FanRuns& runs,
                             std::uint64_t ping) {
  wanted_.clear();
  for (std::uint32_t i = 0; i < objects_.size(); ++i)
    if (objects_[i].faces > 0 && ping % objects_[i].every == 0 && in_view(objects_[i], fan))
      wanted_.push_back(i);
  if (wanted_.empty() || triangles.faces.empty()) return;
  find_faces(triangles);
  const std::size_t planes = fan.planes(), elevations = fan.elevations();
  tangents_.clear();
  for (const FanGrid::Plane& plane : fan.grid->planes)
    tangents_.push_back(plane.sin_azimuth / plane.cos_azimuth);
  covered_.resize(planes * elevations);
  spans_.resize(planes);
  const auto all = std::span<const std::pair<std::uint32_t, std::uint32_t>>(their_faces_);
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    const std::uint32_t number = all[begin].first;
    std::ranges::fill(spans_, Span{elevations, 0});
    for (end = begin; end < all.size() && all[end].first == number; ++end)
      cover(fan, triangles, all[end].second);
    const Object& object = objects_[number];
    for (std::size_t plane = 0; plane < planes; ++plane) {
      std::size_t run = runs.first[plane];
      for (std::size_t j = spans_[plane].from; j < spans_[plane].until; ++j) {
        const std::size_t ray = plane * elevations + j;
        if (std::exchange(covered_[ray], std::uint8_t{0}) == 0 || !fan.grid->within_beam(plane, j))
          continue;
        const auto part = static_cast<std::uint64_t>(
            std::llround(parts_per_sr * solid_angle_sr(*fan.grid, plane, j)));
        visibilities_[number].alone += part;
        while (run < runs.first[plane + 1] && runs.end[run] <= j) ++run;
        if (run < runs.first[plane + 1] && runs.begin[run] <= j &&
            runs.face[run] >= object.first_face &&
            runs.face[run] - object.first_face < object.faces)
          visibilities_[number].seen += part;
      }
    }
  }
}

/// Marks the rays that go through a face, in every plane that cuts it.
void VisibilityCounter::cover(const RayFan& fan, refine::Triangles triangles, std::uint32_t face) {
  const std::array<Vector3d, 3> to{triangles.corner(face, 0) - fan.origin,
                                   triangles.corner(face, 1) - fan.origin,
                                   triangles.corner(face, 2) - fan.origin};
  const auto along = [&](const Vector3d& axis) {
    return Eigen::RowVector3d(axis.dot(to[0]), axis.dot(to[1]), axis.dot(to[2]));
  };
  const Eigen::RowVector3d across = along(fan.array_axis), before = along(fan.middle);
  const auto beside_plane = [&](const FanGrid::Plane& plane) -> Eigen::RowVector3d {
    return plane.cos_azimuth * across - plane.sin_azimuth * before;
  };
  // If the face is in front of the sonar, the planes that cut it lie between the azimuths of its
  // corners.
  std::size_t first = 0, end = fan.planes();
  if (before.minCoeff() > 0.0) {
    if (beside_plane(fan.grid->planes.front()).maxCoeff() < 0.0 ||
        beside_plane(fan.grid->planes.back()).minCoeff() >= 0.0)
      return;
    const Eigen::RowVector3d tangents = across.cwiseQuotient(before);
    const double margin = rounding * (1.0 + tangents.cwiseAbs().maxCoeff());
    while (first < end && tangents_[first] < tangents.minCoeff() - margin) ++first;
    while (first < end && tangents_[end - 1] > tangents.maxCoeff() + margin) --end;
  }
  const Eigen::RowVector3d up = along(fan.pole);
  for (std::size_t plane = first; plane < end; ++plane) {
    const FanGrid::Plane& p = fan.grid->planes[plane];
    const Eigen::RowVector3d beside = beside_plane(p);
    if (beside.minCoeff() >= 0.0 || beside.maxCoeff() < 0.0) continue;
    const Eigen::RowVector3d ahead = p.sin_azimuth * across + p.cos_azimuth * before;
    cover_plane(fan, plane, beside, ahead, up);
  }
}

void VisibilityCounter::cover_plane(const RayFan& fan, std::size_t plane,
                                    const Eigen::RowVector3d& beside,
                                    const Eigen::RowVector3d& ahead, const Eigen::RowVector3d& up) {
  std::array<Eigen::Vector2d, 2> ends;  // of the cut
  std::size_t found = 0;
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    if ((beside[a] >= 0.0) == (beside[b] >= 0.0)) continue;
    const double share = beside[a] / (beside[a] - beside[b]);
    ends[found] = {ahead[a] + share * (ahead[b] - ahead[a]), up[a] + share * (up[b] - up[a])};
    if (ends[found++].x() <= 0.0) return;  // behind the sonar
  }
  if (!cut_to_range(ends, fan.range_m)) return;
  const auto elevation_rad = [](const Eigen::Vector2d& at) { return std::atan2(at.y(), at.x()); };
  const auto [low, high] = std::minmax({elevation_rad(ends[0]), elevation_rad(ends[1])});
  const std::vector<double>& elevations = fan.grid->elevation_rad;
  const auto first =
      static_cast<std::size_t>(std::ranges::lower_bound(elevations, low) - elevations.begin());
  Span& span = spans_[plane];
  for (std::size_t j = first; j < elevations.size() && elevations[j] <= high; ++j) {
    covered_[plane * elevations.size() + j] = 1;
    span.from = std::min(span.from, j);
    span.until = std::max(span.until, j + 1);
  }
}

}  // namespace ensonify::engine
