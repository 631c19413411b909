#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/image/display_options.h>
#include <ensonify/engine/output/layer_encoding.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/seafloor/objects/object_options.h>
#include <ensonify/engine/seafloor/seafloor_options.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/reception/artefacts.h>
#include <ensonify/engine/sonar/reception/other_paths_options.h>
#include <ensonify/engine/sonar/vehicle/motion_options.h>
#include <ensonify/engine/sonar/vehicle/navigation.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/intersector_options.h>
#include <ensonify/engine/trace/refraction/refraction_mode.h>
#include <ensonify/scatter/sea_water.h>

namespace ensonify::engine {

/// The sea: its temperature and salinity, or a cast, or numbers of sound speed and absorption.
struct Sea {
  scatter::SeaWater water;
  InputFile profile;  ///< a sound speed profile; its mean down to the bed is used
  RefractionMode refraction = RefractionMode::off;  ///< what the profile has an effect on
  std::optional<double> sound_speed_mps;       ///< unset: from the water, at half the bed's depth
  std::optional<double> absorption_db_per_km;  ///< unset: from the water, at half the bed's depth
  SeaState state;
};

/// With this value of RunOptions::surface, prepare_seafloor() chooses a face source.
inline constexpr std::string_view auto_surface = "auto";

/// How a run is computed. These options do not change the result, but the intersector affects its
/// last bits.
struct RunOptions {
  std::string surface{auto_surface};  ///< the name of a face source, or auto
  std::string intersector = "fan_scan";
  IntersectorOptions intersection;
  int tree_pings = 6;    ///< number of pings for which one tree of exact faces is used
  int block_pings = 64;  ///< number of pings in an aligned block, which one thread computes
};

struct OutputOptions {
  bool exr = true, npz = false, xtf = false, jsf = false;  ///< see output_formats()
  LayerEncoding encoding;                                  ///< of EXR and NPZ
  int png_bits = 8;                                        ///< of NAME.png, 8 or 16
  bool truth = false;  ///< the truth drawn over the image, NAME_truth.png
  bool fans = true;    ///< of an imaging sonar: each ping as a fan, NAME_fan_PING.png
  std::vector<std::string> class_names, sediment_names;  ///< of the numbers 1, 2, ... in layers
  std::string start_time;      ///< the recordings' time at t_s = 0; empty: see the help of the key
  int pings_per_file = 0;      ///< 0: a short run has one part, see RunParts
  bool file_per_leg = false;   ///< a part for each leg of a lawn-mower
  bool one_recording = false;  ///< all sonars in one XTF or JSF, instead of one file each
};

/// Which defaults the other keys of the scene have; see use_conditions().
enum class Conditions { by_preset, ideal, survey };

/// All options of a run. The defaults make a scene with a good image.
struct Scene {
  Conditions conditions = Conditions::by_preset;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> seafloor_seed;  ///< of bed and objects; unset: `seed`
  bool speckle = true;
  bool texture = true;  ///< whether materials scatter unevenly below the cell; needs speckle
  Sea sea;
  SeafloorOptions seafloor;
  std::vector<ObjectOptions> objects;
  std::vector<Material> materials;  ///< the materials that the scene defines
  TrackOptions track;
  MotionOptions motion;
  NavigationOptions navigation;
  std::vector<Sonar> sonars = {Sonar{}};
  OtherPathsOptions arrivals;
  ArtefactOptions artefacts;
  RunOptions run;
  Display display;
  OutputOptions output;
  /// The place of each key in the file, "file:line:column", for later errors. Not an option.
  std::map<std::string, std::string, std::less<>> places;
  /// Warnings about keys without effect (scene/checks/check.h). Not an option.
  std::vector<std::string> warnings;

  std::uint64_t bed_seed() const { return seafloor_seed.value_or(seed); }
  /// The time from ping to ping. By default the two-way time of the longest range.
  double ping_interval_s(double sound_speed_mps) const;
};

}  // namespace ensonify::engine
