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

// Keys of a scene that change a session: of `ensonify stream`, of the live view and of Python.

/// A key of a scene and its value. The key has its whole name, with dots. The value is TOML;
/// strings, numbers, truth values and lists of JSON are TOML, too.
struct KeyValue {
  std::string key, value;
  friend bool operator==(const KeyValue&, const KeyValue&) = default;
};

/// The scene of a session: its text, which is read once, and the keys that were changed since then.
/// Only the last value of each key is kept, so long sessions do not get slower. Copies share the
/// text.
class SessionScene {
 public:
  /// The arguments are those of parse_scene().
  SessionScene(std::string text, std::string name, std::vector<std::string> overrides,
               ScenePaths paths);
  /// Reads a file; the arguments are those of read_scene(). Throws SceneError.
  static SessionScene of_file(const std::filesystem::path& file, std::vector<std::string> overrides,
                              const std::filesystem::path& data_folder);

  /// The scene with the kept changes and then the given ones. Throws SceneError.
  Scene with(std::span<const KeyValue> changes = {}) const;

  /// Adds the given changes to the kept ones.
  void keep(std::span<const KeyValue> changes);
  /// Undoes kept changes: each key gets the value that it had in `before`. A key that has another
  /// value by now stays as it is.
  void take_back(std::span<const KeyValue> changes, const SessionScene& before);

  const ScenePaths& paths() const { return paths_; }

 private:
  std::shared_ptr<const std::string> text_;
  std::string name_;
  std::vector<std::string> overrides_;
  ScenePaths paths_;
  std::vector<KeyValue> changes_;  // in the order of their last change; each key once
};

/// Whether a key is written as `sonar.NAME.key`, where both words have only letters, digits, _ and
/// -. TOML has more ways to write a sonar's key: with quotes, spaces or a table as the value.
bool is_sonar_key(std::string_view key);

/// The sonars of the scene that one of these keys (`sonar.NAME.key`) changes, with their numbers. A
/// preset can change all sonars, because it makes the scene's conditions those of a survey.
std::vector<std::pair<std::size_t, Sonar>> changed_sonars(const Scene& scene,
                                                          std::span<const KeyValue> changes);

/// Changes keys of a simulator's sonars, and keeps the changes in `scene`. Throws SceneError for a
/// key that is_sonar_key() refuses and for a value that a scene refuses; then nothing is changed.
void set_sonars(Simulator& simulator, SessionScene& scene, std::span<const KeyValue> changes);

/// Warnings if the scene has lost or repeated pings. Single pings of a Simulator are never lost or
/// repeated, only pings of whole tracks, in a run or in the live view.
std::vector<std::string> warnings_for_single_pings(const Scene& scene);

/// The object that keys of a scene's [[objects]] describe: its form, material and class. The middle
/// of the object's bounds is its origin, which a pose places. The material may be one of `scene`,
/// which is the session's scene. Without the key shape_seed, the form of a boulder, for example,
/// follows from the seed of `scene` and from `number`; a session passes Simulator::next_instance().
/// `name` replaces the file's name in messages. Throws SceneError, also for keys of the place,
/// angles and number of objects, and what mesh_of() throws.
MovingObject object_of(std::span<const KeyValue> keys, std::string_view name, const Scene& scene,
                       const ScenePaths& paths, std::uint32_t number);

}  // namespace ensonify::engine
