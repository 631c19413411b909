#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <ensonify/engine/seafloor/fractal.h>
#include <ensonify/engine/seafloor/heightfield.h>
#include <ensonify/engine/seafloor/ripples.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

enum class SeafloorKind { fractal, survey };

/// Where the seafloor comes from.
struct SeafloorOptions {
  SeafloorKind kind = SeafloorKind::fractal;
  // fractal
  double extent_east_m = 200.0;
  double extent_north_m = 140.0;
  double cell_m = 0.2;
  double depth_m = 20.0;  ///< mean depth below the sea surface
  FractalRelief fractal;
  RippleRelief ripples;
  // survey
  std::filesystem::path survey;
  double water_level_m = 0.0;  ///< height of the sea surface in the survey's own heights
  // what it is made of
  double lambert_mu_db = -27.0;
};

/// What a face belongs to; 0 is none.
struct Label {
  std::uint16_t sediment = 0;
  std::uint16_t class_id = 0;
  std::uint16_t instance = 0;
};

/// The mesh, and what each face is. Local z is height above the sea surface, so it is negative.
struct Seafloor {
  refine::TriangleMesh mesh;
  std::vector<Label> labels;              ///< the different ones there are; at least one
  std::vector<std::uint16_t> face_label;  ///< into labels, one a face; empty: all are labels[0]

  std::uint16_t label_of(std::uint32_t face) const {
    return face_label.empty() ? std::uint16_t{0} : face_label[face];
  }
};

/// The heights that options describe. Throws std::invalid_argument for options that make no bed
/// below the sea surface, refine::MeshError for a survey that makes none, and what its parts throw.
Heightfield make_heightfield(const SeafloorOptions& options, std::uint64_t seed);
/// The same as a mesh, one label for the whole bed.
Seafloor make_seafloor(const SeafloorOptions& options, std::uint64_t seed);

}  // namespace ensonify::engine
