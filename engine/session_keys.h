#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

// Sessions that are changed by a scene's keys: `ensonify stream`, the live view and Python.

/// A key of a scene, by its whole name with dots, and its value as TOML writes it; JSON's strings,
/// numbers, truth values and lists are TOML as well.
struct KeyValue {
  std::string key, value;
  friend bool operator==(const KeyValue&, const KeyValue&) = default;
};

/// The scene of a session: its text, which is read once, and the keys that were changed since then.
/// Only the last value of a key is kept, so a long session is no slower. Copies share the text.
class SessionScene {
 public:
  /// The arguments are those of parse_scene().
  SessionScene(std::string text, std::string name, std::vector<std::string> overrides,
               ScenePaths paths);
  /// Reads a file; the arguments are those of read_scene(). Throws SceneError.
  static SessionScene of_file(const std::filesystem::path& file, std::vector<std::string> overrides,
                              const std::filesystem::path& data_folder);

  /// The scene with the kept changes and with these. Throws SceneError.
  Scene with(std::span<const KeyValue> changes = {}) const;

  /// Adds these changes to the kept ones.
  void keep(std::span<const KeyValue> changes);
  /// Undoes kept changes: their keys get the values that they had in `before`. A key that was
  /// changed again stays as it is.
  void take_back(std::span<const KeyValue> changes, const SessionScene& before);

  const ScenePaths& paths() const { return paths_; }

 private:
  std::shared_ptr<const std::string> text_;
  std::string name_;
  std::vector<std::string> overrides_;
  ScenePaths paths_;
  std::vector<KeyValue> changes_;  // in the order of their last change; each key once
};

/// Whether a key is `sonar.NAME.key`, in bare words of letters, digits, _ and -. TOML has more ways
/// to write a sonar's key: with quotes, spaces or a table as the value.
bool is_sonar_key(std::string_view key);

/// The scene's sonars that any of these keys (`sonar.NAME.key`) changes, with their numbers. A
/// preset can change all of them: it makes the scene's conditions those of a survey.
std::vector<std::pair<std::size_t, Sonar>> changed_sonars(const Scene& scene,
                                                          std::span<const KeyValue> changes);

/// Changes keys of a simulator's sonars, and keeps them. Throws SceneError for a key without
/// is_sonar_key() and for a value that a scene refuses; then nothing is changed.
void set_sonars(Simulator& simulator, SessionScene& scene, std::span<const KeyValue> changes);

/// Warnings of the scene's lost and repeated pings, which single pings of a Simulator never are:
/// only whole tracks, of a run or of the live view, have them.
std::vector<std::string> warnings_for_single_pings(const Scene& scene);

/// The object that keys of a scene's [[objects]] describe: its form, material and class. Its
/// origin, which a pose places, is the middle of its bounds. The material may be one of `scene`,
/// the session's. Without the key shape_seed the form of a boulder, for example, follows from that
/// scene's seed and from `number`, for which a session takes Simulator::next_instance(). `name`
/// stands for the scene's file in messages. Throws SceneError, also for keys of place, angles and
/// number of objects, and what mesh_of() throws.
MovingObject object_of(std::span<const KeyValue> keys, std::string_view name, const Scene& scene,
                       const ScenePaths& paths, std::uint32_t number);

}  // namespace ensonify::engine
