#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/program.h"

namespace ensonify::tests {

/// Makes the dataset of recipe.toml in a folder.
inline Outcome generate(const std::filesystem::path& folder, const std::string& dataset,
                        std::vector<std::string> more = {},
                        const std::function<void(pid_t)>& meanwhile = {}) {
  std::vector<std::string> arguments{"generate", "recipe.toml", "-o", dataset, "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_program(folder, arguments, {}, meanwhile);
}

/// The same; fails unless all samples are made.
inline void generate_whole(const std::filesystem::path& folder, const std::string& dataset,
                           std::vector<std::string> more = {}) {
  const Outcome outcome = generate(folder, dataset, std::move(more));
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

}  // namespace ensonify::tests
