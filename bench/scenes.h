#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::bench {

/// A square of rippled sand of 200 m, 10 m below the sonar, of about `faces` faces.
engine::Scene ripples(double faces);

/// A square of 500 m of fractal relief, 15 m below the sonar, of about `faces` faces.
engine::Scene fractal(double faces);

/// A bed for timing pings: its name, and its scene of about `faces` faces, without speckle and
/// noise, under two fans of 8 planes and 4096 elevations. `scene` returns nothing if the bed's data
/// are not in the folder.
struct Bed {
  std::string_view name;
  std::string_view help;
  std::optional<engine::Scene> (*scene)(double faces, const std::filesystem::path& data);
};
std::span<const Bed> beds();

/// The recipe of scenes/target_recognition.toml.
extern const std::string_view target_recipe;

/// How many faces a bed has.
struct Size {
  std::string_view name;
  double faces;
};
inline constexpr Size sizes[] = {{"0.5M", 0.5e6}, {"2M", 2e6}, {"8M", 8e6}, {"33M", 33e6}};

}  // namespace ensonify::bench
