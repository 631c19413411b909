#include <ensonify/engine/scene/reader.h>

#include "app.h"

namespace ensonify::engine::app {

void add_schema(CLI::App& app, Action& action) {
  app.add_subcommand("schema", "Print every key of a scene file: unit, range, default")
      ->callback([&action] { action = [] { print(schema_text()); }; });
}

}  // namespace ensonify::engine::app
