#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/dataset_options.h>

#include <memory>

#include "app.h"

namespace ensonify::engine::app {

void add_dump_default(CLI::App& app, Action& action) {
  const auto what = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("dump-default", "Print a commented file with all keys");
  command.add_option("WHAT", *what, "run: a scene; generate: a dataset's recipe")
      ->required()
      ->check(one_of({"run", "generate"}));
  command.callback([&action, what] {
    action = [what] { print(*what == "run" ? dump_scene(Scene{}) : dump_recipe()); };
  });
}

}  // namespace ensonify::engine::app
