#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// Which positions of a run are used: the true ones, or those of the navigation, as in a real
/// recording.
enum class Positions { truth, navigation };

/// One ping of a sonar, as a mosaic needs it.
struct MosaicPing {
  /// Position of the sonar, east and north of the run's world origin. With Positions::navigation it
  /// follows from the reported pose; repeated reports are interpolated to the next one.
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  ///< of the sonar's x axis
  double height_m = 0.0;     ///< of the sonar above the bed; 0: unknown
  std::uint32_t image = 0;   ///< the number of its image
  std::uint32_t row = 0;     ///< its row there
};

/// All pings of one sonar of a run, and its image files.
struct RecordedRun {
  Sonar sonar;  ///< as in the scene, with the images' bins
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::string reference;  ///< coordinate reference system of the world as WKT; empty: unknown
  std::vector<std::filesystem::path> images;
  std::vector<MosaicPing> pings;  ///< oldest first
};

/// Reads the manifest, the image headers and the tables of pings of a run's folder, whether the run
/// was made in one part or in several. `sonar` empty: the only one. Throws SceneError if something
/// is missing, damaged or does not fit.
RecordedRun read_recorded_run(const std::filesystem::path& folder, const std::string& sonar,
                              Positions positions);

}  // namespace ensonify::engine
