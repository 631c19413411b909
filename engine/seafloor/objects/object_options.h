#pragma once

#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/input_file.h>
#include <ensonify/engine/seafloor/objects/shape_size.h>

namespace ensonify::engine {

/// A thing on the bed, or over it, or many alike: a mesh or a shape. It has z up, and y where its
/// heading points; its middle is that of its bounds.
struct ObjectOptions {
  InputFile mesh;
  std::string shape;  ///< a name of shape_kinds(), instead of a mesh
  ShapeSize size;     ///< of the shape
  std::string class_name = "object";
  std::string material = "steel";
  double east_m = 0.0;   ///< its middle, local metres; of the disc where `count` are placed
  double north_m = 0.0;  ///< its middle, local metres
  /// Between the bed and the place of the object that comes nearest to it, up and down: 0 stands on
  /// the bed, more floats, less is sunk into it.
  double height_m = 0.0;
  double burial = 0.0;        ///< share of its height that is sunk in, instead of height_m
  bool follow_slope = false;  ///< whether it leans with the bed below it
  // About its middle: heading turns y from north clockwise, then pitch lifts the y end, then roll
  // lowers the x side.
  double heading_rad = 0.0;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
  double scale = 1.0;             ///< metres a unit of the mesh
  double weld_tolerance_m = 0.0;  ///< the mesh's vertices this close (after scaling) become one

  // Of a shape that is laid along a path.
  std::vector<Eigen::Vector2d> path;   ///< east and north of its place, metres
  InputFile path_file;                 ///< the same as CSV
  std::optional<double> sag_radius_m;  ///< see laid_line.h; unset: by the shape

  // Many at random places.
  int count = 0;                      ///< 0: one, at its place
  std::vector<Eigen::Vector2d> area;  ///< a polygon, east and north, local metres
  double area_radius_m = 0.0;         ///< a disc about its place; neither: the whole bed
  double margin_m = 0.0;              ///< to the area's border
  double gap_m = 0.0;  ///< between what they cover and all others do; may be negative
  double heading_spread_rad = std::numbers::pi;  ///< evenly this far to either side
  double scale_min = 1.0, scale_max = 1.0;       ///< evenly between, times `scale`
};

}  // namespace ensonify::engine
