#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "support/message.h"

#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>

namespace ensonify::tests {

using namespace engine;

/// What an option holds, bit by bit.
template <class Owner>
std::string bits(const Key<Owner>& key, Owner& owner) {
  return std::visit(
      [](const auto* value) -> std::string {
        using T = std::remove_cvref_t<decltype(*value)>;
        if constexpr (std::is_same_v<T, std::optional<double>>)
          return *value ? fmt::format("{:x}", std::bit_cast<std::uint64_t>(**value)) : "unset";
        else if constexpr (std::is_same_v<T, std::optional<std::uint64_t>>)
          return *value ? fmt::format("{}", **value) : "unset";
        else if constexpr (std::is_same_v<T, std::vector<std::string>>)
          return fmt::format("{}", fmt::join(*value, "|"));
        else if constexpr (std::is_same_v<T, double>)
          return fmt::format("{:x}", std::bit_cast<std::uint64_t>(*value));
        else if constexpr (std::is_same_v<T, std::vector<double>>) {
          std::string all;
          for (const double v : *value)
            all += fmt::format("{:x} ", std::bit_cast<std::uint64_t>(v));
          return all;
        } else if constexpr (std::is_enum_v<T>)
          return fmt::format("{}", static_cast<int>(*value));
        else if constexpr (std::is_same_v<T, InputFile>)
          return value->name;
        else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>) {
          std::string all;
          for (const Eigen::Vector2d& p : *value)
            for (const double v : p) all += fmt::format("{:x} ", std::bit_cast<std::uint64_t>(v));
          return all;
        } else {
          return fmt::format("{}", *value);
        }
      },
      key.option(owner));
}

/// Every option of a scene under its whole name, bit by bit.
inline std::vector<std::string> contents(Scene scene) {
  std::vector<std::string> out;
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      out.push_back(fmt::format("{}.{} {}", section.name, key.name, bits(key, scene)));
  for_each_list(scene, [&](const auto& section, auto& list) {
    for (auto& item : list)
      for (const auto& key : section.keys)
        out.push_back(fmt::format("{} {} {}", section.name, key.name, bits(key, item)));
  });
  for (Material& material : scene.materials)
    for (const auto& key : material_section().keys)
      out.push_back(fmt::format("{}.{} {}", material.name, key.name, bits(key, material)));
  for (Sonar& sonar : scene.sonars)
    for (const auto& key : sonar_section().keys)
      out.push_back(fmt::format("{}.{} {}", sonar.name, key.name, bits(key, sonar)));
  return out;
}

inline std::string error_of(const std::function<void()>& action) {
  return message_thrown<SceneError>(action, "no error");
}
inline std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {},
                            const ScenePaths& paths = {}) {
  return error_of([&] { parse_scene(text, "s.toml", overrides, paths); });
}
inline Scene parsed(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s.toml", overrides);
}

inline const std::string head = "version = 1\n";

}  // namespace ensonify::tests
