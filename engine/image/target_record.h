#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>

namespace ensonify::engine {

/// A target together with what is known of the thing that it shows: an object, or a feature of the
/// bed such as a trawl mark.
struct TargetRecord {
  /// What only an object has.
  struct Object {
    std::size_t table = 0;  ///< of the scene's [[objects]], from 0
    double heading_rad = 0.0;
    double scale = 1.0;
    double buried = 0.0;      ///< share of its height under the bed
    double aspect_rad = 0.0;  ///< direction of sight less its heading, clockwise
    /// Share of the object that the sonar sees, ObjectVisibility::share(); none if that was not
    /// counted.
    std::optional<double> visible_share;
  };

  Target target;
  std::string class_name, material;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of its bounds, local metres
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    ///< of its bounds: east, north, up
  std::optional<Object> object;                        ///< none for a feature
  std::string layer;  ///< that made the feature, as in FeatureRecord; empty for an object

  bool is_object() const { return object.has_value(); }
};

/// The targets of a waterfall over its seafloor, by instance. `views` is how much of each object of
/// the seafloor its sonar saw; empty if that was not counted.
std::vector<TargetRecord> target_records(const Waterfall& waterfall, const Seafloor& seafloor,
                                         std::span<const ObjectVisibility> views = {});

}  // namespace ensonify::engine
