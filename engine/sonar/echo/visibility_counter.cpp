#include <ensonify/engine/sonar/echo/visibility_counter.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;

constexpr double faces_per_ping = 2e3;
constexpr double parts_per_sr = 0x1p44;

/// The solid angle of a ray.
double solid_angle_sr(const FanGrid& grid, std::size_t plane, std::size_t elevation) {
  const std::size_t last = grid.elevation_rad.size() - 1;
  const double step_rad = 0.5 * (grid.elevation_rad[std::min(elevation + 1, last)] -
                                 grid.elevation_rad[elevation > 0 ? elevation - 1 : 0]);
  return grid.cos_elevation[elevation] * step_rad * grid.planes[plane].width_rad;
}

}  // namespace

ObjectVisibility& ObjectVisibility::operator+=(const ObjectVisibility& other) {
  alone += other.alone;
  seen += other.seen;
  return *this;
}

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
  const double distance_m = away.norm();
  return distance_m <= fan.range_m + object.radius_m &&
         std::abs(away.dot(fan.array_axis)) <=
             object.radius_m + fan.grid->sin_truncation * distance_m;
}

/// Finds the faces of the wanted objects among the triangles of a ping.
void VisibilityCounter::find_faces(refine::Triangles triangles) {
  their_faces_.clear();
  if (triangles.numbers.empty()) {  // all, in order
    for (const std::uint32_t number : wanted_)
      for (std::uint32_t i = 0; i < objects_[number].faces; ++i)
        their_faces_.push_back({number, objects_[number].first_face + i});
    return;
  }
  const std::uint32_t least = objects_.front().first_face;
  for (std::uint32_t place = 0; place < triangles.numbers.size(); ++place) {
    const std::uint32_t face = triangles.numbers[place];
    if (face < least) continue;
    const auto behind = std::ranges::upper_bound(objects_, face, {}, &Object::first_face);
    const auto number = static_cast<std::uint32_t>(behind - objects_.begin() - 1);
    if (std::ranges::binary_search(wanted_, number)) their_faces_.push_back({number, place});
  }
  std::ranges::sort(their_faces_);
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
  Eigen::Matrix3d corners;  // along the array, towards the middle, along the pole
  for (int k = 0; k < 3; ++k) {
    const Vector3d to = triangles.corner(face, k) - fan.origin;
    corners.col(k) << fan.array_axis.dot(to), fan.middle.dot(to), fan.pole.dot(to);
  }
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const FanGrid::Plane& p = fan.grid->planes[plane];
    const Eigen::RowVector3d beside =
        p.cos_azimuth * corners.row(0) - p.sin_azimuth * corners.row(1);
    if (beside.minCoeff() >= 0.0 || beside.maxCoeff() < 0.0) continue;  // most planes
    const Eigen::RowVector3d ahead =
        p.sin_azimuth * corners.row(0) + p.cos_azimuth * corners.row(1);
    cover_plane(fan, plane, beside, ahead, corners.row(2));
  }
}

void VisibilityCounter::cover_plane(const RayFan& fan, std::size_t plane,
                                    const Eigen::RowVector3d& beside,
                                    const Eigen::RowVector3d& ahead, const Eigen::RowVector3d& up) {
  double low = 2.0, high = -2.0, nearest_m = fan.range_m + 1.0;  // elevations of the cut
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    if ((beside[a] >= 0.0) == (beside[b] >= 0.0)) continue;
    const double share = beside[a] / (beside[a] - beside[b]);
    const double x = ahead[a] + share * (ahead[b] - ahead[a]), y = up[a] + share * (up[b] - up[a]);
    if (x <= 0.0) return;  // behind the sonar
    low = std::min(low, std::atan2(y, x));
    high = std::max(high, std::atan2(y, x));
    nearest_m = std::min(nearest_m, std::hypot(x, y));
  }
  if (!(nearest_m <= fan.range_m)) return;
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
