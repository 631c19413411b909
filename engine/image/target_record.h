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

/// A target, with data of the object or feature of the bed (such as a trawl mark) that it shows.
struct TargetRecord {
  /// What only an object has.
  struct Object {
    std::size_t table = 0;  ///< number of its table in the scene's [[objects]], from 0
    double heading_rad = 0.0;
    double scale = 1.0;
    double buried = 0.0;      ///< share of its height under the bed
    double aspect_rad = 0.0;  ///< direction of sight minus its heading, clockwise
    /// Share of the object that the sonar sees (ObjectVisibility::share()); none if not counted.
    std::optional<double> visible_share;
  };

  Target target;
  std::string class_name, material;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< of its bounding box, local metres
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();    ///< of its bounding box: east, north, up
  std::optional<Object> object;                        ///< none for a feature
  std::string layer;  ///< the layer that made the feature (FeatureRecord); empty for an object

  bool is_object() const { return object.has_value(); }
};

/// The targets of a waterfall over its seafloor, ordered by instance. `views` is how much of each
/// object of the seafloor the sonar saw; empty if not counted. An object that moves has the place
/// and heading of the row nearest to its mean ping.
std::vector<TargetRecord> target_records(const Waterfall& waterfall, const Seafloor& seafloor,
                                         std::span<const ObjectVisibility> views = {});

}  // namespace ensonify::engine
