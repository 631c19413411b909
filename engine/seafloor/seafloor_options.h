#pragma once

#include <string>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/engine/seafloor/bed/survey_detail.h>
#include <ensonify/engine/seafloor/layers/seabed.h>

namespace ensonify::engine {

enum class SeafloorKind { fractal, survey, mesh, progressive };

/// Where the seafloor comes from.
struct SeafloorOptions {
  SeafloorKind kind = SeafloorKind::fractal;
  // fractal
  double extent_east_m = 200.0;
  double extent_north_m = 140.0;
  double cell_m = 0.2;
  double depth_m = 20.0;      ///< mean depth below the sea surface
  double slope_rad = 0.0;     ///< of the mean plane, to which the relief is added
  double downhill_rad = 0.0;  ///< direction down this slope, clockwise from north
  FractalRelief fractal;
  RippleRelief ripples;
  // survey
  InputFile survey;
  double survey_cell_m = 0.0;        ///< SurveyFile::cell_m, of bed/survey.h
  double uncertainty_scatter = 0.0;  ///< SurveyScatter::of_uncertainty, of bed/survey.h
  SurveyDetail detail;
  // fractal, survey
  SeabedOptions seabed;  ///< the map of the sediments and the relief layers
  // progressive
  InputFile progressive;  ///< a file that `ensonify analyse` wrote: bed, objects and labels
  // mesh
  InputFile mesh;
  double weld_tolerance_m = 0.0;  ///< vertices of the mesh that are closer are merged
  // survey, mesh
  double water_level_m = 0.0;            ///< height of the sea surface in the file's vertical datum
  std::string material = "medium sand";  ///< a name for material_named() of material.h
  /// Thickness of the bed's uppermost layer into which sound penetrates, where the bed's material
  /// is a sediment. Objects buried in this layer return an echo (buried_surfaces.h). 0: none.
  double penetration_m = 0.0;

  /// Whether the bed is a grid of heights.
  bool is_grid() const { return kind == SeafloorKind::fractal || kind == SeafloorKind::survey; }
};

}  // namespace ensonify::engine
