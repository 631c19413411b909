#pragma once

#include <string>

#include <ensonify/engine/seafloor/input_file.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A thing on the bed, or over it. Its mesh has z up; its middle is that of its bounds.
struct ObjectOptions {
  InputFile mesh;
  std::string class_name = "object";
  std::string material = "steel";
  double east_m = 0.0;   ///< its middle, local metres
  double north_m = 0.0;  ///< its middle, local metres
  /// Between the bed and the place of the object that comes nearest to it, up and down: 0 stands on
  /// the bed, more floats, less is sunk into it.
  double height_m = 0.0;
  // About its middle: heading turns the mesh's y from north clockwise, then pitch lifts the y end,
  // then roll lowers the x side.
  double heading_rad = 0.0;
  double pitch_rad = 0.0;
  double roll_rad = 0.0;
  double scale = 1.0;   ///< metres a unit of the file
  double weld_m = 0.0;  ///< the mesh's vertices this close (after scaling) become one
};

/// An object's repaired mesh, turned, scaled and set down over a bed, in the bed's local metres.
/// The object rests where one of its vertices meets the bed or a vertex of the bed meets it. Throws
/// refine::MeshError for a mesh that cannot be read, and for a place without a bed below.
refine::RepairedMesh place_object(const ObjectOptions& object, refine::Triangles bed);

}  // namespace ensonify::engine
