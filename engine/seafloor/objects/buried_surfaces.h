#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed_height.h>
#include <ensonify/engine/seafloor/objects/object_surface.h>

namespace ensonify::engine {

/// A part of an object's surface that is buried in the bed.
struct BuriedPart {
  FlatPart flat;
  const FlatPart* whole;       ///< the flat part that it was cut from
  double depth_m;              ///< distance from the part's middle to the bed's plane
  Eigen::Vector3d bed_normal;  ///< of the bed's plane, unit, upwards
  std::uint32_t bed_face;      ///< topmost face of the bed above the part's middle
};

/// Some neighbouring buried parts of one object. All parts of a flat part are in one group.
struct BuriedGroup {
  std::uint16_t label = 0;               ///< of the object, as in FaceLabels
  const CurvedFacets* curved = nullptr;  ///< of the object
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  ///< radius of a ball about the middle that contains the parts
  std::vector<BuriedPart> parts;
};

/// The topmost point of the bed at a place; nullopt over a hole and outside the bed.
using BedAt = std::function<std::optional<BedPoint>(double x_m, double y_m)>;

/// The parts of the objects' surfaces that are at most `thickness_m` under the bed. Flat parts are
/// cut into smaller parts, above which the bed is nearly a plane. This plane follows from the bed's
/// heights around the part's middle, at distances equal to the part's depth. The objects must
/// outlive the result.
std::vector<BuriedGroup> buried_surfaces(const std::vector<ObjectSurface>& objects,
                                         const BedAt& bed, double thickness_m);

}  // namespace ensonify::engine
