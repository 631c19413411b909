#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>

#include <algorithm>
#include <utility>

#include <ensonify/engine/trace/face_sources/exact_faces.h>

namespace ensonify::engine {
namespace {

/// A sphere around the mesh, centred at the middle of its bounds.
refine::Sphere sphere_around(const refine::TriangleMesh& mesh) {
  const refine::Bounds box = refine::bounds(mesh);
  const Eigen::Vector3f middle = 0.5f * (box.lowest + box.highest);
  float radius_m = 0.0f;
  for (const Eigen::Vector3f& p : mesh.positions)
    radius_m = std::max(radius_m, (p - middle).norm());
  return {middle, radius_m};
}

}  // namespace

void FacesWithBodies::NearestOfTwo::intersect(const RayFan& fan, std::span<Hit> hits) const {
  fixed_->intersect(fan, hits);
  of_bodies_.resize(hits.size());
  bodies_->intersect(fan, of_bodies_);
  merge(hits);
}

void FacesWithBodies::NearestOfTwo::intersect(std::span<const Ray> rays,
                                              std::span<Hit> hits) const {
  fixed_->intersect(rays, hits);
  of_bodies_.resize(hits.size());
  bodies_->intersect(rays, of_bodies_);
  merge(hits);
}

void FacesWithBodies::NearestOfTwo::merge(std::span<Hit> hits) const {
  for (std::size_t i = 0; i < hits.size(); ++i)
    if (of_bodies_[i] && of_bodies_[i].t < hits[i].t) {
      hits[i] = of_bodies_[i];
      hits[i].index += fixed_faces_;
    }
}

FacesWithBodies::FacesWithBodies(std::unique_ptr<FaceSource> fixed, std::uint32_t fixed_faces,
                                 const FaceSourceParts& parts)
    : fixed_(std::move(fixed)),
      fixed_faces_(fixed_faces),
      nearest_(make_intersector(parts.intersector, {}, parts.options.of_one_ping())) {}

/// The sphere around the body at its place, with a margin for the rounding of vertices to floats.
refine::Sphere FacesWithBodies::Body::ball() const {
  const Eigen::Vector3f middle = (place * around.centre.cast<double>()).cast<float>();
  return {middle, around.radius + 1e-6f * (around.radius + middle.norm())};
}

std::size_t FacesWithBodies::add(refine::TriangleMesh mesh, const Eigen::Isometry3d& place) {
  check_vertices(mesh);
  const std::size_t number = free_body();
  if (number == bodies_.size()) bodies_.emplace_back();
  const refine::Sphere around = sphere_around(mesh);
  bodies_[number] = {std::move(mesh), around, place};
  return number;
}

std::size_t FacesWithBodies::free_body() const {
  const auto free =
      std::ranges::find_if(bodies_, [](const Body& body) { return body.mesh.faces.empty(); });
  return static_cast<std::size_t>(free - bodies_.begin());
}

void FacesWithBodies::move(std::size_t body, const Eigen::Isometry3d& place) {
  bodies_[body].place = place;
  bodies_[body].moved = true;
}

void FacesWithBodies::remove(std::size_t body) {
  bodies_[body] = {};
  while (!bodies_.empty() && bodies_.back().mesh.faces.empty()) bodies_.pop_back();
  in_tree_.clear();  // the tree still has its faces
}

Faces FacesWithBodies::prepare(std::span<const RayFan> fans) {
  find_wanted(fans);
  const Faces fixed = fixed_->prepare(fans);
  return wanted_.empty() ? std::get<Faces>(without_bodies(fixed)) : with_bodies(fixed);
}

TracedFaces FacesWithBodies::prepare_runs(std::span<const RayFan> fans) {
  find_wanted(fans);
  if (wanted_.empty()) return without_bodies(fixed_->prepare_runs(fans));
  return with_bodies(fixed_->prepare(fans));  // needs hits, to compare them with bodies' hits
}

TracedFaces FacesWithBodies::prepare_bed(std::span<const RayFan> fans) {
  find_wanted(fans);
  if (wanted_.empty()) return without_bodies(fixed_->prepare_bed(fans));
  return with_bodies(fixed_->prepare(fans));
}

void FacesWithBodies::find_wanted(std::span<const RayFan> fans) {
  wanted_.clear();
  if (bodies_.empty()) return;
  volumes_.clear();
  for (const RayFan& fan : fans) volumes_.push_back(fan_volume_of(fan));
  view_.look_at(volumes_);
  for (std::size_t body = 0; body < bodies_.size(); ++body)
    if (!bodies_[body].mesh.faces.empty() && view_.touches(bodies_[body].ball()))
      wanted_.push_back(body);
}

/// Returns what the fixed source prepared, if the fans touch no body. Adds the version of this
/// source to the version of the faces.
TracedFaces FacesWithBodies::without_bodies(TracedFaces fixed) {
  if (std::exchange(joined_, false)) ++version_;
  if (bodies_.empty()) release();
  if (auto* const faces = std::get_if<Faces>(&fixed)) faces->version += version_;
  if (auto* const bed = std::get_if<BedAndObjects>(&fixed)) {
    bed->objects.version += version_;
    bed->source = this;
  }
  return fixed;
}

/// Returns the fixed faces together with the faces of the wanted bodies.
Faces FacesWithBodies::with_bodies(const Faces& fixed) {
  if (std::exchange(joined_, true)) ++version_;
  const bool moved =
      std::ranges::any_of(wanted_, [&](std::size_t body) { return bodies_[body].moved; });
  if (moved || wanted_ != in_tree_) gather();
  join(fixed);
  nearest_.set_fixed(*fixed.intersector, joined_faces_);
  return {&nearest_, {all_.positions, all_.faces, all_numbers_}, version_ + fixed.version};
}

/// Moves the wanted bodies' faces to their places, and builds their tree.
void FacesWithBodies::gather() {
  in_tree_.clear();  // until the tree is built
  seen_.positions.clear();
  seen_.faces.clear();
  seen_numbers_.clear();
  for (const std::size_t body : wanted_) {
    Body& its = bodies_[body];
    const auto first = static_cast<std::uint32_t>(seen_.positions.size());
    for (const Eigen::Vector3f& p : its.mesh.positions)
      seen_.positions.emplace_back((its.place * p.cast<double>()).cast<float>());
    for (const refine::Face& face : its.mesh.faces)
      seen_.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
    seen_numbers_.resize(seen_.faces.size(), fixed_faces_ + static_cast<std::uint32_t>(body));
    its.moved = false;
  }
  nearest_.build({seen_.positions, seen_.faces, seen_numbers_});
  in_tree_ = wanted_;
}

/// Copies the fixed faces, unless they are there already, and appends the bodies' faces.
void FacesWithBodies::join(const Faces& of_fixed) {
  const refine::Triangles& fixed = of_fixed.triangles;
  if (joined_faces_ == 0 || joined_version_ != of_fixed.version) {
    all_.positions.reserve(fixed.positions.size() + seen_.positions.size());
    all_.faces.reserve(fixed.faces.size() + seen_.faces.size());
    all_.positions.assign(fixed.positions.begin(), fixed.positions.end());
    all_.faces.assign(fixed.faces.begin(), fixed.faces.end());
    all_numbers_.resize(fixed.faces.size());
    for (std::uint32_t i = 0; i < all_numbers_.size(); ++i) all_numbers_[i] = fixed.number(i);
    joined_version_ = of_fixed.version;
    joined_positions_ = fixed.positions.size();
    joined_faces_ = fixed.faces.size();
  }
  all_.positions.resize(joined_positions_);
  all_.positions.insert(all_.positions.end(), seen_.positions.begin(), seen_.positions.end());
  all_.faces.resize(joined_faces_);
  const auto first = static_cast<std::uint32_t>(joined_positions_);
  for (const refine::Face& face : seen_.faces)
    all_.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
  all_numbers_.resize(joined_faces_);
  all_numbers_.insert(all_numbers_.end(), seen_numbers_.begin(), seen_numbers_.end());
  ++version_;
}

/// Frees the copies of the faces, which nothing needs without a body.
void FacesWithBodies::release() {
  all_ = {};
  all_numbers_ = {};
  joined_positions_ = joined_faces_ = 0;
}

}  // namespace ensonify::engine
