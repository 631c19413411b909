#include <memory>

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/json_schema.h>

#include "app.h"

namespace ensonify::engine::app {

void add_schema(CLI::App& app, Action& action) {
  struct Arguments {
    bool json = false, recipe = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("schema", "Print all keys of a scene file with unit, range and default");
  CLI::Option* json = command->add_flag(
      "--json-schema", arguments->json,
      "Print a JSON Schema instead, with which editors complete and check scene files");
  command->add_flag("--recipe", arguments->recipe, "The schema of recipes")->needs(json);
  command->callback([&action, arguments] {
    action = [arguments] {
      print(arguments->json ? json_schema(arguments->recipe) : schema_text());
    };
  });
}

}  // namespace ensonify::engine::app
