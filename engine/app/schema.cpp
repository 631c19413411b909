#include <ensonify/engine/scene/reader.h>

#include "app.h"

namespace ensonify::engine::app {

void add_schema(CLI::App& app, Action& action) {
  app.add_subcommand("schema", "Print all keys of a scene file with unit, range and default")
      ->callback([&action] { action = [] { print(schema_text()); }; });
}

}  // namespace ensonify::engine::app
