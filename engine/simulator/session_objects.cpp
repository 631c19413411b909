#include <ensonify/engine/simulator/session_objects.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::engine {
namespace {

/// The limit of a position, and of the distance of a mesh's vertices from its origin. It is more
/// than the Earth's size, and every intersector accepts the vertices of such a mesh at such a
/// place.
constexpr double farthest_m = 1e8;
/// The limit of a turn: far above any vehicle's, and products with times and lever arms are finite.
constexpr double largest_rate_degps = 1e6;

/// A mesh's place: z up and y forward, where the body has x forward, y to starboard and z down.
Eigen::Isometry3d place_of(const Pose& pose) {
  Eigen::Matrix3d mesh_to_body;
  mesh_to_body << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.linear() = body_to_world(pose) * mesh_to_body;
  place.translation() = pose.position;
  return place;
}

Pose pose_of(const ObjectPose& object) {
  return {.t_s = object.t_s,
          .position = object.place_m,
          .roll_rad = object.roll_rad,
          .pitch_rad = object.pitch_rad,
          .heading_rad = object.heading_rad};
}

/// The number of a name in a list, or the number that it gets at the end of the list. Number 0
/// means no name.
std::size_t number_in(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin() + 1, names.end(), name) - names.begin());
}

/// The number of a name in a list, to whose end it is added if it is new.
std::size_t join(std::vector<std::string>& names, std::string name) {
  const std::size_t number = number_in(names, name);
  if (number == names.size()) names.push_back(std::move(name));
  return number;
}

}  // namespace

void check_pose(const Pose& pose) {
  const Eigen::Vector3d rates_radps{pose.roll_rate_radps, pose.pitch_rate_radps,
                                    pose.heading_rate_radps};
  const Eigen::Vector4d others{pose.t_s, pose.roll_rad, pose.pitch_rad, pose.heading_rad};
  if (!pose.position.allFinite() || !pose.velocity_mps.allFinite() || !rates_radps.allFinite() ||
      !others.allFinite())
    throw std::invalid_argument("Simulator: the pose, its time or one of its rates is not finite");
  if (pose.position.cwiseAbs().maxCoeff() > farthest_m)
    throw std::invalid_argument(
        fmt::format("Simulator: the pose is at ({:.4g}, {:.4g}, {:.4g}) m, expected within {:g} m",
                    pose.position.x(), pose.position.y(), pose.position.z(), farthest_m));
  if (rates_radps.cwiseAbs().maxCoeff() > largest_rate_degps * degree)
    throw std::invalid_argument(
        fmt::format("Simulator: the pose turns at {:.4g} degrees per second, expected at most {:g}",
                    rates_radps.cwiseAbs().maxCoeff() / degree, largest_rate_degps));
}

SessionObjects::SessionObjects(const Seafloor& seafloor, FacesWithBodies& faces)
    : faces_(faces),
      fixed_labels_(seafloor.labels.size()),
      first_instance_(seafloor.objects.size() + seafloor.features.size() + 1),
      classes_(seafloor.classes),
      materials_(seafloor.materials) {}

void SessionObjects::check(const MovingObject& object, const Pose& pose) const {
  check_pose(pose);
  if (object.mesh.faces.empty()) throw std::invalid_argument("Simulator: the mesh has no faces");
  if (object.class_name.empty() || object.class_name == name_of_number_0)
    throw std::invalid_argument(fmt::format(
        "Simulator: the object's class is \"{}\", expected a name other than \"{}\", that of "
        "number 0",
        object.class_name, name_of_number_0));
  if (fixed_labels_ + faces_.free_body() >= max_labels)
    throw std::invalid_argument(fmt::format(
        "Simulator: there are {} objects and other labels, and no room for more: remove one",
        max_labels));
  if (number_in(classes_, object.class_name) > max_labels)
    throw std::invalid_argument(fmt::format(
        "Simulator: '{}' is a new class, and there have been {}, the most that the layer of "
        "classes can number: use one of them",
        object.class_name, max_labels));
  check_vertices(object.mesh, farthest_m);
}

std::vector<std::string> SessionObjects::materials_with(const std::string& material) const {
  std::vector<std::string> names = materials_;
  join(names, material);
  return names;
}

std::uint32_t SessionObjects::add(MovingObject object, const Pose& pose,
                                  const std::function<void()>& stop_check) {
  check(object, pose);
  bool closed = refine::encloses_volume(object.mesh);
  if (!closed) {  // it may be inside out, or its faces have no common vertices
    refine::TriangleMesh repaired = refine::repair(object.mesh).mesh;
    closed = refine::encloses_volume(repaired);
    if (closed) object.mesh = std::move(repaired);
  }
  const std::size_t body = faces_.free_body(), instance = first_instance_ + body;
  ObjectSurface made(object.mesh, static_cast<std::uint16_t>(fixed_labels_ + body), stop_check),
      surface;
  made.place_at(place_of(pose), surface);
  std::vector<std::string> materials = materials_, classes = classes_;
  const Label label{
      .sediment = static_cast<std::uint16_t>(join(materials, std::move(object.material))),
      .class_id = static_cast<std::uint16_t>(join(classes, std::move(object.class_name))),
      .instance = static_cast<std::uint16_t>(instance),
      .two_sided = !closed};
  labels_.resize(std::max(labels_.size(), body + 1));
  made_.resize(labels_.size());
  surfaces_.resize(labels_.size());
  faces_.add(std::move(object.mesh), place_of(pose));
  // From here on nothing throws.
  made_[body] = std::move(made);
  surfaces_[body] = std::move(surface);
  labels_[body] = label;
  materials_ = std::move(materials);
  classes_ = std::move(classes);
  return static_cast<std::uint32_t>(instance);
}

std::uint32_t SessionObjects::next_instance() const {
  return static_cast<std::uint32_t>(first_instance_ + faces_.free_body());
}

std::size_t SessionObjects::body_of(std::uint32_t instance) const {
  const std::size_t body = instance - first_instance_;
  if (instance >= first_instance_ && faces_.has(body)) return body;
  std::string added;
  for (std::size_t i = 0; i < labels_.size(); ++i)
    if (faces_.has(i)) added += fmt::format("{}{}", added.empty() ? "" : ", ", first_instance_ + i);
  throw std::invalid_argument(fmt::format(
      "Simulator: no object that was added has instance {}{}; {}", instance,
      instance > 0 && instance < first_instance_
          ? ", which belongs to the scene and is fixed: leave it out of the scene, and add it"
          : "",
      added.empty() ? "add an object first"
                    : fmt::format("those that can be moved or removed are {}", added)));
}

double SessionObjects::lowest_m() const {
  double lowest_m = std::numeric_limits<double>::infinity();
  for (const ObjectSurface& surface : surfaces_)
    if (!surface.flat_parts.empty())
      lowest_m = std::min(lowest_m, surface.middle.z() - surface.radius_m);
  return lowest_m;
}

void SessionObjects::move(std::uint32_t instance, const Pose& pose) {
  const std::size_t body = body_of(instance);
  check_pose(pose);
  faces_.move(body, place_of(pose));
  made_[body].place_at(place_of(pose), surfaces_[body]);
}

void SessionObjects::remove(std::uint32_t instance) {
  const std::size_t body = body_of(instance);
  faces_.remove(body);
  made_[body] = surfaces_[body] = {};
  if (body < follows_.size()) follows_[body] = false;
}

void SessionObjects::add(const std::vector<MovingRecord>& moving,
                         const std::function<void()>& stop_check) {
  for (const MovingRecord& object : moving)
    add({.mesh = object.mesh,
         .material = materials_.at(object.record.label.sediment),
         .class_name = classes_.at(object.record.label.class_id)},
        pose_of(object.way.at(0.0)), stop_check);
  follows_.assign(moving.size(), true);
}

void SessionObjects::follow(const std::vector<MovingRecord>& moving, double t_s) {
  for (std::size_t i = 0; i < moving.size(); ++i)
    if (follows_[i])
      move(static_cast<std::uint32_t>(first_instance_ + i), pose_of(moving[i].way.at(t_s)));
}

}  // namespace ensonify::engine
