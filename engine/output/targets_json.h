#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// An angle in degrees, from 0 to less than 360.
double turned_deg(double rad);

/// What the picture of a waterfall shows of the seafloor's objects and features, as JSON. For each
/// target: its labels, place and size; for an object its heading (degrees), burial and visible
/// share (null where it was not counted), for a feature its layer; range, side, ping and, for an
/// object, the aspect (the direction of sight less the heading, degrees clockwise); contrast in dB;
/// box [column, row, columns, rows], area and polygons [column, row, ...] of its body and of its
/// shadow in pixels of NAME.png, and where these have holes all their pixels as `rle`, COCO's run
/// lengths. A body or shadow without a pixel is null.
std::string targets_json(std::span<const TargetRecord> targets, const Waterfall& waterfall,
                         const Seafloor& seafloor);

/// A target as the labels of one image of a dataset have it.
struct TargetLabel {
  TargetRecord record;          ///< as in the whole line, but with the outlines in this image
  double shown_fraction = 1.0;  ///< area in this image over that in the whole line
  bool truncated = false;       ///< the image lacks a part of it, or the line may
  bool ignored = false;         ///< too little of the target shows for a label
  std::size_t category_id = 0;
};

/// Where the sonar was, and which part of its swath an image shows.
struct ImageGeometry {
  double frequency_hz = 0.0, range_m = 0.0;
  std::string sides;     ///< both, port or starboard
  double left_m = 0.0;   ///< across the track at the left edge, negative to port: slant range,
                         ///< or ground range
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
  std::string kind;                   ///< line, tile, chip, background or hard_negative
  std::string of = {};                ///< of a chip: class of its target or lookalike
  std::uint32_t of_instance = 0;      ///< of a chip: the target that it is about; 0: none
  std::string geometry;               ///< slant or ground
  std::string sonar;
  std::size_t column = 0, row = 0, columns = 0, rows = 0;  ///< of the line: what it shows
  std::size_t width = 0, height = 0;                       ///< of the picture
  double pixel_across_m = 0.0, pixel_along_m = 0.0;
  ImageGeometry seen_from;
  std::string split;
  std::vector<std::string> classes;  ///< that its class mask holds
  std::vector<TargetLabel> targets;
};

/// The same as JSON.
std::string labels_json(const ImageLabels& labels);

}  // namespace ensonify::engine
