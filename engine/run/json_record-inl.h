#pragma once

#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {

/// Returns read(json) for the JSON in a file of a run's folder. If `read` throws a std::logic_error
/// or an exception of the JSON library, throws SceneError. Its message contains `what` (the
/// expected content) and `remedy`.
template <class Read>
auto read_json_record(const std::filesystem::path& file, std::string_view what,
                      std::string_view remedy, Read&& read) {
  const std::string text = refine::read_file(file, most_json_bytes);
  const auto fault = [&](const std::exception& error) {
    return SceneError(
        fmt::format("{}: not the {} ({}); {}", file.string(), what, fault_in_json(error), remedy));
  };
  try {
    return read(json_of<nlohmann::ordered_json>(text));
  } catch (const nlohmann::ordered_json::exception& error) {
    throw fault(error);
  } catch (const std::logic_error& error) {
    throw fault(error);
  }
}

inline constexpr std::string_view make_part_again = "remove the part's folder and run it again";

}  // namespace ensonify::engine
