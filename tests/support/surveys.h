#pragma once

#include <cmath>
#include <random>
#include <string>

#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/refine/triangle_mesh.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

namespace ensonify::tests {

/// A text grid. Rows are in its order: the northern one first.
inline std::string text_grid(const std::string& rows,
                             const std::string& size = "ncols 4\nnrows 3\n",
                             const std::string& cell = "cellsize 0.5\n") {
  return size + "xllcorner 500000\nyllcorner 4000000\n" + cell + "NODATA_value -9999\n" + rows;
}
inline const std::string rows_4x3 = "-1 -2 -3 -4\n-5 -6 -9999 -8\n-9 -10 -11 -12.5\n";

inline Tiff tiff_4x3() {
  Tiff tiff;
  tiff.columns = 4;
  tiff.rows = 3;
  tiff.heights = {-1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12.5f};
  return tiff;
}

/// The heights that read_survey() returns for a file with these bytes.
inline engine::Heightfield survey_of(const TemporaryFolder& folder, const std::string& bytes,
                                     const std::string& name, double water_level_m = 0.0) {
  write_text(folder / name, bytes);
  return engine::read_survey(folder / name, water_level_m);
}

/// The error message for such a file, which must name the file; empty if it is read. `cell_m` as in
/// SurveyFile.
inline std::string survey_error(const TemporaryFolder& folder, const std::string& bytes,
                                const std::string& name, double cell_m = 0.0) {
  write_text(folder / name, bytes);
  try {
    engine::read_survey({folder / name, cell_m}, 0.0);
  } catch (const refine::MeshError& error) {
    std::string what = error.what();
    CHECK(what.starts_with((folder / name).string() + ": "));
    return what;
  }
  return {};
}

/// How many of 200 damaged copies of a file are refused; survey_error() as above.
inline int refused_when_damaged(const TemporaryFolder& folder, const std::string& good,
                                const std::string& name, double cell_m) {
  std::mt19937 random(11);
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string damaged = good;
    for (unsigned i = 0; i <= random() % 3; ++i)
      damaged[random() % damaged.size()] = static_cast<char>(random());
    if (round % 2 == 0) damaged.resize(random() % damaged.size());
    refused += !survey_error(folder, damaged, name, cell_m).empty();
  }
  return refused;
}

inline bool has(const std::string& text, const std::string& part) {
  UNSCOPED_INFO(text);
  return text.find(part) != std::string::npos;
}

inline double valid_share(const engine::Heightfield& field) {
  double valid = 0.0;
  for (const double z : field.z_m) valid += !std::isnan(z);
  return valid / static_cast<double>(field.z_m.size());
}

}  // namespace ensonify::tests
