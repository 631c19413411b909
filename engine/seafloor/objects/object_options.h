#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/engine/seafloor/objects/shape_size.h>

namespace ensonify::engine {

/// An object on or above the bed, or many similar objects: a mesh or a shape. The object's z points
/// up and its y along the heading. The object's middle is the middle of its bounding box.
struct ObjectOptions {
  InputFile mesh;
  std::string shape;    ///< instead of a mesh: a name of shape_kinds()
  std::string variant;  ///< of the shape: one of ShapeKind::variants; empty: drawn
  /// Seed of the shape's form; unset: it follows from the scene's seed and the object's number.
  std::optional<std::uint64_t> shape_seed;
  ShapeSize size;  ///< of the shape; a mesh uses only the length of its longer horizontal side
  std::string class_name = "object";
  bool part_classes = false;  ///< whether parts have the classes CLASS.PART instead of CLASS
  /// Tables with the same assembly are one object. The first table is the base: its place, burial
  /// and count are those of the whole object. The places of the other tables are relative to the
  /// base's middle and lowest point.
  std::string assembly;
  std::string material = "fouled steel";
  // Place of the object's middle, local metres; for `count` objects the middle of their disc.
  double east_m = 0.0;
  double north_m = 0.0;
  /// The smallest vertical distance between the object and the bed. 0: the object stands on the
  /// bed; positive: it floats; negative: it is sunk into the bed.
  std::optional<double> height_m;
  /// Instead of height_m: the share of the object's height that is sunk into the bed. Without
  /// height_m and burial, the object stands on the bed, or is sunk in as deep as its shape defines.
  std::optional<double> burial;
  bool follow_slope = false;  ///< whether the object tilts with the bed below it
  // The scour around the object (scour.h): depth of the moat / object's height, height of the tail
  // / object's height, and the direction towards which the current flows.
  double scour_ratio = 0.0, tail_ratio = 0.0, current_rad = 0.0;
  // Rotations about the object's middle: heading turns y clockwise from north, then pitch lifts the
  // y end, then roll lowers the x side.
  double heading_rad = 0.0;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
  double scale = 1.0;             ///< metres per unit of the mesh; a factor of sizes and paths
  double weld_tolerance_m = 0.0;  ///< vertices that are closer (after scaling) are merged

  // For a shape that is laid along a path; the path is also that of an object that moves.
  std::vector<Eigen::Vector2d> path;   ///< metres east and north of the object's place
  InputFile path_file;                 ///< a CSV file with the path
  std::optional<double> sag_radius_m;  ///< see laid_line.h; unset: the shape's usual value
  /// Rms change of the burial along the path, and the distance over which the burial changes.
  double burial_spread = 0.0, burial_scale_m = 8.0;

  // For an object that moves: along `path` from its place, or by the poses of a file.
  std::optional<double> speed_mps;
  InputFile poses;  ///< a CSV file, see read_way()
  bool moves() const { return speed_mps || !poses.empty(); }

  // For many objects at random places.
  int count = 0;                      ///< 0: one object, at its place
  std::vector<Eigen::Vector2d> area;  ///< a polygon, east and north, local metres
  double area_radius_m = 0.0;         ///< of a disc about the place; 0 and no `area`: the whole bed
  double margin_m = 0.0;              ///< smallest distance to the area's border
  double gap_m = 0.0;                 ///< smallest distance to other objects; may be negative
  double heading_spread_rad = std::numbers::pi;  ///< headings are uniform within +- this angle
  double scale_min = 1.0, scale_max = 1.0;       ///< factors on `scale` are uniform between these
};

}  // namespace ensonify::engine
