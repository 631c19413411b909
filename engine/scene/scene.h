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

/// The sea: its temperature and salinity, or a cast or plain numbers if given.
struct Sea {
  scatter::SeaWater water;
  InputFile profile;  ///< a sound speed profile, of which the mean down to the bed is taken
  RefractionMode refraction = RefractionMode::off;  ///< what the profile changes
  std::optional<double> sound_speed_mps;       ///< unset: from the water, at half the bed's depth
  std::optional<double> absorption_db_per_km;  ///< unset: from the water, at half the bed's depth
  SeaState state;
};

/// The value of RunOptions::surface for which prepare_seafloor() chooses a face source.
inline constexpr std::string_view auto_surface = "auto";

/// How a run is computed. It does not change the result, except for the intersector's last bits.
struct RunOptions {
  std::string surface{auto_surface};  ///< a face source's name, or auto
  std::string intersector = "fan_scan";
  IntersectorOptions intersection;
  int tree_pings = 6;    ///< for how many pings one tree of exact faces is used
  int block_pings = 64;  ///< pings are computed in aligned blocks of this many
};

struct OutputOptions {
  bool exr = true, npz = false, xtf = false, jsf = false;  ///< see output_formats()
  LayerEncoding encoding;                                  ///< of EXR and NPZ
  int png_bits = 8;                                        ///< of NAME.png, 8 or 16
  bool truth = false;  ///< the truth drawn over the image, NAME_truth.png
  std::vector<std::string> class_names, sediment_names;  ///< numbers 1, 2, ... of the layers
  std::string start_time;      ///< of the recordings, when t_s is 0; empty: see the key's help
  int pings_per_file = 0;      ///< 0: one part for short runs, see RunParts
  bool file_per_leg = false;   ///< a part for each leg of a lawn-mower
  bool one_recording = false;  ///< all sonars in one XTF or JSF, instead of one file each
};

/// Which set of defaults the scene's other keys have; see use_conditions().
enum class Conditions { by_preset, ideal, survey };

/// Every option of a run. The defaults make a scene with a good image.
struct Scene {
  Conditions conditions = Conditions::by_preset;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> seafloor_seed;  ///< of the seafloor and its objects; unset: `seed`
  bool speckle = true;
  bool texture = true;  ///< whether materials scatter unevenly below the cell; needs speckle
  Sea sea;
  SeafloorOptions seafloor;
  std::vector<ObjectOptions> objects;
  std::vector<Material> materials;  ///< those that the scene defines
  TrackOptions track;
  MotionOptions motion;
  NavigationOptions navigation;
  std::vector<Sonar> sonars = {Sonar{}};
  OtherPathsOptions arrivals;
  ArtefactOptions artefacts;
  RunOptions run;
  Display display;
  OutputOptions output;
  /// Where the file has its keys, "file:line:column", for errors that are found later. Not an
  /// option.
  std::map<std::string, std::string, std::less<>> places;
  /// Warnings of keys without effect (scene/checks/unused_keys.h). Not an option.
  std::vector<std::string> warnings;

  std::uint64_t bed_seed() const { return seafloor_seed.value_or(seed); }
  /// The time from ping to ping; where the track does not give it, the two-way time of the longest
  /// range.
  double ping_interval_s(double sound_speed_mps) const;
};

}  // namespace ensonify::engine
