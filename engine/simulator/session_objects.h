#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <ensonify/engine/moving_object.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>

namespace ensonify::engine {

/// Throws std::invalid_argument for a pose that is not finite, lies beyond 1e8 m, or turns faster
/// than a million degrees per second.
void check_pose(const Pose& pose);

/// The objects that a session adds to its scene: their places, labels and instances, and the names
/// of all classes and materials, the seafloor's first. Each object is one body of the faces. Throws
/// as Simulator, before anything is changed.
class SessionObjects {
 public:
  /// Both must outlive this.
  SessionObjects(const Seafloor& seafloor, FacesWithBodies& faces);

  /// Throws what Simulator::add() throws for the pose, the mesh and the number of objects.
  void check(const MovingObject& object, const Pose& pose) const;
  /// The materials, with this one at the end if it is new.
  std::vector<std::string> materials_with(const std::string& material) const;

  /// The instance that the next add() returns.
  std::uint32_t next_instance() const;
  /// Returns the object's instance. Does not check the material. What stop_check throws ends it.
  std::uint32_t add(MovingObject object, const Pose& pose,
                    const std::function<void()>& stop_check = {});
  void move(std::uint32_t instance, const Pose& pose);
  void remove(std::uint32_t instance);

  /// Adds the scene's objects that move, where they are at time 0. follow() then moves those that
  /// were not removed to their places at a time.
  void add(const std::vector<MovingRecord>& moving, const std::function<void()>& stop_check);
  void follow(const std::vector<MovingRecord>& moving, double t_s);

  bool any() const { return faces_.bodies() > 0; }
  /// A height below all objects; infinite if there is none.
  double lowest_m() const;

  /// By body; class 0 if there is no such body.
  const std::vector<Label>& labels() const { return labels_; }
  /// By body, at its present place; without flat parts if there is no such body.
  const std::vector<ObjectSurface>& surfaces() const { return surfaces_; }
  const std::vector<std::string>& classes() const { return classes_; }
  const std::vector<std::string>& materials() const { return materials_; }

 private:
  std::size_t body_of(std::uint32_t instance) const;

  FacesWithBodies& faces_;
  std::size_t fixed_labels_;
  std::size_t first_instance_;
  std::vector<Label> labels_;
  std::vector<ObjectSurface> made_, surfaces_;  // in the mesh's axes, and at the present place
  std::vector<std::string> classes_, materials_;
  std::vector<bool> follows_;  // by object that moves; false after remove()
};

}  // namespace ensonify::engine
