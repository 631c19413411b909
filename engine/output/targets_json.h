#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// An angle in degrees, from 0 to less than 360.
double turned_deg(double rad);

/// What the picture of a waterfall shows of the seafloor's objects and features, as JSON. Each
/// target has its labels, place and size; range, side and ping; and contrast in dB. An object also
/// has its heading (degrees), burial, visible share (null if it was not counted) and aspect (the
/// direction of sight minus the heading, degrees clockwise). A feature has its layer. The body and
/// the shadow of a target have, in pixels of NAME.png, a box [column, row, columns, rows], an area
/// and polygons [column, row, ...]; if there are holes, also all pixels as `rle`, the run lengths
/// of COCO. A body or shadow without a pixel is null.
std::string targets_json(std::span<const TargetRecord> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor);

/// A target in the labels of one image of a dataset.
struct TargetLabel {
  TargetRecord record;          ///< as in the whole line, but with the outlines in this image
  double shown_fraction = 1.0;  ///< area in this image divided by the area in the whole line
  bool truncated = false;       ///< the image lacks a part of the target, or the line may lack one
  bool ignored = false;         ///< the visible part of the target is too small for a label
  std::size_t category_id = 0;
  /// Of a frame: mean bearing of the same pixels as range_m, from ahead to starboard.
  std::optional<double> bearing_rad = {};
};

/// Where the sonar was, and which part of the sonar's swath an image shows.
struct ImageGeometry {
  double frequency_hz = 0.0, range_m = 0.0;
  std::string sides;     ///< both, port or starboard; of a frame: ahead
  double left_m = 0.0;   ///< slant range or ground range at the left edge, negative to port
  double right_m = 0.0;  ///< the same at the right edge
  std::size_t first_ping = 0, last_ping = 0;  ///< numbered as in the run
  /// The sonar's height over the bed straight below, mean of the pings; NaN over holes.
  double altitude_m = 0.0;
  Pose middle;  ///< of the vehicle at the middle ping
};

/// The labels of one image of a dataset: a whole line or a part of it.
struct ImageLabels {
  std::string image;                  ///< name of its files, without extension
  std::vector<std::string> pictures;  ///< names of its pictures' files
  std::string kind;                   ///< line, frame, tile, chip, background or hard_negative
  std::string of = {};                ///< for a chip: class of the target or lookalike
  std::uint32_t of_instance = 0;      ///< for a chip: instance of the target; 0: none
  std::string geometry;               ///< slant or ground; of a frame: beams or fan
  std::string sonar;
  std::size_t column = 0, row = 0, columns = 0, rows = 0;  ///< the part of the line that it shows
  std::size_t width = 0, height = 0;                       ///< of the picture, px
  double pixel_across_m = 0.0, pixel_along_m = 0.0;
  ImageGeometry seen_from;
  std::string split;
  std::optional<std::size_t> frame = {};  ///< of a frame: the number of its ping in the run
  std::vector<std::string> classes = {};  ///< in the class mask of the image
  std::vector<TargetLabel> targets = {};
};

/// The labels of one image as JSON.
std::string labels_json(const ImageLabels& labels);

}  // namespace ensonify::engine
