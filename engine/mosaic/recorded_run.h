#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// The used positions of a run: true positions, or those of the navigation as in a real recording.
enum class Positions { truth, navigation };

/// What a mosaic needs of one ping of a sonar.
struct MosaicPing {
  /// Position of the sonar, metres east and north of the run's world origin. With
  /// Positions::navigation it follows from the reported pose. Pings that repeat a report are
  /// interpolated between this report and the next.
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  ///< of the sonar's x axis
  double height_m = 0.0;     ///< of the sonar above the bed; 0: unknown
  std::uint32_t image = 0;   ///< the number of the ping's image
  std::uint32_t row = 0;     ///< the ping's row in this image
};

/// All pings of one sonar of a run, and its image files.
struct RecordedRun {
  Sonar sonar;  ///< as in the scene, with the images' bins
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::string reference;  ///< coordinate reference system of the world as WKT; empty: unknown
  std::vector<std::filesystem::path> images;
  std::vector<MosaicPing> pings;  ///< oldest first
};

/// Reads the manifest, the image headers and the tables of pings in the folder of a run with one or
/// several parts. `sonar` is the name of the sonar; empty: the run has only one. Throws SceneError
/// if something is missing, is damaged or does not fit.
RecordedRun read_recorded_run(const std::filesystem::path& folder, const std::string& sonar,
                              Positions positions);

}  // namespace ensonify::engine
