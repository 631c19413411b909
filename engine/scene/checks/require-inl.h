#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <ensonify/engine/base/scene_error.h>

namespace ensonify::engine {

/// Requires conditions of a scene. `place` returns the place of a key for messages.
class Require {
 public:
  explicit Require(const std::function<std::string(std::string_view key)>& place) : place_(place) {}

  /// Throws SceneError with the place of `key` and the message, unless the condition holds.
  template <class... Values>
  void operator()(bool holds, std::string_view key, fmt::format_string<const Values&...> message,
                  const Values&... values) const {
    if (!holds)
      throw SceneError(fmt::format("{}: {}", place_(key), fmt::format(message, values...)));
  }

 private:
  const std::function<std::string(std::string_view)>& place_;
};

}  // namespace ensonify::engine
